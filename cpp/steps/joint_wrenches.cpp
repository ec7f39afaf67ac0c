#include "steps/joint_wrenches.hpp"

#include <algorithm>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "elasticity/discrete_elements.hpp"
#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"
#include "steps/carried_parts.hpp"
#include "steps/elastic_forces.hpp"
#include "steps/joint_forces.hpp"

namespace withe {
namespace {

/// Half stencils of rods at a node, from their ends to frames.
std::vector<int> halves_at(const Model& model, int node, const std::vector<RodPass>& passes) {
  std::vector<int> found;
  for (std::size_t h = 0; h < model.half.size(); ++h) {
    const FrameStencil& half = model.half[h];
    const int end = half.frame_first ? model.edge_tail[at(half.edge)] : model.edge_head[at(half.edge)];
    if (end == node && std::any_of(passes.begin(), passes.end(),
                                   [&](const RodPass& pass) { return pass.rod == model.edge_rod[at(half.edge)]; }))
      found.push_back(static_cast<int>(h));
  }
  return found;
}

/// Reads the rows of a step.
class Rows {
 public:
  Rows(const StepProblem& problem, const Assembler& assembler, const StepData& data)
      : problem_(problem), model_(problem.model), assembler_(assembler), data_(data), total_(data.unfolded) {
    sum_rows(problem, data.z, total_);
  }

  /// Rows of a node, without those of the parts that a body carries.
  Vector3 alone(int node) const { return node_vector(model_, data_.unfolded, node); }
  Vector3 total(int node) const { return node_vector(model_, total_, node); }
  /// Moment by the rows of a frame.
  Vector3 total_moment(int frame) const { return moment(frame, total_.segment(model_.frame_dof[at(frame)], size())); }

  /// Rows of the mass and the weight at a node.
  Vector3 added_mass(int node) const {
    const double mass = problem_.parameters->added_mass(node);
    Vector3 out = -mass * problem_.parameters->gravity;
    if (model_.planar()) out -= model_.plane->normal.dot(out) * model_.plane->normal;
    if (problem_.moves()) out += mass * node_vector(model_, data_.acceleration, node);
    return out;
  }

  /// Minus the forces on a body at a node.
  Vector3 loads(int body, int node) const {
    Vector3 out = Vector3::Zero();
    const std::vector<LoadDescription>& loads = model_.description.loads;
    for (std::size_t k = 0; k < loads.size(); ++k)
      if (const LoadDescription& load = loads[k]; load.kind == LoadKind::force && !load.follower &&
                                                  load.pass.on_body() && load.pass.body() == body &&
                                                  load.pass.node == node)
        out -= problem_.parameters->loads.row(first_load_row(model_.description, k)).transpose();
    return out;
  }

  /// Moment of the rows of a frame that a half stencil and the inertia of its edge about itself have.
  Vector3 half_moment(int half) const {
    const FrameStencil& stencil = model_.half[at(half)];
    const ElasticCoefficients& k = acting_coefficients(problem_, data_);
    Local local;
    if (problem_.conserves_energy())
      discrete_half_local(model_, half_coefficients(k, half), discrete_step(problem_, data_), half, false, local);
    else
      half_local(model_, data_.z, half_coefficients(k, half), data_.configuration, half, false, local);
    const int dof = model_.frame_dof[at(stencil.frame)], *dofs = assembler_.half.dofs(half);
    const auto first = std::find(dofs, dofs + assembler_.half.width(), dof) - dofs;
    return moment(stencil.frame, Eigen::Map<const VectorX>(local.gradient + first, size())) + share_of_inertia(half);
  }

  /// Torque of a joint on a frame in a plane, as its rows have it.
  Vector3 joint_moment(int joint, int frame) const {
    const JointAngle& angle = model_.joint_angles[at(joint)];
    if (!model_.planar() || angle.against < 0) return Vector3::Zero();
    const int dof = model_.frame_dof[at(frame)];
    const double sign = dof == angle.turning ? -1.0 : dof == angle.against ? 1.0 : 0.0;
    return sign == 0.0 ? Vector3(Vector3::Zero())
                       : Vector3(sign * joint_row(problem_, data_, joint) * model_.plane->normal);
  }

 private:
  int size() const { return model_.frame_size(); }

  Vector3 moment(int frame, const VectorX& rows) const {
    if (model_.planar()) return rows(0) * model_.plane->normal;
    if (problem_.conserves_energy()) return rows;
    const Matrix3 J = cayley_spin(data_.z.segment<3>(model_.frame_dof[at(frame)]));
    return J.transpose().inverse() * Vector3(rows);
  }

