#include "run/frames.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "forces/tendon.hpp"
#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"
#include "steps/joint_forces.hpp"

namespace withe {
namespace {

/// An angle, but for whole turns, that is near another one.
double nearest_turn(double angle, double to) {
  constexpr double kFull = 2.0 * std::numbers::pi;
  return angle + kFull * std::round((to - angle) / kFull);
}

/// Turns a frame that nothing holds, and the hinges on it, with the edges that are attached to them.
void orient_frame(const Model& model, int f, const Matrix3& free, State& state) {
  const int dof = model.frame_dof[at(f)];
  Configuration c;
  compute_configuration(model, state, state.q, c);
  // Turn of an attached edge since it was drawn.
  const auto turn_of = [&](const FrameStencil& half) -> Matrix3 {
    const Vector3 t = to_eigen(model.initial_tangent[at(half.edge)]),
                  d1 = to_eigen(model.initial_director[at(half.edge)]);
    Matrix3 drawn;
    drawn << d1, t.cross(d1), t;
    return edge_directors(model, c, half.edge) * drawn.transpose();
  };
  // As the first edge that no hinge lets turn.
  const auto fixed = std::find_if(model.half.begin(), model.half.end(),
                                  [f](const FrameStencil& half) { return half.frame == f && half.hinge < 0; });
  if (free.isIdentity() && fixed != model.half.end()) {
    const Matrix3 rotation = turn_of(*fixed);
    if (model.planar())
      state.q(dof) = nearest_turn(rotation_log(rotation).dot(model.plane->normal), state.q(dof));
    else
      state.frame[at(f)] = rotation;
  }
  for (const FrameStencil& half : model.half)
    if (half.frame == f && half.hinge >= 0) {
      const Hinge& hinge = model.hinges[at(half.hinge)];
      const Matrix3 relative = frame_rotation(model, state, f).transpose() * turn_of(half);
      state.q(hinge.dof) = nearest_turn(rotation_log(relative).dot(hinge.axis), state.q(hinge.dof));
    }
}

/// Forces on some unknowns of frames and hinges, and the derivatives of these forces; all other unknowns stay.
class FrameForces {
 public:
  FrameForces(const Model& model, const Parameters& parameters, const State& state, const std::vector<int>& dofs)
      : model_(model), parameters_(parameters), state_(state), dofs_(dofs) {
    set_elastic(parameters, elastic_);
  }

  /// Finds the forces of half stencils, tendons, moments and joints at the present state.
  void find() {
    const auto size = static_cast<Eigen::Index>(dofs_.size());
    gradient.setZero(size);
    hessian.setZero(size, size);
    compute_configuration(model_, state_, state_.q, configuration_);
    for (int h = 0; h < static_cast<int>(model_.half.size()); ++h) add_half(h);
    for (const TendonSegment& segment : tendon_segments(model_)) add_tendon(segment);
    for (const LoadPiece& piece : resolve_loads(model_).pieces)
      if (piece.shape == LoadShape::frame_moment && piece.load >= 0) add_moment(piece);
    for (int j = 0; j < static_cast<int>(model_.joint_angles.size()); ++j) add_joint(j);
  }

  VectorX gradient;         ///< minus the forces [N m]
  Eigen::MatrixXd hessian;  ///< derivatives of the gradient [N m]

 private:
  /// Row of an unknown, or -1.
  int row_of(int dof) const {
    const auto found = std::find(dofs_.begin(), dofs_.end(), dof);
    return dof < 0 || found == dofs_.end() ? -1 : static_cast<int>(found - dofs_.begin());
  }

  /// Adds the gradient, and the derivatives where `with_matrix`, of `count` unknowns.
  template <class Derivatives>
  void add(const int* dofs, int count, const Derivatives& of, bool with_matrix) {
    int row[kTendonUnknowns];
    for (int i = 0; i < count; ++i) row[i] = row_of(dofs[i]);
    for (int i = 0; i < count; ++i) {
      if (row[i] < 0) continue;
      gradient(row[i]) += of.gradient[i];
      for (int k = 0; with_matrix && k < count; ++k)
        if (row[k] >= 0) hessian(row[i], row[k]) += of.hessian[i][k];
    }
  }

