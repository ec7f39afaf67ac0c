/// Read-outs of a running scene.

#include "common/check.hpp"
#include "run/frames.hpp"
#include "run/read.hpp"
#include "steps/joint_forces.hpp"
#include "steps/spring_forces.hpp"
#include "world/implementation.hpp"

namespace withe {

MatrixX3 World::positions() const { return withe::positions(implementation_->model, implementation_->state); }
MatrixX3 World::velocities() const { return withe::velocities(implementation_->model, implementation_->state); }
MatrixX9 World::directors(int rod) const {
  return withe::directors(implementation_->model, implementation_->configuration(), rod);
}
MatrixX2 World::curvatures(int rod) const {
  const Implementation& self = *implementation_;
  return withe::curvatures(self.model, self.parameters, self.configuration(), rod);
}
VectorX World::twists(int rod) const {
  return withe::twists(implementation_->model, implementation_->configuration(), rod);
}

/// Forces of a midpoint step are in balance at its middle. At its end an edge that has turned by w within the step is
/// longer by w^2 / 8 of its length; its stiffness makes that a force that has not acted.
void World::Implementation::note_tensions() {
  tensions.resize(rule_of_step() == StepRule::midpoint ? model.edge_count : 0);
  for (int e = 0; e < static_cast<int>(tensions.size()); ++e)
    tensions(e) = edge_tension(model, parameters, systems.work.newton.data.configuration, e);
}

VectorX World::tensions(int rod) const {
  const Implementation& self = *implementation_;
  const int first = self.model.rod_first_edge.at(at(rod)), count = self.model.rod_first_edge.at(at(rod) + 1) - first;
  if (self.reaction_current && self.tensions.size() != 0) return self.tensions.segment(first, count);
  const Configuration& c = self.configuration();
  VectorX out(count);
  for (int e = 0; e < count; ++e) out(e) = edge_tension(self.model, self.parameters, c, first + e);
  return out;
}

double World::spring_tension(int spring) const {
  const Implementation& self = *implementation_;
  require(spring >= 0 && spring < self.parameters.spring_stiffness.size(), "no such spring: ", spring);
  return withe::spring_tension(self.model, self.parameters, self.state.q, self.state.v, spring);
}

double World::tendon_length(int tendon) const {
  const Implementation& self = *implementation_;
  return withe::tendon_length(self.model, self.parameters, self.state, self.configuration(), tendon);
}
MatrixX3 World::tendon_points(int tendon) const {
  const Implementation& self = *implementation_;
  return withe::tendon_points(self.model, self.state, self.configuration(), tendon);
}

double World::joint_angle(int joint) const {
  return withe::joint_angle(implementation_->model, implementation_->state, joint);
}

/// The mean rate of the last step: motion that steps do not resolve, such as that of frames with little inertia of
/// their own, changes the sign of its velocity from step to step.
double World::joint_rate(int joint) const {
  const Implementation& self = *implementation_;
  const JointAngle& turning = checked_joint(self.model, joint);
  if (!self.predictor.empty()) return turning.angle(self.predictor.latest());
  return withe::joint_rate(self.model, self.state, self.configuration(), joint);
}

double World::joint_torque(int joint) const {
  const double angle = joint_angle(joint);
  ElasticCoefficients elastic;
  set_elastic(implementation_->parameters, elastic);
  const JointTorque torque = withe::joint_torque(implementation_->model, implementation_->parameters, elastic, joint);
  return torque_of(torque, angle, joint_rate(joint));
}

Matrix3 World::body_rotation(int body) const {
  const Implementation& self = *implementation_;
  return frame_rotation(self.model, self.state, self.model.body_frame.at(at(body)));
}

int World::body_base(int body) const {
  const Model& model = implementation_->model;
  return model.frame_node[at(model.body_frame.at(at(body)))];
}

Vector3 World::body_spin(int body) const {
  const Implementation& self = *implementation_;
  return frame_vector(self.model, self.state.v, self.model.body_frame.at(at(body)));
}

VectorX World::spins(int rod) const { return withe::spins(implementation_->model, implementation_->state, rod); }
Energy World::energy() const { return implementation_->energy(); }
Energy World::rod_energy(int rod) const {
  const Implementation& self = *implementation_;
  return withe::rod_energy(self.model, self.parameters, self.state, rod, self.energy_scratch);
}
Momentum World::momentum() const {
  const Implementation& self = *implementation_;
  return withe::momentum(self.model, self.parameters, self.state);
}

}  // namespace withe
