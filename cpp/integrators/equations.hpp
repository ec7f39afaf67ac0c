#pragma once
/// The residual that one step must bring to zero, and its Jacobian.
///
/// Every implicit scheme solves for an inner configuration z over an interval h:
///   M ((z - q0) / h^2 - v0 / h) + grad V(z) + D (z - q0) / h - f = 0,
/// with z = q1, h = dt (backward Euler) or z = (q0 + q1) / 2, h = dt / 2 (implicit midpoint: backward Euler
/// over half the step, then extrapolated). Statics is the same without mass. The energy-momentum scheme
/// replaces grad V by a discrete gradient between q0 and q1 = 2 z - q0:
///   stretching: EA (eps0 + eps1) / 2 (e0 + e1) / (|e0| + |e1|)   [Simo, Tarnow and Doblare 1995];
///   bending, twisting: moments whose work is what the energy changes by, see elasticity/discrete_gradient.hpp;
///   surfaces that press: along the mean of the ways between them, see contact/pressing.cpp.

#include <memory>
#include <string>
#include <vector>

#include "assembly/assembler.hpp"
#include "contact/contact.hpp"
#include "elasticity/discrete_gradient.hpp"
#include "forces/custom_forces.hpp"
#include "forces/resistive.hpp"
#include "forces/stokeslets.hpp"
#include "integrators/contact_rows.hpp"
#include "integrators/options.hpp"
#include "model/mass_matrix.hpp"
#include "model/state.hpp"

namespace withe {

/// What one evaluation left behind.
struct Evaluation {
  VectorX residual;       ///< projected onto free directions
  VectorX full_residual;  ///< before projection: minus the reactions
  VectorX magnitude;      ///< per row, sum of the absolute contributions
  VectorX floor;          ///< per row, what rounding alone leaves
  double potential = 0;   ///< elastic + gravity - loads that have one [J], where the scene has one
};

/// What z is of the step from q0 to q1.
enum class Inner { end, middle };

/// What solves leave for those to come.
struct EquationsMemory {
  /// Contacts whose unknowns the order of elimination was found for, and those in the matrix; sorted.
  std::vector<ContactKey> ordered, coupled;
  std::vector<std::vector<int>> groups;  ///< of unknowns that custom forces couple
  std::vector<double> matrix;            ///< whose factorisation is in use; empty: none
  double flow_excess = 0;
  StokesletFluid::Memory fluid;
};

class Equations {
 public:
  Equations(const Model& model, const Options& options);

  const Model& model() const { return model_; }
  Assembler& assembler() { return assembler_; }
  const Assembler& assembler() const { return assembler_; }
  Loads& loads() { return loads_; }
  const Loads& loads() const { return loads_; }
  bool symmetric() const { return asymmetries_.empty(); }
  /// In words, what makes the Jacobian unsymmetric.
  const std::vector<std::string>& asymmetries() const { return asymmetries_; }
  /// True where statics minimise a potential.
  bool has_potential() const { return has_potential_; }

  /// Nothing where nothing can touch.
  Contact* contact() { return contact_.get(); }
  const Contact* contact() const { return contact_.get(); }
  void forget_contacts();
  /// How much of a step of z contact allows, from 0 to 1.
  double allowed(const VectorX& z, const VectorX& step);
  /// Predicts the friction of a step of Newton's method from the last evaluation, of which `kept` is left.
  void predict_friction(const VectorX& step, double kept, ContactLinearisation& linearisation);

  /// Prepares a step from `state` over h (0: statics). Copies what it needs but the state itself, which
  /// must outlive the step.
  void begin(const State& state, const Parameters& parameters, double h, bool energy_momentum,
             Inner inner = Inner::end);
  /// Custom forces (per unknown) that act in this step, at z where they are solved for.
  VectorX custom_force;
  void set_custom(const MatrixX3& forces, const MatrixX3& moments);
  /// Custom forces at configuration q and velocities v, which are solved for then. Empty: they stay as they were set.
  using CustomResponse = std::function<CustomForces(const VectorX& q, const VectorX& v, bool derivatives)>;
  CustomResponse respond;
  /// Of what supports hold, which acts on the edges next to it; meaningful where held. Empty: as the rest accelerates.
  VectorX held_acceleration;
  /// Whether Stokeslets act: then `begin_flow` follows `begin`. The fluid's force is that on velocities `v` at
  /// positions `q`, and a local drag for what the velocities of the step differ from them; see flow.cpp. False where no
  /// solution was found.
  bool flows() const { return fluid_ != nullptr; }
  bool begin_flow(const VectorX& q, const VectorX& v);
  /// By which the local drag of the last step was greater than that of single rods; 0: not known.
  double flow_excess() const { return flow_excess_; }
  /// Without what earlier solutions of the flow left behind.
  void forget_flow();
  /// What solves left for those to come; the matrix where its factorisation may serve again.
  EquationsMemory memory(bool with_matrix) const;
  /// Goes on from there, but for the factorisation. False where there is no matrix to factorise.
  bool recall(const EquationsMemory& memory);
  /// From here on what would be lost of that is kept, until the next mark: copied once, when it is about to change.
  void mark() { mark_ = Mark::set; }
  bool marked() const { return mark_ != Mark::none; }
  /// What it was at the mark; nothing where it has not changed since.
  const EquationsMemory* since_mark() const { return mark_ == Mark::passed ? &at_mark_ : nullptr; }