  void add_half(int h) {
    const FrameStencil& half = model_.half[at(h)];
    const int n = model_.frame_size(), first = model_.planar() ? 4 : 7;  // the local unknowns before are the nodes'
    int row[4] = {-1, -1, -1, -1};
    for (int i = 0; i < n; ++i) row[i] = row_of(model_.frame_dof[at(half.frame)] + i);
    if (half.hinge >= 0) row[n] = row_of(model_.hinges[at(half.hinge)].dof);
    if (row[0] < 0) return;
    half_local(model_, state_.q, half_coefficients(elastic_, h), configuration_, h, true, local_);
    for (int i = 0; i <= n; ++i) {
      if (row[i] < 0) continue;
      gradient(row[i]) += local_.gradient[first + i];
      for (int j = 0; j <= n; ++j)
        if (row[j] >= 0) hessian(row[i], row[j]) += local_.hessian[first + i][first + j];
    }
  }

  void add_tendon(const TendonSegment& segment) {
    if (segment.seat[0].half < 0 && segment.seat[1].half < 0) return;
    TendonLocal pulled;
    tendon_local(model_, segment, parameters_.tendon_tension[segment.tendon], state_.q, configuration_, true, pulled);
    add(segment.unknowns.dofs, segment.unknowns.size, pulled, true);
  }

  void add_moment(const LoadPiece& piece) {
    int dofs[kMaxLocal];
    const int count = load_dofs(model_, piece, dofs);
    load_local(model_, state_, state_.q, configuration_, piece, parameters_.loads.row(piece.load), local_);
    add(dofs, count, local_, false);  // whose derivatives at rest are antisymmetric
  }

  void add_joint(int j) {
    const JointAngle& joint = model_.joint_angles[at(j)];
    JointTorque torque = joint_torque(model_, parameters_, elastic_, j);
    const double angle = joint.angle(state_.q);
    const double pull = joint.sign * torque_of(torque, angle, 0.0);
    if (torque.is_saturated(angle)) torque.stiffness = 0.0;
    if (angle < torque.stops.low || angle > torque.stops.high) torque.stiffness += torque.stops.stiffness;
    const int turning = row_of(joint.turning), against = row_of(joint.against);
    if (turning >= 0) gradient(turning) -= pull, hessian(turning, turning) += torque.stiffness;
    if (against >= 0) gradient(against) += pull, hessian(against, against) += torque.stiffness;
    if (turning < 0 || against < 0) return;
    hessian(turning, against) -= torque.stiffness;
    hessian(against, turning) -= torque.stiffness;
  }

  const Model& model_;
  const Parameters& parameters_;
  const State& state_;
  const std::vector<int>& dofs_;
  ElasticCoefficients elastic_;
  Configuration configuration_;
  Local local_;
};
/// Frames and the hinges on them, with the edges where they are; each frame turns about what its `free` projects onto.
void relax_together(const Model& model, const Parameters& parameters, const std::vector<int>& frames,
                    const std::vector<Matrix3>& free, State& state) {
  const int n = model.frame_size();
  std::vector<int> dofs;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    orient_frame(model, frames[f], free[f], state);
    for (int i = 0; i < n; ++i) dofs.push_back(model.frame_dof[at(frames[f])] + i);
  }
  for (const Hinge& hinge : model.hinges)
    if (std::find(frames.begin(), frames.end(), hinge.frame) != frames.end()) dofs.push_back(hinge.dof);
  const auto size = static_cast<Eigen::Index>(dofs.size());
  Eigen::MatrixXd project = Eigen::MatrixXd::Identity(size, size);
  for (std::size_t f = 0; f < frames.size(); ++f)
    project.block(static_cast<Eigen::Index>(f) * n, static_cast<Eigen::Index>(f) * n, n, n) =
        free[f].topLeftCorner(n, n);
  FrameForces forces(model, parameters, state, dofs);
  for (int k = 0; k < 20; ++k) {
    forces.find();
    Eigen::MatrixXd& H = forces.hessian;
    const double scale = std::max(H.diagonal().cwiseAbs().maxCoeff(), 1e-300);
    H = project * H * project + scale * (Eigen::MatrixXd::Identity(size, size) - project);
    const VectorX step = project * H.ldlt().solve(-project * forces.gradient);
    if (!step.allFinite()) break;
    const VectorX taken = step * std::min(1.0, 0.5 / std::max(step.norm(), 1e-300));
    for (Eigen::Index i = 0; i < size; ++i) state.q(dofs[static_cast<std::size_t>(i)]) += taken(i);
    for (int f : frames) {
      if (model.planar()) continue;
      const int dof = model.frame_dof[at(f)];
      state.frame[at(f)] = orthonormalized(cayley(state.q.segment<3>(dof)) * state.frame[at(f)]);
      state.q.segment<3>(dof).setZero();
    }
    if (step.norm() < 1e-13) break;
  }
}

}  // namespace