  /// A frame has a share of the inertia of the edges that are attached to it.
  Vector3 share_of_inertia(int half) const {
    if (!problem_.moves()) return Vector3::Zero();
    const Parameters& p = *problem_.parameters;
    const int frame = model_.half[at(half)].frame;
    const auto about_itself = [&](int edge) { return model_.edge_arc(edge) * p.edge_rotary(edge); };
    double all = 0.0;
    for (const FrameStencil& each : model_.half)
      if (each.frame == frame) all += about_itself(each.edge);
    if (all == 0.0) return Vector3::Zero();
    const double share = p.frame_inertia(frame) * about_itself(model_.half[at(half)].edge) / all;
    return share * frame_vector(model_, data_.acceleration, frame);
  }

  const StepProblem& problem_;
  const Model& model_;
  const Assembler& assembler_;
  const StepData& data_;
  VectorX total_;
};

}  // namespace

std::vector<JointPart> parts_of(const JointDescription& joint) {
  std::vector<JointPart> parts;
  for (std::size_t c = 0; c < joint.clusters.size() && !joint.bodies.empty(); ++c) {
    if (joint.body_of(c) >= 0) parts.push_back({joint.body_of(c), {}});
    if (!joint.clusters[c].empty()) parts.push_back({-1, joint.clusters[c]});
  }
  return parts;
}

int carrier_of_slide(const SceneDescription& scene, const JointDescription& joint) {
  const JointLink& link = joint.links.front();
  const int parent = joint.body_of(at(link.parent)), child = joint.body_of(at(link.child));
  const bool swapped = parent < 0 || (child >= 0 && scene.bodies[at(parent)].carrier == child);
  return swapped ? child : parent;
}

int node_of_parts(const Model& model, const std::vector<JointPart>& parts) {
  const SceneDescription& scene = model.description;
  const auto has = [&](const BodyDescription& body, int node) {
    return body.node == node || std::find(body.carried.begin(), body.carried.end(), node) != body.carried.end();
  };
  for (const JointPart& part : parts)
    if (part.body < 0) return scene.rods[at(part.passes.front().rod)].nodes[at(part.passes.front().node)];
  // Base of one of the bodies. It is a point of all others, but of a body on whose slide the first is.
  for (const JointPart& part : parts) {
    const BodyDescription& own = scene.bodies[at(part.body)];
    if (std::all_of(parts.begin(), parts.end(), [&](const JointPart& other) {
          return own.carrier == other.body || has(scene.bodies[at(other.body)], own.node);
        }))
      return own.node;
  }
  return scene.bodies[at(parts.front().body)].node;
}

JointWrenches::JointWrenches(const Model& model) {
  const SceneDescription& scene = model.description;
  int number = 0;
  for (const JointDescription& joint : scene.joints) {
    Place place;
    for (std::size_t k = 0; k < joint.links.size(); ++k) place.joints.push_back(number++);
    if (joint.bodies.empty()) continue;
    const std::vector<JointPart> parts = parts_of(joint);
    place.node = node_of_parts(model, parts);
    for (const JointPart& each : parts) {
      Part part;
      part.body = each.body;
      if (part.body >= 0) {
        const BodyDescription& body = scene.bodies[at(part.body)];
        part.at_base = body.node == place.node;
        part.at_center = body.center == place.node;
        for (const CarriedPart& carried : model.carried)
          if (part.at_base && carried.is_node() && carried.base == place.node &&
              carried.frame == model.body_frame[at(part.body)])
            part.carried.push_back(carried.node);
      } else {
        part.half = halves_at(model, place.node, each.passes);
      }
      place.parts.push_back(std::move(part));
    }
    places_.push_back(std::move(place));
  }
}

void JointWrenches::find(const StepProblem& problem, const Assembler& assembler, StepData& data) const {
  const Rows rows(problem, assembler, data);
  const Model& model = problem.model;
  data.joints.clear();
  for (const Place& place : places_) {
    Vector3 by_rods = rows.alone(place.node);
    Wrench* rods = nullptr;
    const std::size_t first = data.joints.size();
    data.joints.resize(first + place.parts.size());
    for (std::size_t i = 0; i < place.parts.size(); ++i) {
      const Part& part = place.parts[i];
      Wrench& wrench = data.joints[first + i];
      if (part.body < 0) {
        if (!rods) rods = &wrench;
        for (int half : part.half) wrench.moment += rows.half_moment(half);
        continue;
      }
      Vector3 own = rows.loads(part.body, place.node);
      if (part.at_center) own += rows.added_mass(place.node);
      by_rods -= own;
      if (!part.at_base) continue;
      const int frame = model.body_frame[at(part.body)];
      wrench.force = own;
      for (int node : part.carried) wrench.force += rows.total(node);
      wrench.moment = rows.total_moment(frame);
      for (int joint : place.joints) wrench.moment -= rows.joint_moment(joint, frame);
      for (const Part& other : place.parts)
        for (int half : other.half)
          if (model.half[at(half)].frame == frame) wrench.moment -= rows.half_moment(half);
    }
    if (rods) rods->force = by_rods;
  }
}

}  // namespace withe