  /// Residual at z, and the matrix when asked for. `axial_force`: see stretch_hessian. `contact`: how Newton's method
  /// takes it.
  void evaluate(const VectorX& z, bool with_matrix, const double* axial_force, Evaluation& out,
                const ContactLinearisation& contact = {});
  /// Of an explicit step from `state` to q: the configuration there, and that of `next`. Returns by how much edges turn
  /// at most [rad]; in a plane 0.
  double advance(const State& state, const VectorX& q, State& next);
  /// Forces without inertia, for an explicit step: `full_residual` of a state to which `advance` has come, with
  /// velocities v. No contact, viscosity or drag.
  void evaluate_forces(const State& state, const Parameters& parameters, const VectorX& v, Evaluation& out);
  /// Configuration of the last evaluation.
  const Configuration& configuration() const { return middle_; }
  /// q1 = 2 z - q0 of an energy-momentum step.
  const Configuration& end_configuration() const { return end_; }
  /// What drag and viscosity take, and what loads and custom forces give, over `change`, with the forces of the last
  /// evaluation [J].
  double dissipated(const VectorX& change) const;
  double load_work(const VectorX& change) const;
  /// Of loads and custom forces in the last evaluation, per unknown.
  void load_force(VectorX& out) const;
  bool loaded() const { return !loads_.pieces.empty() || model_.description.has_custom_force; }
  /// What contact takes from the motion over `change`, and from obstacles that move, and does not store [J]; where
  /// there is contact.
  double contact_loss(const VectorX& change, double obstacle_work) const;

  /// Axial forces [N] as the mixed method wants them: linearly extrapolated from the last evaluation by a
  /// Newton step, n <- EA (eps + d eps . dz).
  void predict_axial_force(const VectorX& step, VectorX& out) const;

  const MassMatrix& mass() const { return mass_; }
  /// Inertia in the rows of the last evaluation [N], [N m].
  const VectorX& inertia() const { return inertia_; }
  /// Of an energy-momentum step that changes the unknowns by `change`: the velocities of angles at its end.
  void set_turning_velocities(const VectorX& change, double dt, VectorX& v1) const;
  /// What forces of an energy-momentum step do their work over: its change of the unknowns, but for angles and frames,
  /// whose torques and moments are those about where they are in the middle.
  const VectorX& working_change(const VectorX& change);
  /// Makes of the rows of angles, after an energy-momentum step, what does the work over `change` that their torques
  /// do.
  void set_working_rows(const VectorX& change, VectorX& rows) const;
  ElasticCoefficients elastic;

 private:
  void set_parameters(const Parameters& parameters);
  void add_viscosity();
  void set_strain_rates();
  void set_axial_forces(const ElasticCoefficients& k, Evaluation& out);
  StencilBatch regular_batch(const ElasticCoefficients& k, const double* axial_force, double* values);
  void add_step(const VectorX& z, bool with_matrix, Evaluation& out);
  void add_coupling(const VectorX& coupling, double factor, std::span<double> values);
  void add_flow(const VectorX& z, bool with_matrix, Evaluation& out);
  void add_loads(const VectorX& z, bool with_matrix, Evaluation& out);
  void ask_custom(const VectorX& z, bool derivatives);
  void couple_custom();
  template <class Add>
  void for_each_custom_derivative(const Add& add) const;
  void add_custom_matrix(const VectorX& z);
  void find_resistance();
  void add_resistance(const VectorX& z, bool with_matrix);
  void resistive_local_at(int edge, const VectorX& z, bool with_hessian, Local& local) const;
  double flow_loss(const VectorX& change) const;
  void order_for_contacts();
  void remember(EquationsMemory& out, bool with_matrix) const;
  void pass_mark();
  void find_contacts(const VectorX& z, bool with_matrix);
  void add_contacts(bool with_matrix, const ContactLinearisation& linearisation, Evaluation& out);
  void add_elastic(const ElasticCoefficients& k, const VectorX& z, bool with_matrix, const double* axial_force,
                   Evaluation& out);
  void add_other_elastic(const ElasticCoefficients& k, const VectorX& z, bool with_matrix, const double* axial_force,
                         Evaluation& out);
  void add_discrete_gradient(const VectorX& z, bool with_matrix, const double* axial_force, Evaluation& out);
  void set_mean_axial_forces();
  void mean_stretch_local(const VectorX& z, int edge, const double* axial_force, Local& local) const;
  MovingEdge<double> moving_edge(int edge) const;
  double working_turn(int edge, double change) const;
  void discrete_bend_local(int stencil, bool with_matrix, Local& local) const;
  void discrete_planar_half_local(int stencil, Local& local) const;
  void discrete_half_local(int stencil, Local& local) const;
  void add_spin_couple(const VectorX& z);
  void set_turning_inertia(const VectorX& z);
  Vec3d spin_couple(int edge, double omega, const Vec3d& rate) const;
  void add_couple(int edge, const Vec3d& force);
  double set_inertial_floor(const VectorX& z, VectorX& floor);
  void set_floor(const VectorX& z, VectorX& floor);