Matrix3 frame_rotation(const Model& model, const State& state, int frame) {
  if (model.planar()) return rotation_exp(state.q(model.frame_dof[at(frame)]) * model.plane->normal);
  return cayley(state.q.segment<3>(model.frame_dof[at(frame)])) * state.frame[at(frame)];
}

Vector3 angular_velocity(const Model& model, const State& state, const Configuration& c, int edge) {
  const Vector3 t = edge_directors(model, c, edge).col(2);
  const Vector3 along =
      node_vector(model, state.v, model.edge_head[at(edge)]) - node_vector(model, state.v, model.edge_tail[at(edge)]);
  const double spin = model.planar() ? 0.0 : state.v(model.edge_dof[at(edge)]);
  return t.cross(along) / c.length(edge) + spin * t;
}

void relax_frames(const Model& model, const Parameters& parameters, const std::vector<bool>& which, State& state) {
  for (int f = 0; f < model.frame_count; ++f)
    if (which[at(f)]) relax_together(model, parameters, {f}, {Matrix3::Identity()}, state);
}

void relax_joints(const Model& model, const Parameters& parameters, const std::vector<bool>& is_set, State& state) {
  std::vector<bool> which(at(model.frame_count), false);
  for (const FrameStencil& half : model.half)
    if (is_set[at(half.edge)]) which[at(half.frame)] = true;
  const auto free_of = [&](int f) -> Matrix3 {
    for (const Constraint& c : model.constraints)
      if (c.first == model.frame_dof[at(f)]) return c.free;
    return Matrix3::Identity();
  };
  for (int f = 0; f < model.frame_count; ++f) {
    if (!which[at(f)]) continue;
    std::vector<int> together{f};
    for (int other = 0; model.planar() && !model.joint_angles.empty() && other < model.frame_count; ++other)
      if (other != f && model.frame_node[at(other)] == model.frame_node[at(f)]) together.push_back(other);
    std::vector<Matrix3> free;
    for (int each : together) {
      free.push_back(free_of(each));
      which[at(each)] = false;
    }
    relax_together(model, parameters, together, free, state);
  }
}

void turn_frames(const Model& model, const std::vector<bool>& is_set, State& state) {
  Configuration c;
  compute_configuration(model, state, state.q, c);
  const auto rate = [&](int e) { return angular_velocity(model, state, c, e); };
  for (int f = 0; f < model.frame_count; ++f) {
    bool set = false;
    int count = 0;
    Vector3 turn = Vector3::Zero();
    for (const FrameStencil& half : model.half) {
      if (half.frame != f) continue;
      if (is_set[at(half.edge)]) set = true;
      if (half.hinge >= 0) continue;
      turn += rate(half.edge);
      ++count;
    }
    if (!set) continue;
    const int dof = model.frame_dof[at(f)];
    if (count > 0) {
      turn /= count;
      if (model.planar())
        state.v(dof) = turn.dot(model.plane->normal);
      else
        state.v.segment<3>(dof) = turn;
    }
    for (const FrameStencil& half : model.half)
      if (half.frame == f && half.hinge >= 0) {
        const Hinge& hinge = model.hinges[at(half.hinge)];
        const Vector3 axis = frame_rotation(model, state, f) * hinge.axis;
        state.v(hinge.dof) = axis.dot(rate(half.edge) - Vector3(state.v.segment<3>(dof)));
      }
  }
}

}  // namespace withe
