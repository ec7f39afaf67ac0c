#include "elasticity/discrete_elements.hpp"

#include <cmath>

#include "elasticity/discrete_gradient.hpp"
#include "elasticity/discrete_planar.hpp"
#include "elasticity/put_local.hpp"
#include "geometry/rotation.hpp"

namespace withe {
namespace {

Vec3d row_of(const Columns3& table, int i) { return {table(i, 0), table(i, 1), table(i, 2)}; }

void add_block(Local& out, int row, int column, double factor, const Mat3<double>& m) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out.hessian[row + i][column + j] += factor * m.row[i][j];
}

/// Places of an edge's vector (head less tail) and angle among the unknowns of a stencil in space.
struct EdgePlace {
  int tail, head, angle;
};

/// Force on an edge from a moment; `spin`: spin of the transport of its directors.
Vec3d edge_force(const MovingEdge<double>& edge, const Vec3d& spin, const Vec3d& moment) {
  return edge.force(moment) + edge.torque(moment) * spin;
}

void add_edge_forces(Local& out, const EdgePlace& e, const MovingEdge<double>& edge, const Vec3d& spin,
                     const Vec3d& moment) {
  const Vec3d f = edge_force(edge, spin, moment);
  const double component[3] = {f.x, f.y, f.z};
  for (int i = 0; i < 3; ++i) {
    out.gradient[e.head + i] += component[i];
    out.gradient[e.tail + i] -= component[i];
  }
  out.gradient[e.angle] += edge.torque(moment);
}

/// Block of an edge: its force from a constant moment, and from its own change of the moment.
void finish_block(const MovingEdge<double>& edge, const DiscreteStep& step, int index, const Vec3d& moment, bool own,
                  EdgeBlock<double>& block) {
  if (own) add_edge_geometry(edge, moment, block);
  if (!step.transported) return;
  const EdgeFrame<double>& middle = step.middle.edge[at(index)];
  add_transport(middle, block);
  if (own) add_spin_change(edge, middle, edge.torque(moment), block);
}

/// Adds the rows of edge `r` by the vector and angle of edge `c`, times two: the end moves twice as far as the middle.
void add_edge_rows(Local& out, const EdgePlace& r, const EdgePlace& c, const EdgeBlock<double>& b) {
  constexpr double kTwice = 2.0;
  for (int s : {1, -1})
    for (int t : {1, -1}) add_block(out, s > 0 ? r.head : r.tail, t > 0 ? c.head : c.tail, s * t * kTwice, b.ee);
  for (int i = 0; i < 3; ++i) {
    out.hessian[r.head + i][c.angle] += kTwice * b.e_angle[i];
    out.hessian[r.tail + i][c.angle] -= kTwice * b.e_angle[i];
    out.hessian[r.angle][c.head + i] += kTwice * b.angle_e[i];
    out.hessian[r.angle][c.tail + i] -= kTwice * b.angle_e[i];
  }
  out.hessian[r.angle][c.angle] += kTwice * b.angle_angle;
}

void clear(Local& out, int width, bool with_matrix) {
  for (int i = 0; i < width; ++i) {
    out.gradient[i] = 0.0;
    for (int j = 0; with_matrix && j < width; ++j) out.hessian[i][j] = 0.0;
  }
}

Vec3d spin_of(const DiscreteStep& step, int edge) {
  return step.transported ? step.middle.edge[at(edge)].spin : Vec3d{};
}

MovingEdge<double> moving_edge(const DiscreteStep& step, int edge) {
  const EdgeFrame<double>&start = step.start.edge[at(edge)], &middle = step.middle.edge[at(edge)],
        &end = step.end.edge[at(edge)];
  return {start.tangent,         start.inverse_length,         end.tangent, end.inverse_length, middle.tangent,
          middle.inverse_length, turn_of_directors(start, end)};
}

PlanarMovingEdge<double> planar_moving_edge(const DiscreteStep& step, int edge, double sign) {
  return {planar_edge(step.start.edge[at(edge)], sign), planar_edge(step.middle.edge[at(edge)], sign),
          planar_edge(step.end.edge[at(edge)], sign)};
}

/// Its derivatives, if requested.
DiscreteMoment<double> moment_between(const BendMeasure& measure, const EdgeFrame<double>& a0,
                                      const EdgeFrame<double>& a1, const EdgeFrame<double>& b0,
                                      const EdgeFrame<double>& b1, const Vec3d& start, const Vec3d& end,
                                      const Vec3d& natural, const Vec3d& stiffness, bool with_matrix) {
  DiscreteMoment<double> m{};
  if (with_matrix)
    discrete_moment<true>(measure, a0, a1, b0, b1, start, end, natural, stiffness, m);
  else
    discrete_moment<false>(measure, a0, a1, b0, b1, start, end, natural, stiffness, m);
  return m;
}

void planar_bend_local(const Model& model, const TurnCoefficients& elastic, const DiscreteStep& step, int stencil,
                       bool with_matrix, Local& out) {
  const BendStencil& s = model.bend[at(stencil)];
  const PlanarMovingEdge<double> edge[2] = {planar_moving_edge(step, s.edge[0], s.sign[0]),
                                            planar_moving_edge(step, s.edge[1], s.sign[1])};
  const PlanarMoment<double> m =
      planar_moment(elastic.measure, edge[0].t0, edge[0].t1, edge[1].t0, edge[1].t1, step.start.bend_strain(stencil, 0),
                    step.end.bend_strain(stencil, 0), elastic.natural.x, elastic.stiffness.x);
  PlanarForces<double> f;
  if (with_matrix)
    planar_discrete_forces<true>(m, edge, f);
  else
    planar_discrete_forces<false>(m, edge, f);
  put_planar_bend(f, with_matrix, out);
}

PlanarHalfForces planar_attached_forces(const TurnCoefficients& elastic, const DiscreteStep& step, int index,
                                        const AttachedStep& attached) {
  const int a = attached.first ? 0 : 1, b = 1 - a;  // slots of the attached part and of the edge
  const PlanarMovingEdge<double> edge = planar_moving_edge(step, index, 1.0);
  Vec2<double> t0[2], t1[2];
  t0[a] = planar_edge(attached.start).tangent, t1[a] = planar_edge(attached.end).tangent;
  t0[b] = edge.t0, t1[b] = edge.t1;
  const PlanarMoment<double> m = planar_moment(elastic.measure, t0[0], t1[0], t0[1], t1[1], attached.start_strain.x,
                                               attached.end_strain.x, elastic.natural.x, elastic.stiffness.x);
  const double sign = attached.first ? -1.0 : 1.0;  // sign of the moment on the edge
  const double by_turn[2] = {2.0 * sign * m.by_a, 2.0 * sign * m.by_b};
  const Vec2<double> column = edge.column(by_turn[b]);
  PlanarHalfForces f{sign * m.moment * edge.force, -sign * m.moment, {}, by_turn[a] * edge.force, -column, -by_turn[a]};
  add_outer(f.edge_edge, 1.0, edge.force, column);
  edge.add_geometry(2.0, sign * m.moment, f.edge_edge);
  return f;
}

/// Moments between an edge and the frame that is attached to it. The rows of the edge have been written.
struct AttachedMoments {
  MovingEdge<double> edge;
  Vec3d spin;
  double sign;                  ///< sign of the moment on the edge
  DiscreteMoment<double> m;     ///< moment of the first on the second, and its derivatives
  EdgeColumns<double> by_edge;  ///< filled if the matrix is requested
};

AttachedMoments put_attached_edge(const TurnCoefficients& elastic, const DiscreteStep& step, int index,
                                  const AttachedStep& attached, bool with_matrix, Local& out) {
  const EdgeFrame<double>&e0 = step.start.edge[at(index)], &e1 = step.end.edge[at(index)];
  const bool first = attached.first;
  AttachedMoments a{moving_edge(step, index), spin_of(step, index), first ? -1.0 : 1.0, {}, {}};
  a.m = moment_between(elastic.measure, first ? attached.start : e0, first ? attached.end : e1,
                       first ? e0 : attached.start, first ? e1 : attached.end, attached.start_strain,
                       attached.end_strain, elastic.natural, elastic.stiffness, with_matrix);
  const EdgePlace place{0, 4, 3};
  const Vec3d moment = a.sign * a.m.moment;
  add_edge_forces(out, place, a.edge, a.spin, moment);
  if (!with_matrix) return a;
  a.by_edge = edge_columns(first ? a.m.by_b : a.m.by_a, e1);
  EdgeBlock<double> block = edge_block(a.edge, a.sign, a.by_edge);
  finish_block(a.edge, step, index, moment, true, block);
  add_edge_rows(out, place, place, block);
  return a;
}

AttachedStep attached_frame(const Model& model, const DiscreteStep& step, int stencil) {
  return {step.start.attached[at(stencil)], step.end.attached[at(stencil)], row_of(step.start.half_strain, stencil),
          row_of(step.end.half_strain, stencil), model.half[at(stencil)].frame_first};
}

/// Derivative of the moment `m` between an edge and a frame by the unknowns of a half stencil at the end of the step.
/// The frame turns there by J(w) dw, and by its hinge's angle about the hinge's `axis`.
Eigen::Matrix<double, 3, 11> moment_columns(const EdgeColumns<double>& by_edge, const Mat3<double>& by_frame,
                                            const Vector3& w, const Vector3& axis) {
  Matrix3 by_spin, by_vector;
  for (int i = 0; i < 3; ++i) {
    by_spin.row(i) << by_frame.row[i].x, by_frame.row[i].y, by_frame.row[i].z;
    by_vector.row(i) << by_edge.edge.row[i].x, by_edge.edge.row[i].y, by_edge.edge.row[i].z;
  }
  Eigen::Matrix<double, 3, 11> by;
  by.middleCols<3>(4) = by_vector;
  by.leftCols<3>() = -by_vector;
  by.col(3) << by_edge.angle.x, by_edge.angle.y, by_edge.angle.z;
  by.middleCols<3>(7) = by_spin * cayley_spin(w);
  by.col(10) = by_spin * axis;
  return by;
}

}  // namespace