  const Model& model_;
  Loads loads_;
  std::unique_ptr<Contact> contact_;
  bool has_potential_ = true;
  std::vector<std::string> asymmetries_;
  Assembler assembler_;
  enum class Mark { none, set, passed };
  Mark mark_ = Mark::none;
  EquationsMemory at_mark_;
  ContactRows contact_rows_;
  std::vector<ContactKey> ordered_;  ///< contacts for which the assembler has found its order of elimination
  double static_duration_ = 0;       ///< in which slip happens in statics [s]
  bool explicit_ = false;
  Inner inner_ = Inner::end;
  const State* state_ = nullptr;
  const Parameters* parameters_ = nullptr;
  double h_ = 0.0;
  bool energy_momentum_ = false;
  ElasticCoefficients viscous_, total_;
  const ElasticCoefficients* acting_ = &elastic;  ///< elasticity, with viscosity where the scheme takes both as one
  Configuration start_, middle_, end_;
  VectorX difference_;  ///< q1 - q0
  VectorX end_q_, last_z_;
  MassMatrix mass_;
  VectorX acceleration_, inertia_;
  MassMatrix drag_;  ///< [N s/m]
  VectorX mean_velocity_, drag_force_, gravity_;
  CustomForces custom_;                                  ///< with derivatives, of the last evaluation with a matrix
  std::vector<std::vector<std::size_t>> moment_pieces_;  ///< of custom moments, per node
  std::unique_ptr<StokesletFluid> fluid_;
  MassMatrix flow_drag_;                     ///< [N s/m]
  VectorX flow_start_, flow_, flow_change_;  ///< the fluid's force but for the local drag, and with it [N]
  bool flowing_ = false;
  VectorX flow_inertia_;                           ///< per node, mass over viscosity and step [m]
  double flow_excess_ = 0;                         ///< by which the local drag is greater than that of single rods
  long flow_version_ = -1;                         ///< of the parameters that it belongs to
  std::vector<ResistiveCoefficients> resistance_;  ///< per edge; empty: none
  long version_ = -1;                       ///< of the parameters that mass, elastic, gravity_ and drag belong to
  VectorX gradient_, magnitude_;            ///< forces but for inertia, drag and gravity; padded by kPadding
  VectorX force_, modulus_, inverse_rest_;  ///< per edge: EA eps [N], EA / L [N / m], 1 / L [1 / m]
  VectorX inverse_mean_;                    ///< per edge: 2 / (l0 + l1) of an energy-momentum step [1 / m]
  /// q1 that goes with z, and by how much it changes with z.
  void set_contact_end(const VectorX& z);
  double end_rate() const { return inner_ == Inner::middle ? 2.0 : 1.0; }
  VectorX contact_end_, contact_change_;  ///< q1 and its coming change
  VectorX contact_gradient_, contact_floor_;
  double reach_ = 0;      ///< greatest coordinate [m]
  VectorX floor_;         ///< what bending, twisting and inertia leave by rounding
  VectorX axial_floor_;   ///< per edge [N]
  VectorX elastic_rows_;  ///< per unknown, the discrete gradient alone
  VectorX working_change_;
  mutable VectorX load_force_;  ///< scratch of `load_work`
  double rounding_ = 0;         ///< relative, of a direction in space
  bool floor_current_ = false;
};

/// Gravity's force per unknown.
void set_gravity_force(const Model& model, const Parameters& parameters, VectorX& force);

}  // namespace withe
