#include <algorithm>
#include <cmath>

#include "common/check.hpp"
#include "geometry/rotation.hpp"
#include "gradients/state_vector.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

/// An equilibrium leaves this much of the forces in it out of balance.
constexpr double kBalanced = 1e-6;

}  // namespace

void World::Implementation::add_held_gradient(const VectorX& held, EquilibriumGradient& out) const {
  const auto at_node = [&](int node) -> Vector3 {
    const int dof = model.node_dof[at(node)];
    if (!model.planar()) return held.segment<3>(dof);
    return held(dof) * model.plane->first + held(dof + 1) * model.plane->second;
  };
  for (std::size_t s = 0; s < model.supports.size(); ++s) {
    const Support& support = model.supports[s];
    if (!support.active) continue;
    const auto row = static_cast<Eigen::Index>(s);
    Vector3 position = at_node(support.node), rotation = Vector3::Zero();
    if (support.frame >= 0) {
      const int dof = model.frame_dof[at(support.frame)];
      rotation = model.planar() ? Vector3(held(dof) * model.plane->normal) : Vector3(held.segment<3>(dof));
    }
    if (support.other_node >= 0) {
      const Vector3 other = at_node(support.other_node);
      const Vector3 arm =
          node_position(model, state.q, support.other_node) - node_position(model, state.q, support.node);
      position += other;
      rotation += arm.cross(other);
      if (!model.planar()) rotation += held(model.edge_dof[at(support.edge)]) * arm.normalized();
    }
    out.support_positions.row(row) += position.transpose();
    out.support_rotations.row(row) += rotation.transpose();
  }
}

std::vector<EquilibriumGradient> World::equilibrium_gradients(const std::vector<MatrixX3>& by_positions) const {
  const Implementation& self = *implementation_;
  const Model& model = self.model;
  if (!self.static_gradient) {
    Options statics = self.options;
    statics.integrator = Integrator::statics;
    self.static_gradient = std::make_unique<StepGradient>(model, equation_options(statics));
  }
  StepGradient& gradient = *self.static_gradient;
  State frames = self.state;
  if (!model.planar()) {
    // Directors are measured from where they are, and so turn with their edges without a change of their angles.
    Configuration configuration;
    compute_configuration(model, self.state, self.state.q, configuration);
    accept_configuration(model, self.state.q, configuration, frames);
  }
  gradient.begin({frames, self.parameters, StepRule::statics, 0.0, frames.q});
  require(gradient.imbalance() < kBalanced,
          "the simulation is in no equilibrium, so that there is no gradient of one: call equilibrium() again");
  std::vector<EquilibriumGradient> out;
  for (const MatrixX3& by : by_positions) {
    require(by.rows() == model.node_count,
            "a derivative by positions has one row a node, " + std::to_string(model.node_count));
    StateAdjoint adjoint{VectorX::Zero(model.dof_count), {}};
    add_to_nodes(model, by, adjoint.q);
    CoefficientAdjoint coefficients(model, self.parameters.loads.rows());
    VectorX held = VectorX::Zero(model.dof_count);
    gradient.pull_back(adjoint, coefficients, held);
    const auto supports = static_cast<Eigen::Index>(model.supports.size());
    out.push_back({parameter_gradient(model, self.parameters, coefficients), MatrixX3::Zero(supports, 3),
                   MatrixX3::Zero(supports, 3)});
    self.add_held_gradient(held, out.back());
  }
  return out;
}

std::shared_ptr<Tape> World::start_tape() {
  Implementation& self = *implementation_;
  self.tape = std::make_shared<Tape>(self.model, equation_options(self.options), self.state, self.parameters);
  if (self.options.integrator == Integrator::verlet || self.options.integrator == Integrator::statics)
    self.tape->refuse("integrator '" +
                      std::string(self.options.integrator == Integrator::verlet ? "verlet" : "static") +
                      "' has none; take any other");
  if (const Contact* contact = self.equations->contact()) {
    const ContactDescription& given = self.description.contact;
    const auto loses = [](double restitution) { return restitution >= 0.0 && restitution < 1.0; };
    if (self.options.integrator != Integrator::backward_euler)
      self.tape->refuse("contact takes part in it; take integrator='backward_euler'");
    else if (contact->frictional())
      self.tape->refuse("friction takes part in it; take friction=0");
    else if (loses(given.restitution) || (given.obstacle_restitution.array() < 1.0).any() ||
             std::any_of(given.pairs.begin(), given.pairs.end(), [&](const auto& p) { return loses(p.restitution); }))
      self.tape->refuse("impacts lose energy by their restitution; take restitution=1");
  }
  return self.tape;
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
  fresh->recall(implementation_->lagged());
  fresh->take_callbacks(*implementation_);
  withe::displace_state(fresh->model, by, fresh->state);
  fresh->meet_anew();
  fresh->forget_motion();
  fresh->forget_matrix();
  implementation_ = std::move(fresh);
}

/// Before a step.
void World::Implementation::check_tape() {
  if (!tape->continues(state, parameters))
    tape->refuse("numbers, loads or the state were changed while it ran, or change with time; begin another run there");
}

void World::Implementation::record_step(StepRule rule, double dt) {
  const char* unknown = nullptr;
  if (const Contact* contact = equations_of_step().contact()) {
    const ContactProblem& problem = contact->problem();
    if (!contact->has_given_stiffness(state))
      unknown = "its contacts took a stiffness of their own; give enable_contact(stiffness=), great enough";
    else if (!problem.shift.empty() || !problem.turn.empty())
      unknown = "an obstacle moved";
  }
  tape->record(rule, dt, work.move, state, unknown);
}

}  // namespace withe
