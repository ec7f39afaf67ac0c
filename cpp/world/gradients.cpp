#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "common/check.hpp"
#include "geometry/rotation.hpp"
#include "gradients/state_vector.hpp"
#include "integrators/stiffness_signs.hpp"
#include "model/edge_vectors.hpp"
#include "run/checks.hpp"
#include "run/journal.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

/// An equilibrium leaves this much of the forces in it out of balance.
constexpr double kMaxImbalance = 1e-6;
/// A rod that was drawn straight, but for rounding, hardly prefers a side: times what is rounded in its stiffness.
constexpr double kDrawnRounding = 1e4;
constexpr const char* kAtLimit =
    "no gradient is available for an equilibrium in which a hand is at its "
    "force_limit, because the equilibrium depends on the path: give a greater "
    "force_limit, or run with differentiable=True";
constexpr const char* kHeldByFriction =
    "no gradient is available for an equilibrium with friction, because the "
    "equilibrium depends on the path: use friction=0, or run with "
    "differentiable=True";

/// At random, of length 1, of what is free.
VectorX any_motion(const Model& model, const Assembler& assembler) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  VectorX motion(model.dof_count);
  for (double& number : motion) number = normal(random);
  assembler.project(motion);
  return motion.normalized();
}

}  // namespace

StepGradient& World::Implementation::begin_gradient(AtEquilibrium& at) const {
  require(!has_rings(model), std::string("no gradient of this equilibrium is available: ") + kRingHasNoGradient);
  StepGradient& gradient = systems.gradient();
  at.frames = state;
  at.prescribed.supports = poses_of(motions);
  State& frames = at.frames;
  if (!model.planar()) {
    // Directors are measured from where they are, and so turn with their edges without a change of their angles.
    Configuration configuration;
    compute_configuration(model, state, state.q, configuration);
    accept_configuration(model, state.q, configuration, frames);
  }
  gradient.begin({frames, parameters, StepRule::statics, 0.0, frames.q, nullptr, nullptr, at.prescribed});
  if (const HandForces* yielding = gradient.equations().hands()) require(!yielding->at_limit(state), kAtLimit);
  const Contact* contact = gradient.equations().contact();
  if (contact && contact->count() > 0) {
    require(!contact->frictional(), kHeldByFriction);
    require(contact->has_given_stiffness(state),
            std::string("no gradient of this equilibrium is available: ") + kStiffnessHasNoGradient);
  }
  return gradient;
}

EquilibriumGradients World::equilibrium_gradients(const std::vector<ReadoutAdjoint>& by) const {
  const Implementation& self = *implementation_;
  const Model& model = self.model;
  for (const ReadoutAdjoint& scalar : by) scalar.check(model);
  const auto leaves = [&](const ReadoutAdjoint& scalar) { return leaves_plane(model, self.state, scalar); };
  // Nothing leads out of the plane of a scene that is to stay in it.
  if (!self.options.planar.value_or(false) && std::any_of(by.begin(), by.end(), leaves)) {
    World spatial(*this);
    spatial.implementation_->leave_plane("read-outs of the gradient");
    try {
      return spatial.equilibrium_gradients(by);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(
          std::string("read-outs of the gradient leave the plane of the scene, and in space: ") + error.what() +
          "; build the scene with planar=False");
    }
  }
  Implementation::AtEquilibrium at;
  StepGradient& gradient = self.begin_gradient(at);
  require(gradient.imbalance() < kMaxImbalance,
          "the simulation is not in equilibrium: call equilibrium() again before its "
          "gradient");
  EquilibriumGradients out;
  for (const ReadoutAdjoint& scalar : by) {
    StateAdjoint adjoint{VectorX::Zero(model.dof_count), VectorX::Zero(model.dof_count)};
    CoefficientAdjoint coefficients(model, self.parameters.loads.rows());
    HeldAdjoint held(model);
    add_unknowns(model, scalar, adjoint);
    if (scalar.needs_state())
      add_readouts(model, gradient.equations().assembler(), self.parameters, at.frames, scalar, adjoint, coefficients);
    const ReactionAdjoint reactions{scalar.reactions, at.prescribed.supports};
    gradient.pull_back(adjoint, coefficients, held, scalar.has_reactions() ? &reactions : nullptr);
    out.scalars.push_back(self.equilibrium_gradient(coefficients, held));
  }
  const VectorX neutral = self.neutral_motion();
  if (neutral.size() == 0) return out;
  for (const VectorX& motion : {neutral, any_motion(model, gradient.equations().assembler())}) {
    CoefficientAdjoint coefficients(model, self.parameters.loads.rows());
    HeldAdjoint held(model);
    gradient.add_work_along(motion, coefficients, held);
    out.works.push_back(self.equilibrium_gradient(coefficients, held));
  }
  return out;
}

