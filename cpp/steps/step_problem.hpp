#pragma once
/// The problem that one step must solve, as a value, and the results of its evaluation.
///
/// Every implicit scheme solves for an inner configuration z over an interval h:
///   M ((z - q0) / h^2 - v0 / h) + grad V(z) + D (z - q0) / h - f = 0,
/// with z = q1, h = dt (backward Euler) or z = (q0 + q1) / 2, h = dt / 2 (implicit midpoint: backward Euler
/// over half the step, then extrapolated). Statics is the same without mass. The energy-momentum scheme
/// replaces grad V by a discrete gradient between q0 and q1 = 2 z - q0:
///   stretching: EA (eps0 + eps1) / 2 (e0 + e1) / (|e0| + |e1|)   [Simo, Tarnow and Doblare 1995];
///   bending, twisting: moments with the exact work, see elasticity/discrete_gradient.hpp; contact: along the mean of
///   the vectors between surfaces, see contact/pressing.cpp.

#include "assembly/assembler.hpp"
#include "contact/contact_linearisation.hpp"
#include "elasticity/discrete_elements.hpp"
#include "elasticity/elements.hpp"
#include "forces/loads.hpp"
#include "model/mass_matrix.hpp"
#include "steps/prescribed.hpp"

namespace withe {

/// Rule of one step from q0 to q1, which defines z. An explicit step evaluates at its end alone. `settling` is backward
/// Euler on the way to an equilibrium: its intervals are not physical time, and inertia alone resists.
enum class StepRule { statics, settling, backward_euler, midpoint, energy_momentum, verlet };

struct StepProblem {
  explicit StepProblem(const Model& of) : model(of) {}

  const Model& model;
  const State* start = nullptr;            ///< must outlive the step
  const Parameters* parameters = nullptr;  ///< must outlive the step
  const Prescribed* prescribed = nullptr;  ///< must outlive the step
  StepRule rule = StepRule::statics;
  double interval = 0;   ///< h, from q0 to z [s]; 0: statics
  double slip_time = 0;  ///< time in which slip happens [s]
  bool exact = false;    ///< true if the matrix has every derivative; else small unsymmetric ones are omitted
  long number = 0;       ///< of the problem, counted up: identifies it

  /// Versions of the parameters.
  long version = -1, natural_version = -1;
  MassMatrix mass, drag;  ///< [kg], [N s/m]
  VectorX gravity;        ///< force per unknown [N]
  ElasticCoefficients elastic;

  /// Configuration at the start, if viscosity or the rule needs it.
  Configuration start_configuration;
  ElasticCoefficients viscous;  ///< viscosity alone, over h, from the start's strains
  ElasticCoefficients damped;   ///< elasticity and viscosity as one

  Loads loads;  ///< their values are in the parameters
  /// Acceleration of held unknowns, which acts on the edges next to them. Empty: they accelerate like all other
  /// unknowns.
  VectorX held_acceleration;

