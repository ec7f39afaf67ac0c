/// Supports of a running scene: added, released, moved, and what they hold.

#include <algorithm>
#include <span>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "common/check.hpp"
#include "model/edge_vectors.hpp"
#include "run/checks.hpp"
#include "run/frames.hpp"
#include "run/grips.hpp"
#include "run/reactions.hpp"
#include "world/implementation.hpp"

namespace withe {
int World::add_support(const SupportDescription& support) {
  Implementation& self = *implementation_;
  const Implementation backup(self);
  const Lagged lagged = self.systems.lagged();
  // The first row that a released support has left: clamping and releasing again and again needs no more rows.
  const auto& rows = self.model.supports;
  const auto index = static_cast<int>(
      std::find_if(rows.begin(), rows.end(), [](const Support& s) { return !s.active; }) - rows.begin());
  if (index == static_cast<int>(rows.size())) {
    self.description.supports.emplace_back();
    self.model.supports.emplace_back();
    self.motions.emplace_back();
  }
  self.description.supports[at(index)] = support;
  self.description.supports[at(index)].gripped = true;
  self.model.supports[at(index)] = Support{};
  self.model.supports[at(index)].active = true;
  self.motions[at(index)] = SupportMotion{};
  try {
    if (self.model.planar()) {
      const Vector3& n = self.model.plane->normal;
      const Vector3 image = support.free * n;
      if ((image - n * n.dot(image)).norm() > 1e-9) {
        require(!self.options.planar.value_or(false), "a support that slides out of the plane needs planar=False");
        self.spatial = true;
      }
    }
    self.rebuild(Rebuild::running);
    check_reversible(self.model, self.options, self.parameters);
  } catch (...) {
    auto before = std::make_unique<Implementation>(backup);
    before->callbacks = self.callbacks;
    before->systems.recall(lagged);
    implementation_ = std::move(before);
    throw;
  }
  if (support.kind == SupportKind::spinning_clamp) {
    // Its frame has found its place, and with that the tangent that it holds.
    const Support& bearing = self.model.supports[at(index)];
    self.description.supports[at(index)].axis = frame_rotation(self.model, self.state, bearing.frame) * bearing.tangent;
    self.rebuild(Rebuild::running);
  }
  if (self.model.supports[at(index)].is_hand()) {
    grasp(self.model, self.configuration(), index, self.state, self.motions);
    return index;
  }
  self.motions[at(index)] = standing(self.model, self.state, self.configuration(), self.model.supports[at(index)]);
  return index;
}

void World::remove_support(int support) {
  Implementation& self = *implementation_;
  require(
      support >= 0 && support < static_cast<int>(self.model.supports.size()) && self.model.supports[at(support)].active,
      "no such support, or it is released already: " + std::to_string(support));
  // The energy that is stored in a hand stays with it when it lets go.
  if (self.model.supports[at(support)].yields()) self.ledger.support_work -= self.hand_energy_of(support);
  self.model.supports[at(support)].active = false;
  self.rebuild(Rebuild::running);
}

void World::move_support(int support, const std::optional<Vector3>& position, const std::optional<Matrix3>& rotation,
                         double over, const Vector3& roll) {
  Implementation& self = *implementation_;
  require(std::isfinite(over) && over >= 0.0, "over must be finite and not negative");
  const bool rolls = roll != Vector3::Zero();
  require(roll.allFinite() && (!rolls || (rotation && over == 0.0 && self.options.integrator == Integrator::statics)),
          "full turns of a support need integrator='static' and a rotation without over=");
  prescribe_support(support, position, rotation);
  SupportMotion& m = self.motions[at(support)];
  const Span way{self.state.time, self.state.time + over};
  if (position) {
    m.from_position = m.position;
    m.shift = way;
  }
  if (rotation) {
    m.from_rotation = m.rotation;
    m.turn = way;
    m.roll = roll;
  }
  if (rolls && self.model.planar()) self.leave_plane("a support that rolls");
}

/// Under the fourth-order scheme velocities of supports are known to second order: see mass_matrix.hpp.
void World::Implementation::lump_held() {
  account_for_settings();
  MassMatrix mass;
  set_mass(model, parameters, mass);
  turn_bodies(model, parameters, state, mass);
  ledger.support_work -= kinetic_energy(model, mass, state.v);
  parameters.held_lumped = true;
  update_derived(model, parameters);
  set_mass(model, parameters, mass);
  turn_bodies(model, parameters, state, mass);
  ledger.support_work += kinetic_energy(model, mass, state.v);
  plan_current = false;
}

void World::prescribe_support(int support, const std::optional<Vector3>& position,
                              const std::optional<Matrix3>& rotation) {
  Implementation& self = *implementation_;
  require(
      support >= 0 && support < static_cast<int>(self.model.supports.size()) && self.model.supports[at(support)].active,
      "no such support, or it is released: " + std::to_string(support));
  check_pose(self.model, self.motions[at(support)], support, position, rotation);
  if (leaves_plane(self.model, self.motions[at(support)], support, position, rotation))
    self.leave_plane("a moving support");
  if (self.options.integrator == Integrator::fourth_order && !self.parameters.held_lumped) self.lump_held();
  SupportMotion& m = self.motions[at(support)];
  const Span now{self.state.time, self.state.time};
  if (position) {
    m.to_position = m.from_position = *position;
    m.shift = now;
  }
  if (rotation) {
    m.to_rotation = m.from_rotation = *rotation;
    m.roll.setZero();
    m.turn = now;
  }
}

Vector3 World::support_position(int support) const {
  const Implementation& self = *implementation_;
  const int node = self.model.supports.at(at(support)).description.hand.node;
  return node >= 0 ? node_position(self.model, self.state.q, node) : self.motions[at(support)].position;
}
Matrix3 World::support_rotation(int support) const { return implementation_->motions.at(at(support)).rotation; }
std::pair<Matrix3, double> World::support_turn(int support) const {
  const SupportMotion& m = implementation_->motions.at(at(support));
  return {m.to_rotation, m.turn.end};
}

/// Reactions are those of the last evaluation.
void World::Implementation::note_reactions() {
  impulses.clear();
  joint_impulses.clear();
  tensions.resize(0);
  note_residual();
}

void World::Implementation::note_residual() {
  reaction_residual = systems.work.newton.data.full_residual;
  reaction_place = systems.work.newton.data.z;
  hand_wrenches = systems.work.newton.data.hands;
  joint_wrenches = systems.work.newton.data.joints;
  reaction_current = true;
}

/// Adds the reactions of a part of a time step. Those of the time step are the means over its parts.
void World::Implementation::keep_reactions(double dt, bool begins) {
  note_residual();
  note_tensions();
  if (!model.planar() && rule_of_step() != StepRule::energy_momentum)
    make_frame_moments(model, prescribed.held.q, acts_in_middle(options.integrator) ? 0.5 : 1.0, *this);
  if (begins) {
    impulses.clear();
    joint_impulses.clear();
    impulse_time = 0.0;
  }
  const bool only = division.whole() && !composes();
  if (only || (model.supports.empty() && joint_wrenches.empty())) return;
  impulses.resize(model.supports.size());
  joint_impulses.resize(joint_wrenches.size());
  impulse_time += dt;
  for (std::size_t i = 0; i < joint_wrenches.size(); ++i) {
    joint_impulses[i].force += dt * joint_wrenches[i].force;
    joint_impulses[i].moment += dt * joint_wrenches[i].moment;
  }
  VectorX& held = systems.work.assumed;
  held.setZero(model.dof_count);
  systems.scheme().assembler().set_held_part(reaction_residual, held);
  for (std::size_t s = 0; s < model.supports.size(); ++s) {
    if (!model.supports[s].active) continue;
    const Wrench found = reaction_of(model, *this, static_cast<int>(s), held);
    impulses[s].force += dt * found.force;
    impulses[s].moment += dt * found.moment;
  }
}

Reaction World::reaction(int support) const {
  Implementation& self = *implementation_;
  require(
      support >= 0 && support < static_cast<int>(self.model.supports.size()) && self.model.supports[at(support)].active,
      "no such support, or it is released: " + std::to_string(support));
  self.refresh_reactions();
  Wrench found;
  if (self.impulses.empty()) {
    found = reaction_of(self.model, self, support, self.systems.scheme().assembler().held_part(self.reaction_residual));
  } else {
    found = self.impulses[at(support)];
    found.force /= self.impulse_time;
    found.moment /= self.impulse_time;
  }
  if (self.model.supports[at(support)].is_hand()) found.moment -= support_position(support).cross(found.force);
  return {found.force, found.moment};
}

Reaction World::joint_reaction(int joint, const std::vector<RodPass>& side) const {
  Implementation& self = *implementation_;
  const std::vector<JointDescription>& joints = self.description.joints;
  require(joint >= 0 && joint < static_cast<int>(joints.size()), "no such joint: ", joint);
  self.refresh_reactions();
  std::size_t first = 0;
  for (int j = 0; j < joint; ++j) first += parts_of(joints[at(j)]).size();
  const std::span<const Wrench> wrenches = self.joint_impulses.empty() ? self.joint_wrenches : self.joint_impulses;
  const double share = self.joint_impulses.empty() ? 1.0 : 1.0 / self.impulse_time;
  const std::vector<JointPart> parts = parts_of(joints[at(joint)]);
  require(!parts.empty() && first + parts.size() <= wrenches.size(), "the joint has no body");
  Wrench found = wrench_of_side(self.model, parts, wrenches.subspan(first, parts.size()), side);
  int number = 0;
  for (int j = 0; j < joint; ++j) number += static_cast<int>(joints[at(j)].links.size());
  // The node of a sliding joint moves with the part that a body carries.
  if (const auto& links = joints[at(joint)].links; !links.empty() && links.front().slides) {
    const int carrier = carrier_of_slide(self.description, joints[at(joint)]);
    const bool carries =
        std::any_of(side.begin(), side.end(), [&](const RodPass& pass) { return pass.rod == -1 - carrier; });
    if (carries)
      found.moment += slide_displacement(self.model, self, self.state, number, acts_in_middle(self.options.integrator))
                          .cross(found.force);
  }
  return {share * found.force, share * found.moment};
}

}  // namespace withe