VectorX World::equilibrium_residual() const {
  const Implementation& self = *implementation_;
  Implementation::AtEquilibrium at;
  StepGradient& gradient = self.begin_gradient(at);
  const Contact* contact = gradient.equations().contact();
  require(!self.description.has_custom_force && (!contact || contact->count() == 0),
          "forward derivatives are not available with custom forces or contact");
  return gradient.residual();
}

MatrixX World::support_directions(int support) const {
  const Implementation& self = *implementation_;
  const Model& model = self.model;
  require(support >= 0 && at(support) < model.supports.size() && !model.supports[at(support)].yields(),
          "forward derivatives are not available with respect to the pose of a hand that yields");
  const std::vector<SupportPose> hands = poses_of(self.motions);
  MatrixX out = MatrixX::Zero(model.dof_count, 6);
  VectorX held = VectorX::Zero(model.dof_count);
  for (const Constraint& c : model.constraints)
    for (int i = 0; i < c.size; ++i) {
      // The transpose of what adjoints make of held unknowns, row by row.
      held[c.first + i] = 1.0;
      const Vector3 part = c.held(held);
      held.segment(c.first, c.size) = part.head(c.size);
      const PoseAdjoint by = by_poses(model, self.state.q, held, {}, {hands, self.state.hands});
      out.row(c.first + i) << by.positions.row(support), by.rotations.row(support);
      held.segment(c.first, c.size).setZero();
    }
  return out;
}

MatrixX World::equilibrium_responses(const MatrixX& residual, const MatrixX& held) const {
  const Implementation& self = *implementation_;
  const Model& model = self.model;
  require(residual.rows() == model.dof_count && held.rows() == model.dof_count && held.cols() == residual.cols(),
          "changes must have a row for each unknown of the scene");
  Implementation::AtEquilibrium at;
  StepGradient& gradient = self.begin_gradient(at);
  MatrixX out(3 * model.node_count, residual.cols());
  for (Eigen::Index k = 0; k < residual.cols(); ++k) {
    const VectorX change = gradient.respond(residual.col(k), held.col(k));
    for (int node = 0; node < model.node_count; ++node)
      out.col(k).segment<3>(3 * node) = node_vector(model, change, node);
  }
  return out;
}

/// A motion of length 1 that costs no energy; empty where there is none, where loads turn with the rod, or with custom
/// forces.
VectorX World::Implementation::neutral_motion() const {
  if (description.has_custom_force) return {};
  Equations& system = systems.readout();
  if (system.assembler().solver().symmetry() == Symmetry::unsymmetric) return {};
  StepData evaluation;
  system.begin(state, parameters, StepRule::statics, 0.0);
  system.evaluate(state.q, true, nullptr, evaluation);
  const StepNorms norms(model);
  Counters unused;
  return StiffnessSigns(system, norms, unused).neutral_motion(state, evaluation, kDrawnRounding);
}

EquilibriumGradient World::Implementation::equilibrium_gradient(const CoefficientAdjoint& coefficients,
                                                                const HeldAdjoint& held) const {
  const std::vector<SupportPose> hands = poses_of(motions);
  PoseAdjoint poses = by_poses(model, state.q, held.pose, held.hands, {hands, state.hands});
  poses.obstacles = by_places(model, held.obstacles);
  return {parameter_gradient(model, parameters, coefficients), std::move(poses), by_drawing(model, state.q, held.pose)};
}

std::shared_ptr<Tape> World::start_tape() {
  Implementation& self = *implementation_;
  self.tape = withe::start_tape(self.model, self.options, self.contact(), self, self);
  return self.tape;
}

void World::note_moment() {
  if (implementation_->tape) implementation_->tape->note_moment(implementation_->parameters);
}

void World::stop_tape() { implementation_->tape.reset(); }

VectorX World::state_difference(const World& reference) const {
  const Implementation &self = *implementation_, &other = *reference.implementation_;
  const auto same = [](const Constraint& a, const Constraint& b) { return a.first == b.first && a.free == b.free; };
  require(self.model.planar() == other.model.planar() && self.model.dof_count == other.model.dof_count &&
              std::equal(self.model.constraints.begin(), self.model.constraints.end(), other.model.constraints.begin(),
                         other.model.constraints.end(), same),
          "the reference must be a copy of this simulation, with the same supports");
  return withe::state_difference(self.model, other.state, self.state);
}

void World::displace_state(const VectorX& by) {
  // On a copy, so that what is refused changes nothing.
  auto fresh = std::make_unique<Implementation>(accounted());
  fresh->systems.recall(implementation_->systems.lagged());
  fresh->callbacks = implementation_->callbacks;
  withe::displace_state(fresh->model, by, fresh->state);
  fresh->systems.forget_contacts();
  check_overlap(fresh->model, fresh->parameters, fresh->state, fresh->contact());
  fresh->forget_motion();
  fresh->systems.forget_matrix();
  implementation_ = std::move(fresh);
}

}  // namespace withe