HingeArm hinge_arm(const Vector3& w, const Vector3& axis, double angle) {
  const Vector3 x = 0.5 * w;
  const double t = std::tan(0.5 * angle), along = x.dot(axis), n = 1.0 / (1.0 - along * t);
  const bool little = std::abs(angle) < 1e-4;
  const double k = little ? 1.0 + angle * angle / 12.0 : 2.0 * t / angle;
  const double by_k = little ? angle / 6.0 : ((1.0 + t * t) * angle - 2.0 * t) / (angle * angle);
  const Vector3 a = n * (axis + x.cross(axis) + along * x);
  HingeArm h;
  h.arm = k * a;
  h.by_frame =
      0.5 * k *
      (n * (-cross_matrix(axis) + along * Matrix3::Identity() + x * axis.transpose()) + n * t * a * axis.transpose());
  h.by_angle = by_k * a + k * n * along * 0.5 * (1.0 + t * t) * a;
  return h;
}

void discrete_bend_local(const Model& model, const TurnCoefficients& elastic, const DiscreteStep& step, int stencil,
                         bool with_matrix, Local& out) {
  if (model.planar()) return planar_bend_local(model, elastic, step, stencil, with_matrix, out);
  const BendStencil& s = model.bend[at(stencil)];
  clear(out, 11, with_matrix);
  // An edge against its rod has its head where the stencil has its tail.
  EdgePlace place[2];
  for (int k = 0; k < 2; ++k) {
    const int first = 4 * k, second = 4 * (k + 1);
    place[k] = {s.sign[k] > 0 ? first : second, s.sign[k] > 0 ? second : first, first + 3};
  }
  const MovingEdge<double> edge[2] = {moving_edge(step, s.edge[0]), moving_edge(step, s.edge[1])};
  EdgeFrame<double> f0[2], f1[2];
  for (int k = 0; k < 2; ++k) {
    f0[k] = oriented(step.start.edge[at(s.edge[k])], s.sign[k]);
    f1[k] = oriented(step.end.edge[at(s.edge[k])], s.sign[k]);
  }
  const DiscreteMoment<double> m =
      moment_between(elastic.measure, f0[0], f1[0], f0[1], f1[1], row_of(step.start.bend_strain, stencil),
                     row_of(step.end.bend_strain, stencil), elastic.natural, elastic.stiffness, with_matrix);
  const Vec3d moment[2] = {m.moment, -m.moment};
  for (int i = 0; i < 2; ++i) add_edge_forces(out, place[i], edge[i], spin_of(step, s.edge[i]), moment[i]);
  if (!with_matrix) return;
  EdgeColumns<double> columns[2];
  for (int k = 0; k < 2; ++k) columns[k] = edge_columns(k == 0 ? m.by_a : m.by_b, step.end.edge[at(s.edge[k])]);
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) {
      EdgeBlock<double> block = edge_block(edge[i], i == 0 ? 1.0 : -1.0, columns[j]);
      finish_block(edge[i], step, s.edge[i], moment[i], i == j, block);
      add_edge_rows(out, place[i], place[j], block);
    }
}