  /// True if z is the middle of the step, and q1 = 2 z - q0.
  bool in_middle() const { return rule == StepRule::midpoint || rule == StepRule::energy_momentum; }
  bool conserves_energy() const { return rule == StepRule::energy_momentum; }
  bool moves() const { return interval != 0.0; }
  /// True if forces that resist rates act: viscosity, drag, dampers.
  bool resists() const { return moves() && rule != StepRule::settling; }
  bool viscous_acts() const { return parameters->viscous && resists(); }
  /// Duration of the whole step [s].
  double duration() const { return in_middle() ? 2.0 * interval : interval; }
  /// q1 that belongs to z, and the derivative of q1 by z.
  void set_end(const VectorX& z, VectorX& end) const {
    if (!in_middle()) {
      end = z;
      return;
    }
    end = 2.0 * z - start->q;
    // A multiplier acts in the middle of a step, and has no value at its end.
    for (const Loop& loop : model.loops)
      end.segment(loop.dof, model.loop_size()) = z.segment(loop.dof, model.loop_size());
  }
  double end_rate() const { return in_middle() ? 2.0 : 1.0; }
};

/// Multipliers of closed loops have no velocity.
inline void clear_multipliers(const Model& model, VectorX& v) {
  for (const Loop& loop : model.loops) v.segment(loop.dof, model.loop_size()).setZero();
}

/// Bounds on the rounding errors of a residual. No iteration removes these errors; see rounding.cpp.
struct RoundingBounds {
  long number = -1;     ///< number of the problem to which they belong
  VectorX rows;         ///< bounds of bending, twisting and inertia
  VectorX axial;        ///< per edge [N]
  double relative = 0;  ///< bound of a direction in space
  double reach = 0;     ///< greatest coordinate [m]
};

/// Derivatives of the inertia of an edge about itself, in the rows of its head (three) and its angle. They are by the
/// edge's vector and angle at z, and by its vector, angle and rate at the start.
struct TurningSlopes {
  static constexpr int kUnknowns = 9;
  double by[4][kUnknowns];
};

/// A force, and a moment about a point.
struct Wrench {
  Vector3 force = Vector3::Zero(), moment = Vector3::Zero();  ///< [N], [N m]
};

/// Inertia of edges that spin and turn, per edge: the force at its head, and the torque.
struct TurningForces {
  VectorX head;    ///< three numbers each [N]
  VectorX torque;  ///< [N m]

  Vec3d at_head(int edge) const { return {head[3 * edge], head[3 * edge + 1], head[3 * edge + 2]}; }
};

/// Result of an evaluation of a problem, owned by the caller.
struct StepData {
  VectorX residual;       ///< projected onto free directions
  VectorX full_residual;  ///< before projection: minus the reactions
  VectorX magnitude;      ///< per row, sum of the absolute contributions
  VectorX floor;          ///< per row, bound on the rounding error
  double potential = 0;   ///< elastic + gravity - loads with a potential [J], if the scene has one

  VectorX z;
  const ContactLinearisation* contact = nullptr;  ///< how Newton's method takes contact
  const double* axial_force = nullptr;  ///< of the mixed method, see stretch_local; null: that of the configuration
  VectorX end;                          ///< q1
  Configuration configuration;          ///< at z
  Configuration end_configuration;      ///< at q1, if viscosity or the rule needs it
  RoundingBounds rounding;

  /// Values that terms share with each other and with read-outs.
  VectorX gradient, row_magnitude;      ///< forces and their absolute values so far; padded by kPadding
  ElasticCoefficients viscous, damped;  ///< of a step whose middle is z
  VectorX force, modulus;               ///< per edge: EA eps [N], EA / L [N / m]
  VectorX change;                       ///< q1 - q0 of an energy-momentum step
  VectorX elastic_rows;                 ///< per unknown, the discrete gradient alone
  AppliedForces custom;                 ///< custom forces at z
  VectorX velocity;                     ///< (z - q0) / h
  VectorX acceleration, inertia;        ///< M times the acceleration [N], [N m]
  TurningForces turning_forces;
  VectorX drag_force;             ///< [N]
  VectorX flow_force, flow_drag;  ///< force of a fluid, and its local drag [N]
  VectorX contact_gradient, contact_floor;
  std::vector<Wrench> hands;           ///< per support that yields: wrench on the rod about the origin
  std::vector<Carrying> carrying;      ///< per part that a body carries
  VectorX unfolded;                    ///< `gradient` before the rows of carried parts are added to those of bodies
  std::vector<Wrench> joints;          ///< on the parts at joints of bodies, see joint_wrenches.hpp
  std::vector<TurningSlopes> turning;  ///< per edge, of an exact matrix in space
};

/// Step of an evaluation under the energy-momentum rule. It refers to `data`, which must outlive it.
inline DiscreteStep discrete_step(const StepProblem& problem, const StepData& data) {
  return {.start = problem.start_configuration,
          .middle = data.configuration,
          .end = data.end_configuration,
          .end_q = data.end,
          .change = data.change};
}

}  // namespace withe
