#pragma once
/// A piece of a tendon in a configuration, and how it changes; see tendon.hpp.

#include <algorithm>
#include <cmath>

#include "forces/tendon.hpp"
#include "geometry/rotation.hpp"

namespace withe {

/// Coordinates of the two seats of a segment. An edge has its vector and its angle. A frame has its Cayley vector and
/// the angle of its hinge; in a plane, the angle of the frame. A straight segment also has the displacements of its
/// places.
constexpr int kTurns = 4, kSmooth = 2 * kTurns, kStraight = kSmooth + 6;

template <int width>
using Columns = Eigen::Matrix<double, 3, width>;
template <int width>
using Row = Eigen::Matrix<double, 1, width>;
using Turn = Columns<kTurns>;
using TurnSquare = Eigen::Matrix<double, kTurns, kTurns>;

/// A gradient and a matrix by these coordinates.
template <int width>
struct Work {
  Eigen::Matrix<double, width, 1> gradient = Eigen::Matrix<double, width, 1>::Zero();
  Eigen::Matrix<double, width, width, Eigen::RowMajor> hessian;

  explicit Work(bool with_matrix) {
    if (with_matrix) hessian.setZero();
  }
  auto own(int k) { return hessian.template block<kTurns, kTurns>(kTurns * k, kTurns * k); }
};

/// Which unknowns move with which coordinates.
struct Link {
  int unknown, coordinate, count;
  double factor;
};
struct Links {
  int count = 0;
  Link link[10];

  Links(const Model& model, const TendonSegment& segment) {
    const int n = model.dimension;
    for (int k = 0; k < 2; ++k) {
      const GuideUnknowns& u = segment.unknowns.guide[k];
      const double share = segment.seat[k].share;
      const int turn = kTurns * k, angle = turn + 3, place = kSmooth + 3 * k;
      if (segment.seat[k].on_body()) {
        add({u.node, place, n, 1.0});
        continue;
      }
      if (u.frame < 0) {
        add({u.head, turn, n, 1.0});
        add({u.tail, turn, n, -1.0});
        if (u.angle >= 0) add({u.angle, angle, 1, 1.0});
        if (!segment.smooth) {
          add({u.tail, place, n, 1.0 - share});
          add({u.head, place, n, share});
        }
        continue;
      }
      add(n == 2 ? Link{u.frame, angle, 1, 1.0} : Link{u.frame, turn, 3, 1.0});
      if (u.hinge >= 0) add({u.hinge, angle, 1, 1.0});
      if (!segment.smooth) add({u.node, place, n, 1.0});
    }
  }

 private:
  void add(const Link& of) { link[count++] = of; }
};

template <int width>
void put(const Model& model, const TendonSegment& segment, const Work<width>& work, bool with_matrix,
         TendonLocal& out) {
  const Links links(model, segment);
  const int size = segment.unknowns.size;
  std::fill(std::begin(out.gradient), std::end(out.gradient), 0.0);
  for (int a = 0; a < links.count; ++a) {
    const auto& [unknown, coordinate, count, factor] = links.link[a];
    for (int i = 0; i < count; ++i) out.gradient[unknown + i] += factor * work.gradient(coordinate + i);
  }
  if (!with_matrix) return;
  double by_unknowns[width][kTendonUnknowns];  // rows by coordinates
  for (int r = 0; r < width; ++r) {
    std::fill(by_unknowns[r], by_unknowns[r] + size, 0.0);
    for (int a = 0; a < links.count; ++a) {
      const auto& [unknown, coordinate, count, factor] = links.link[a];
      for (int i = 0; i < count; ++i) by_unknowns[r][unknown + i] += factor * work.hessian(r, coordinate + i);
    }
  }
  std::fill(&out.hessian[0][0], &out.hessian[0][0] + kTendonUnknowns * kTendonUnknowns, 0.0);
  for (int a = 0; a < links.count; ++a) {
    const auto& [unknown, coordinate, count, factor] = links.link[a];
    for (int i = 0; i < count; ++i)
      for (int j = 0; j < size; ++j) out.hessian[unknown + i][j] += factor * by_unknowns[coordinate + i][j];
  }
}

inline double direction(int end) { return end == 0 ? -1.0 : 1.0; }

/// In a plane with z = 0.
inline Vector3 node_of(const Model& model, const VectorX& q, int dof) {
  return {q(dof), q(dof + 1), model.planar() ? 0.0 : q(dof + 2)};
}

/// In a plane: its tangent, and the normal as d2, so that d1 is normal x tangent.
inline EdgeFrame<double> in_space(const Model& model, const EdgeFrame<double>& f) {
  if (!model.planar()) return f;
  const Vec3d t{f.tangent.x, f.tangent.y, 0.0};
  return {t, {-t.y, t.x, 0.0}, {0.0, 0.0, 1.0}, f.inverse_length, {}, {}};
}

inline int node_dof_at(const Model& model, const GuideSeat& seat) {
  return model.half[at(seat.half)].frame_first ? model.tail_dof[at(seat.edge)] : model.head_dof[at(seat.edge)];
}

/// Frame of a seat; of a node that of space, which no force depends on.
inline EdgeFrame<double> frame_at(const Model& model, const GuideSeat& seat, const Configuration& c) {
  if (seat.on_body()) return {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}, 0.0, {}, {}};
  return in_space(model, seat.half < 0 ? c.edge[at(seat.edge)] : c.attached[at(seat.half)]);
}