/// The work of the frame's moment is that over its Cayley vector.
void discrete_half_local(const Model& model, const TurnCoefficients& elastic, const DiscreteStep& step, int stencil,
                         bool with_matrix, Local& out) {
  const FrameStencil& s = model.half[at(stencil)];
  const AttachedStep attached = attached_frame(model, step, stencil);
  if (model.planar()) return put_planar_half(planar_attached_forces(elastic, step, s.edge, attached), with_matrix, out);
  clear(out, 11, with_matrix);
  const AttachedMoments a = put_attached_edge(elastic, step, s.edge, attached, with_matrix, out);
  const Vector3 w = step.end_q.segment<3>(model.frame_dof[at(s.frame)]), on_frame = -a.sign * to_eigen(a.m.moment);
  Vector3 axis = Vector3::Zero();
  HingeArm h{Vector3::Zero(), Matrix3::Zero(), Vector3::Zero()};
  if (s.hinge >= 0) {
    const Hinge& hinge = model.hinges[at(s.hinge)];
    axis = step.end.frame[at(s.frame)] * hinge.axis;
    h = hinge_arm(w, step.start.frame[at(s.frame)] * hinge.axis, step.change(hinge.dof));
  }
  for (int i = 0; i < 3; ++i) out.gradient[7 + i] = on_frame(i);
  out.gradient[10] = h.arm.dot(on_frame);
  if (!with_matrix) return;

  const Eigen::Matrix<double, 3, 11> by = moment_columns(a.by_edge, attached.first ? a.m.by_a : a.m.by_b, w, axis);
  // Rows of the edge by the frame and its hinge.
  for (int k = 7; k < 11; ++k) {
    const Vec3d change = to_vec3(Vector3(2.0 * a.sign * by.col(k)));
    const Vec3d f = edge_force(a.edge, a.spin, change);
    for (int i = 0; i < 3; ++i) {
      out.hessian[4 + i][k] += f[i];
      out.hessian[i][k] -= f[i];
    }
    out.hessian[3][k] += a.edge.torque(change);
  }
  const Eigen::Matrix<double, 3, 11> frame_rows = (-2.0 * a.sign) * by;
  Eigen::Matrix<double, 1, 11> hinge_row = h.arm.transpose() * frame_rows;
  hinge_row.segment<3>(7) += 2.0 * on_frame.transpose() * h.by_frame;
  hinge_row(10) += 2.0 * on_frame.dot(h.by_angle);
  for (int k = 0; k < 11; ++k) {
    for (int i = 0; i < 3; ++i) out.hessian[7 + i][k] = frame_rows(i, k);
    out.hessian[10][k] = hinge_row(k);
  }
}

