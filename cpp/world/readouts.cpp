/// What a scene answers: copies, in world coordinates.

#include <Eigen/Geometry>
#include <algorithm>

#include "common/check.hpp"
#include "elasticity/stretch.hpp"
#include "forces/tendon.hpp"
#include "model/edge_vectors.hpp"
#include "run/frames.hpp"
#include "steps/joint_forces.hpp"
#include "steps/spring_forces.hpp"
#include "world/implementation.hpp"

namespace withe {
MatrixX3 World::positions() const {
  const Implementation& self = *implementation_;
  MatrixX3 out(self.model.node_count, 3);
  for (int i = 0; i < self.model.node_count; ++i) out.row(i) = node_position(self.model, self.state.q, i);
  return out;
}

MatrixX3 World::velocities() const {
  const Implementation& self = *implementation_;
  MatrixX3 out(self.model.node_count, 3);
  for (int i = 0; i < self.model.node_count; ++i) out.row(i) = node_vector(self.model, self.state.v, i);
  return out;
}

MatrixX9 World::directors(int rod) const {
  const Implementation& self = *implementation_;
  Configuration c;
  compute_configuration(self.model, self.state, self.state.q, c);
  const int first = self.model.rod_first_edge.at(at(rod)), count = self.model.rod_first_edge.at(at(rod) + 1) - first;
  MatrixX9 out(count, 9);
  for (int e = 0; e < count; ++e) {
    const Matrix3 d = edge_directors(self.model, c, first + e);
    out.row(e) << d.col(0).transpose(), d.col(1).transpose(), d.col(2).transpose();
  }
  return out;
}

MatrixX2 World::curvatures(int rod) const {
  const Implementation& self = *implementation_;
  Configuration c;
  compute_configuration(self.model, self.state, self.state.q, c);
  const auto& places = self.model.place.at(at(rod));
  MatrixX2 out = MatrixX2::Zero(static_cast<Eigen::Index>(places.size()), 2);
  // What bends beyond the natural curvature is spread over as much of the rod as the stencil carries.
  const MatrixX2& natural = self.parameters.natural_curvature[at(rod)];
  const auto smooth = [&](const MatrixX3& strain, int i, double voronoi, double carried, Eigen::Index row) -> Vector2 {
    Vector2 d = strain.row(i).head<2>();
    if (self.model.planar()) d = strain(i, 0) * self.model.planar_components[at(rod)];
    const Vector2 rest = natural.row(row);
    return rest + (voronoi / carried) * (smooth_curvature(d, voronoi) - rest);
  };
  for (std::size_t s = 0; s < places.size(); ++s) {
    const auto row = static_cast<Eigen::Index>(s);
    if (places[s].bend >= 0) {
      const int b = places[s].bend;
      const auto& edge = self.model.bend[at(b)].edge;
      const double carried = self.model.bend_share(b, 0) * self.model.edge_arc(edge[0]) +
                             self.model.bend_share(b, 1) * self.model.edge_arc(edge[1]);
      out.row(row) = smooth(c.bend_strain, b, self.model.bend_voronoi(b), carried, row);
      continue;
    }
    double length = 0.0;
    for (int h : places[s].half)
      if (h >= 0) {
        const double v = self.model.half_voronoi(h);
        const double carried = self.model.half_share(h) * self.model.edge_arc(self.model.half[at(h)].edge);
        out.row(row) += v * smooth(c.half_strain, h, v, carried, row);
        length += v;
      }
    if (length > 0.0) out.row(row) /= length;
  }
  return out;
}

VectorX World::twists(int rod) const {
  const Implementation& self = *implementation_;
  const auto& places = self.model.place.at(at(rod));
  VectorX out = VectorX::Zero(static_cast<Eigen::Index>(places.size()));
  if (self.model.planar()) return out;
  Configuration c;
  compute_configuration(self.model, self.state, self.state.q, c);
  for (std::size_t s = 0; s < places.size(); ++s) {
    double turn = 0.0, length = 0.0;
    if (places[s].bend >= 0) {
      turn = c.bend_strain(places[s].bend, 2);
      length = self.model.bend_voronoi(places[s].bend);
    }
    for (int h : places[s].half)
      if (h >= 0) {
        turn += c.half_strain(h, 2);
        length += self.model.half_voronoi(h);
      }
    out(static_cast<Eigen::Index>(s)) = length > 0.0 ? turn / length : 0.0;
  }
  return out;
}

namespace {

const JointAngle& checked_joint(const Model& model, int joint) {
  require(joint >= 0 && joint < static_cast<int>(model.joint_angles.size()), "no such revolute joint: ", joint);
  return model.joint_angles[at(joint)];
}

double tension(const Model& model, const Parameters& parameters, const Configuration& c, int edge) {
  return axial_force(c.length(edge), model.edge_length(edge), parameters.edge_stretch(edge),
                     parameters.edge_natural_stretch(edge) - 1.0);
}

}  // namespace

/// Whether axial forces are read out in the middle of the step, where those of a midpoint step are in balance: at its
/// end an edge that has turned by w within it is longer by w^2 / 8 of its length, which its stiffness makes a force
/// that has not acted.
bool World::Implementation::tensions_in_middle() const { return rule_of_step() == StepRule::midpoint; }

void World::Implementation::note_tensions() {
  tensions.resize(tensions_in_middle() ? model.edge_count : 0);
  for (int e = 0; e < static_cast<int>(tensions.size()); ++e)
    tensions(e) = tension(model, parameters, systems.work.newton.data.configuration, e);
}

VectorX World::tensions(int rod) const {
  const Implementation& self = *implementation_;
  const int first = self.model.rod_first_edge.at(at(rod)), count = self.model.rod_first_edge.at(at(rod) + 1) - first;
  if (self.reaction_current && self.tensions.size() != 0) return self.tensions.segment(first, count);
  Configuration c;
  compute_configuration(self.model, self.state, self.state.q, c);
  VectorX out(count);
  for (int e = 0; e < count; ++e) out(e) = tension(self.model, self.parameters, c, first + e);
  return out;
}

double World::spring_tension(int spring) const {
  const Implementation& self = *implementation_;
  require(spring >= 0 && spring < self.parameters.spring_stiffness.size(), "no such spring: ", spring);
  return withe::spring_tension(self.model, self.parameters, self.state.q, self.state.v, spring);
}

namespace {

int checked_tendon(const Model& model, int tendon) {
  require(tendon >= 0 && tendon < static_cast<int>(model.description.tendons.size()), "no such tendon: ", tendon);
  return tendon;
}

}  // namespace

double World::tendon_length(int tendon) const {
  const Implementation& self = *implementation_;
  const int wanted = checked_tendon(self.model, tendon);
  double length = 0.0;
  for (const TendonSegment& segment : tendon_segments(self.model))
    if (segment.tendon == wanted)
      length += segment_length(self.model, segment, self.state.q, self.configuration()) -
                self.parameters.tendon_tension(wanted) * free_end_compliance(self.model, self.parameters, segment);
  return length;
}

MatrixX3 World::tendon_points(int tendon) const {
  const Implementation& self = *implementation_;
  return guide_points(self.model, checked_tendon(self.model, tendon), self.state.q, self.configuration());
}

double World::joint_angle(int joint) const {
  const Implementation& self = *implementation_;
  return checked_joint(self.model, joint).angle(self.state.q);
}

/// The mean of the last step: what steps do not resolve, as of frames with little inertia of their own, changes the
/// sign of its velocity from step to step. Where there was none, by the edges at either side.
double World::joint_rate(int joint) const {
  const Implementation& self = *implementation_;
  const Model& model = self.model;
  const JointAngle& turning = checked_joint(model, joint);
  if (!self.predictor.empty()) return turning.angle(self.predictor.latest());
  if (!turning.turns()) return 0.0;
  const auto hinge =
      std::find_if(model.hinges.begin(), model.hinges.end(), [&](const Hinge& h) { return h.dof == turning.turning; });
  const auto belongs = [&](const FrameStencil& half, bool turns) {
    if (model.planar()) return model.frame_dof[at(half.frame)] == (turns ? turning.turning : turning.against);
    return half.frame == hinge->frame && (turns ? half.hinge == hinge - model.hinges.begin() : half.hinge < 0);
  };
  const Configuration& c = self.configuration();
  const auto rate = [&](bool turns) -> Vector3 {
    Vector3 sum = Vector3::Zero();
    int count = 0;
    for (const FrameStencil& half : model.half)
      if (belongs(half, turns)) sum += angular_velocity(model, self.state, c, half.edge), ++count;
    return sum / count;
  };
  const Vector3 axis =
      model.planar() ? model.plane->normal : Vector3(frame_rotation(model, self.state, hinge->frame) * hinge->axis);
  return turning.sign * axis.dot(rate(true) - rate(false));
}

double World::joint_torque(int joint) const {
  const double angle = joint_angle(joint);
  ElasticCoefficients elastic;
  set_elastic(implementation_->parameters, elastic);
  return torque_of(withe::joint_torque(implementation_->parameters, elastic, joint), angle, joint_rate(joint));
}

VectorX World::spins(int rod) const {
  const Implementation& self = *implementation_;
  const int first = self.model.rod_first_edge.at(at(rod)), count = self.model.rod_first_edge.at(at(rod) + 1) - first;
  VectorX out = VectorX::Zero(count);
  if (!self.model.planar())
    for (int e = 0; e < count; ++e) out(e) = self.state.v(self.model.edge_dof[at(first + e)]);
  return out;
}

Energy World::energy() const { return implementation_->energy(); }
Energy World::rod_energy(int rod) const {
  const Implementation& self = *implementation_;
  return withe::rod_energy(self.model, self.parameters, self.state, rod, self.energy_scratch);
}

/// What the kinetic energy changes by with a velocity common to all, and with an angular velocity about the origin:
///   P = sum of (M v) over nodes,  J = sum of x x (M v) + sum of I omega t over edges + sum of I w over joints' frames.
/// In a plane edges do not spin, and frames turn about its normal. A hinge's angle is relative: it adds nothing.
Momentum World::momentum() const {
  const Implementation& self = *implementation_;
  const Model& model = self.model;
  MassMatrix mass;
  set_mass(model, self.parameters, mass);
  VectorX carried;
  multiply(model, mass, self.state.v, carried);
  Momentum out;
  for (int i = 0; i < model.node_count; ++i) {
    const Vector3 p = node_vector(model, carried, i);
    out.linear += p;
    out.angular += node_position(model, self.state.q, i).cross(p);
  }
  for (int f = 0; f < model.frame_count; ++f) {
    const int dof = model.frame_dof[at(f)];
    out.angular += model.planar() ? Vector3(carried(dof) * model.plane->normal) : Vector3(carried.segment<3>(dof));
  }
  if (model.planar()) return out;
  for (int e = 0; e < model.edge_count; ++e) {
    const Vector3 tail = node_position(model, self.state.q, model.edge_tail[at(e)]);
    const Vector3 head = node_position(model, self.state.q, model.edge_head[at(e)]);
    out.angular += carried(model.edge_dof[at(e)]) * (head - tail).normalized();
  }
  return out;
}

}  // namespace withe