/// A guide somewhere.
struct Guide {
  EdgeFrame<double> frame;
  Vector3 arm, tangent, point;  ///< the tangent along the tendon
  double length;                ///< length of its edge; 0 if there is none

  /// `node(dof)`: where a node is.
  template <class NodeAt>
  Guide(const Model& model, const GuideSeat& seat, const NodeAt& node, const Configuration& c)
      : frame(frame_at(model, seat, c)),
        arm(to_eigen(frame.d1) * seat.offset.x() + to_eigen(frame.d2) * seat.offset.y()),
        tangent(seat.sign * to_eigen(frame.tangent)),
        point(arm),
        length(seat.on_edge() ? c.length[seat.edge] : 0.0) {
    if (seat.on_body())
      point += node(model.node_dof[at(seat.node)]);
    else if (seat.half >= 0)
      point += node(node_dof_at(model, seat));
    else
      point +=
          (1.0 - seat.share) * node(model.tail_dof[at(seat.edge)]) + seat.share * node(model.head_dof[at(seat.edge)]);
  }
};

struct Segment {
  Guide guide[2];
  Vector3 apart;     ///< D of a straight piece
  Vector3 arms;      ///< r = r' - r
  Vector3 sum;       ///< s = t + t'
  double span;       ///< l
  double size;       ///< |s|
  double product;    ///< p = s . r
  double along;      ///< B = p / |s|
  double stretched;  ///< A
  double length;     ///< L

  template <class NodeAt>
  Segment(const Model& model, const TendonSegment& of, const NodeAt& node, const Configuration& c)
      : guide{{model, of.seat[0], node, c}, {model, of.seat[1], node, c}},
        apart(guide[1].point - guide[0].point),
        arms(guide[1].arm - guide[0].arm),
        sum(guide[0].tangent + guide[1].tangent),
        span(of.span[0] * guide[0].length + of.span[1] * guide[1].length),
        size(sum.norm()),
        product(sum.dot(arms)),
        along(product / size),
        stretched(4.0 / 3.0 * along - product / 6.0),
        length(of.smooth ? std::sqrt(std::pow(span + stretched, 2) + arms.squaredNorm() - along * along)
                         : apart.norm()) {}
};

inline Segment segment_at(const Model& model, const TendonSegment& segment, const VectorX& q, const Configuration& c) {
  return {model, segment, [&](int dof) { return node_of(model, q, dof); }, c};
}

inline Vector3 hinge_axis(const Model& model, const GuideSeat& seat, const Configuration& c) {
  const FrameStencil& half = model.half[at(seat.half)];
  return c.frame[at(half.frame)] * model.hinges[at(half.hinge)].axis;
}

inline Matrix3 edge_turn(const EdgeFrame<double>& f) {
  const Vector3 t = to_eigen(f.tangent);
  return f.inverse_length * cross_matrix(t) + t * to_eigen(f.spin).transpose();
}

/// Rotation of a guide's seat.
inline Turn turn_of(const Model& model, const TendonSegment& of, int k, const Guide& guide, const VectorX& q,
                    const Configuration& c) {
  Turn out = Turn::Zero();
  const GuideSeat& seat = of.seat[k];
  if (seat.on_body()) return out;
  if (seat.half < 0) {
    out << edge_turn(guide.frame), to_eigen(guide.frame.tangent);
  } else if (model.planar()) {
    out(2, 3) = 1.0;
  } else {
    const int dof = model.frame_dof[at(model.half[at(seat.half)].frame)];
    out.leftCols<3>() = cayley_spin(q.segment<3>(dof));
    if (of.unknowns.guide[k].hinge >= 0) out.col(3) = hinge_axis(model, seat, c);
  }
  return out;
}

