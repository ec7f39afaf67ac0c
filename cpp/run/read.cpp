#include "run/read.hpp"

#include <algorithm>

#include <Eigen/Geometry>

#include "common/check.hpp"
#include "elasticity/stretch.hpp"
#include "forces/tendon.hpp"
#include "model/edge_vectors.hpp"
#include "model/mass_matrix.hpp"
#include "run/frames.hpp"

namespace withe {
namespace {

int checked_tendon(const Model& model, int tendon) {
  require(tendon >= 0 && tendon < static_cast<int>(model.description.tendons.size()), "no such tendon: ", tendon);
  return tendon;
}

}  // namespace

MatrixX3 positions(const Model& model, const State& state) {
  MatrixX3 out(model.node_count, 3);
  for (int i = 0; i < model.node_count; ++i) out.row(i) = node_position(model, state.q, i);
  return out;
}

MatrixX3 velocities(const Model& model, const State& state) {
  MatrixX3 out(model.node_count, 3);
  for (int i = 0; i < model.node_count; ++i) out.row(i) = node_vector(model, state.v, i);
  return out;
}

MatrixX9 directors(const Model& model, const Configuration& c, int rod) {
  const int first = model.rod_first_edge.at(at(rod)), count = model.rod_first_edge.at(at(rod) + 1) - first;
  MatrixX9 out(count, 9);
  for (int e = 0; e < count; ++e) {
    const Matrix3 d = edge_directors(model, c, first + e);
    out.row(e) << d.col(0).transpose(), d.col(1).transpose(), d.col(2).transpose();
  }
  return out;
}

MatrixX2 curvatures(const Model& model, const Parameters& parameters, const Configuration& c, int rod) {
  const auto& places = model.place.at(at(rod));
  MatrixX2 out = MatrixX2::Zero(static_cast<Eigen::Index>(places.size()), 2);
  // Curvature beyond the natural one is spread over as much of the rod as the stencil carries.
  const MatrixX2& natural = parameters.natural_curvature[at(rod)];
  const auto smooth = [&](const MatrixX3& strain, int i, double voronoi, double carried, Eigen::Index row) -> Vector2 {
    Vector2 d = strain.row(i).head<2>();
    if (model.planar()) d = strain(i, 0) * model.planar_components[at(rod)];
    const Vector2 rest = natural.row(row);
    return rest + (voronoi / carried) * (smooth_curvature(d, voronoi) - rest);
  };
  for (std::size_t s = 0; s < places.size(); ++s) {
    const auto row = static_cast<Eigen::Index>(s);
    if (places[s].bend >= 0) {
      const int b = places[s].bend;
      const auto& edge = model.bend[at(b)].edge;
      const double carried =
          model.bend_share(b, 0) * model.edge_arc(edge[0]) + model.bend_share(b, 1) * model.edge_arc(edge[1]);
      out.row(row) = smooth(c.bend_strain, b, model.bend_voronoi(b), carried, row);
      continue;
    }
    double length = 0.0;
    for (int h : places[s].half)
      if (h >= 0) {
        const double v = model.half_voronoi(h);
        const double carried = model.half_share(h) * model.edge_arc(model.half[at(h)].edge);
        out.row(row) += v * smooth(c.half_strain, h, v, carried, row);
        length += v;
      }
    if (length > 0.0) out.row(row) /= length;
  }
  return out;
}

VectorX twists(const Model& model, const Configuration& c, int rod) {
  const auto& places = model.place.at(at(rod));
  VectorX out = VectorX::Zero(static_cast<Eigen::Index>(places.size()));
  if (model.planar()) return out;
  for (std::size_t s = 0; s < places.size(); ++s) {
    double turn = 0.0, length = 0.0;
    if (places[s].bend >= 0) {
      turn = c.bend_strain(places[s].bend, 2);
      length = model.bend_voronoi(places[s].bend);
    }
    for (int h : places[s].half)
      if (h >= 0) {
        turn += c.half_strain(h, 2);
        length += model.half_voronoi(h);
      }
    out(static_cast<Eigen::Index>(s)) = length > 0.0 ? turn / length : 0.0;
  }
  return out;
}

double edge_tension(const Model& model, const Parameters& parameters, const Configuration& c, int edge) {
  return axial_force(c.length(edge), model.edge_length(edge), parameters.edge_stretch(edge),
                     parameters.edge_natural_stretch(edge) - 1.0);
}

double tendon_length(const Model& model, const Parameters& parameters, const State& state, const Configuration& c,
                     int tendon) {
  const int wanted = checked_tendon(model, tendon);
  double length = 0.0;
  for (const TendonSegment& segment : tendon_segments(model))
    if (segment.tendon == wanted)
      length += segment_length(model, segment, state.q, c) -
                parameters.tendon_tension(wanted) * free_end_compliance(model, parameters, segment);
  return length;
}

MatrixX3 tendon_points(const Model& model, const State& state, const Configuration& c, int tendon) {
  return guide_points(model, checked_tendon(model, tendon), state.q, c);
}

const JointAngle& checked_joint(const Model& model, int joint) {
  require(joint >= 0 && joint < static_cast<int>(model.joint_angles.size()), "no such revolute joint: ", joint);
  return model.joint_angles[at(joint)];
}

double joint_angle(const Model& model, const State& state, int joint) {
  return checked_joint(model, joint).angle(state.q);
}

double joint_rate(const Model& model, const State& state, const Configuration& c, int joint) {
  const JointAngle& turning = checked_joint(model, joint);
  if (!turning.turns()) return 0.0;
  const auto hinge =
      std::find_if(model.hinges.begin(), model.hinges.end(), [&](const Hinge& h) { return h.dof == turning.turning; });
  if (!model.planar() && hinge == model.hinges.end()) return turning.angle(state.v);  // it slides
  const auto belongs = [&](const FrameStencil& half, bool turns) {
    if (model.planar()) return model.frame_dof[at(half.frame)] == (turns ? turning.turning : turning.against);
    return half.frame == hinge->frame && (turns ? half.hinge == hinge - model.hinges.begin() : half.hinge < 0);
  };
  const Vector3 axis =
      model.planar() ? model.plane->normal : Vector3(frame_rotation(model, state, hinge->frame) * hinge->axis);
  const auto rate = [&](bool turns) -> Vector3 {
    Vector3 sum = Vector3::Zero();
    int count = 0;
    for (const FrameStencil& half : model.half)
      if (belongs(half, turns)) sum += angular_velocity(model, state, c, half.edge), ++count;
    if (count > 0) return sum / count;
    // A body without rods there turns with its frame.
    if (model.planar()) return state.v(turns ? turning.turning : turning.against) * axis;
    const Vector3 root = frame_vector(model, state.v, hinge->frame);
    return turns ? Vector3(root + state.v(hinge->dof) * axis) : root;
  };
  return turning.sign * axis.dot(rate(true) - rate(false));
}

VectorX spins(const Model& model, const State& state, int rod) {
  const int first = model.rod_first_edge.at(at(rod)), count = model.rod_first_edge.at(at(rod) + 1) - first;
  VectorX out = VectorX::Zero(count);
  if (!model.planar())
    for (int e = 0; e < count; ++e) out(e) = state.v(model.edge_dof[at(first + e)]);
  return out;
}

Momentum momentum(const Model& model, const Parameters& parameters, const State& state) {
  MassMatrix mass;
  set_mass(model, parameters, mass);
  turn_bodies(model, parameters, state, mass);
  VectorX carried;
  multiply(model, mass, state.v, carried);
  Momentum out;
  for (int i = 0; i < model.node_count; ++i) {
    const Vector3 p = node_vector(model, carried, i);
    out.linear += p;
    out.angular += node_position(model, state.q, i).cross(p);
  }
  for (int f = 0; f < model.frame_count; ++f) out.angular += frame_vector(model, carried, f);
  if (model.planar()) return out;
  for (int e = 0; e < model.edge_count; ++e) {
    const Vector3 tail = node_position(model, state.q, model.edge_tail[at(e)]);
    const Vector3 head = node_position(model, state.q, model.edge_head[at(e)]);
    out.angular += carried(model.edge_dof[at(e)]) * (head - tail).normalized();
  }
  return out;
}

}  // namespace withe