Vector3 discrete_held_local(const Model& model, const TurnCoefficients& elastic, const DiscreteStep& step, int edge,
                            const AttachedStep& hold, bool with_matrix, Local& out) {
  if (model.planar()) {
    const PlanarHalfForces f = planar_attached_forces(elastic, step, edge, hold);
    put_planar_half(f, with_matrix, out);
    return f.moment * model.plane->normal;
  }
  clear(out, 7, with_matrix);
  const AttachedMoments a = put_attached_edge(elastic, step, edge, hold, with_matrix, out);
  return -a.sign * to_eigen(a.m.moment);
}

Eigen::Matrix<double, 7, 3> discrete_held_spin(const Model& model, const TurnCoefficients& elastic,
                                               const DiscreteStep& step, int edge, const AttachedStep& hold) {
  Eigen::Matrix<double, 7, 3> out = Eigen::Matrix<double, 7, 3>::Zero();
  if (model.planar()) {
    // By the turn in the middle, of which that at the end is twice.
    const Vec2<double> by_turn = 0.5 * planar_attached_forces(elastic, step, edge, hold).edge_frame;
    for (int i = 0; i < 2; ++i) {
      out.row(2 + i) = by_turn[i] * model.plane->normal.transpose();
      out.row(i) = -out.row(2 + i);
    }
    return out;
  }
  Local unused;
  clear(unused, 7, true);
  const AttachedMoments a = put_attached_edge(elastic, step, edge, hold, true, unused);
  const Mat3<double>& by_spin = hold.first ? a.m.by_a : a.m.by_b;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3d moment{a.sign * by_spin.row[0][axis], a.sign * by_spin.row[1][axis], a.sign * by_spin.row[2][axis]};
    const Vec3d f = edge_force(a.edge, a.spin, moment);
    out(3, axis) = a.edge.torque(moment);
    for (int i = 0; i < 3; ++i) {
      out(4 + i, axis) = f[i];
      out(i, axis) = -f[i];
    }
  }
  return out;
}