/// Derivatives of a segment.
template <int width>
struct Changes {
  Turn turn[2], arm[2], tangent[2];
  Columns<width> arms, sum;  ///< of r, and of s; for a straight piece, of D instead of r
  Row<width> span;           ///< of l

  Changes(const Model& model, const TendonSegment& of, const Segment& segment, const VectorX& q, const Configuration& c)
      : arms(Columns<width>::Zero()), sum(arms), span(Row<width>::Zero()) {
    for (int k = 0; k < 2; ++k) {
      const Guide& guide = segment.guide[k];
      turn[k] = turn_of(model, of, k, guide, q, c);
      arm[k] = -cross_matrix(guide.arm) * turn[k];
      arms.template middleCols<kTurns>(kTurns * k) = direction(k) * arm[k];
      if constexpr (width == kStraight) {
        arms.template middleCols<3>(kSmooth + 3 * k) = direction(k) * Matrix3::Identity();
      } else {
        tangent[k] = -cross_matrix(guide.tangent) * turn[k];
        sum.template middleCols<kTurns>(kTurns * k) = tangent[k];
        if (of.seat[k].on_edge())
          span.template segment<3>(kTurns * k) = of.span[k] * to_eigen(guide.frame.tangent).transpose();
      }
    }
  }
};

/// Forces of a tension on arms (of the second seat; the first has the opposite force), on tangents and on l. They act
/// over a step from one segment to another, or at one segment if both are equal. Derivatives are by the second segment.
template <int width>
struct Pull {
  Vector3 g = Vector3::Zero(), y = Vector3::Zero();
  double axial = 0.0;
  Columns<width> by_g = Columns<width>::Zero(), by_y = by_g;
  Row<width> by_axial = Row<width>::Zero();

  /// `by`: changes of the second; null: no derivatives.
  Pull(double tension, const Segment& a, const Segment& b, const Changes<width>* by) {
    const double lengths = a.length + b.length;
    if (lengths == 0.0) return;
    const double k = 2.0 * tension / lengths;  // T / L
    if constexpr (width == kSmooth) {
      follow(k, a, b, by);
    } else {
      const Vector3 apart = 0.5 * (a.apart + b.apart);
      g = k * apart;
      if (!by || b.length == 0.0) return;
      const Row<width> by_length = b.apart.transpose() / b.length * by->arms;
      by_g = 0.5 * k * by->arms - k / lengths * apart * by_length;
    }
  }

 private:
  void follow(double k, const Segment& a, const Segment& b, const Changes<width>* by) {
    const Vector3 r = 0.5 * (a.arms + b.arms), s = 0.5 * (a.sum + b.sum);
    const double qa = 1.0 / a.size, qb = 1.0 / b.size, q = 0.5 * (qa + qb), p = 0.5 * (a.product + b.product),
                 l = 0.5 * (a.span + b.span + a.stretched + b.stretched), c = 2.0 * qa * qb / (a.size + b.size),
                 beta = 4.0 / 3.0 * l - 0.5 * (a.along + b.along), m = beta * q - l / 6.0;
    const Vector3 by_arms = r + m * s, by_sum = m * r - beta * p * c * s;
    g = k * by_arms;
    y = k * by_sum;
    axial = k * l;
    if (!by || b.length == 0.0) return;
    // Derivatives of the second's |s|, p, B and A, and of L and T / L; then of means.
    const Row<width> size = qb * (b.sum.transpose() * by->sum),
                     product = b.sum.transpose() * by->arms + b.arms.transpose() * by->sum,
                     along = qb * (product - b.along * size), stretched = 4.0 / 3.0 * along - product / 6.0,
                     length = ((b.span + b.stretched) * (by->span + stretched) - b.along * along +
                               b.arms.transpose() * by->arms) /
                              b.length,
                     d_k = -k / (a.length + b.length) * length, d_l = 0.5 * (by->span + stretched),
                     d_beta = 4.0 / 3.0 * d_l - 0.5 * along, d_q = -0.5 * qb * qb * size,
                     d_m = q * d_beta + beta * d_q - d_l / 6.0, d_c = -c * (1.0 / (a.size + b.size) + qb) * size;
    by_g = by_arms * d_k + k * (0.5 * by->arms + s * d_m + 0.5 * m * by->sum);
    by_y = by_sum * d_k + k * (r * d_m + 0.5 * m * by->arms - 0.5 * beta * p * c * by->sum -
                               s * (p * c * d_beta + 0.5 * beta * c * product + beta * p * d_c));
    by_axial = l * d_k + k * d_l;
  }
};

}  // namespace withe