Eigen::Matrix<double, kMaxLocal, 3> discrete_half_spin(const Model& model, const TurnCoefficients& elastic,
                                                       const DiscreteStep& step, int stencil) {
  const FrameStencil& s = model.half[at(stencil)];
  const AttachedStep attached = attached_frame(model, step, stencil);
  Eigen::Matrix<double, kMaxLocal, 3> out = Eigen::Matrix<double, kMaxLocal, 3>::Zero();
  out.topRows<7>() = discrete_held_spin(model, elastic, step, s.edge, attached);
  if (model.planar()) {
    const double by_turn = 0.5 * planar_attached_forces(elastic, step, s.edge, attached).frame_frame;
    out.row(4) = by_turn * model.plane->normal.transpose();
    return out;
  }
  Local unused;
  clear(unused, kMaxLocal, true);
  const AttachedMoments a = put_attached_edge(elastic, step, s.edge, attached, true, unused);
  const Mat3<double>& by_spin = attached.first ? a.m.by_a : a.m.by_b;
  for (int i = 0; i < 3; ++i)
    for (int axis = 0; axis < 3; ++axis) out(7 + i, axis) = -a.sign * by_spin.row[i][axis];
  if (s.hinge < 0) return out;
  const Hinge& hinge = model.hinges[at(s.hinge)];
  const HingeArm h = hinge_arm(step.end_q.segment<3>(model.frame_dof[at(s.frame)]),
                               step.start.frame[at(s.frame)] * hinge.axis, step.change(hinge.dof));
  out.row(10) = h.arm.transpose() * out.middleRows<3>(7);
  return out;
}

void discrete_stretch_local(const Model& model, const ElasticCoefficients& elastic, const DiscreteStep& step, int edge,
                            bool with_matrix, const double* given_force, Local& out) {
  const auto [force, modulus, inverse_mean] = mean_stretch(model, elastic, step.start, step.end, edge);
  const EdgeFrame<double>& middle = step.middle.edge[at(edge)];
  const Vec3d direction = (inverse_mean * step.middle.length[edge]) * middle.tangent;
  put_stretch(model.dimension, direction, step.end.edge[at(edge)].tangent, force, modulus,
              (given_force ? given_force[edge] : force) * inverse_mean, with_matrix, out);
}

}  // namespace withe
