#include "forces/tendon.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

#include "forces/tendon_pieces.hpp"

namespace withe {
namespace {

Matrix3 symmetric(const Vector3& a, const Vector3& b) { return 0.5 * (a * b.transpose() + b * a.transpose()); }

/// Forces on vectors that a guide's carrier has: sum of v f^T and of v x f.
struct Carried {
  Matrix3 products = Matrix3::Zero();
  Vector3 moment = Vector3::Zero();

  void add(const Vector3& v, const Vector3& f) {
    products += v * f.transpose();
    moment += v.cross(f);
  }
};

/// Second derivatives of v . f on an edge and, for a force along it, second derivatives of its length.
TurnSquare edge_curvature(const EdgeFrame<double>& e, const Turn& turn, const Carried& carried, double axial) {
  const Vector3 t = to_eigen(e.tangent), spin = to_eigen(e.spin), &m = carried.moment;
  const double k = e.inverse_length, about = m.dot(t);
  const Vector3 across = k * (m - about * t);
  const Matrix3 N =
      0.5 * (carried.products + carried.products.transpose()) - carried.products.trace() * Matrix3::Identity();
  TurnSquare out = turn.transpose() * (N * turn);
  out.topLeftCorner<3, 3>() += -2.0 * k * k * symmetric(m.cross(t), t) + symmetric(across, spin) -
                               about * symmetric(spin, to_eigen(e.bow)) +
                               axial * k * (Matrix3::Identity() - t * t.transpose());
  out.topRightCorner<3, 1>() += 0.5 * across;
  out.bottomLeftCorner<1, 3>() += 0.5 * across.transpose();
  return out;
}

/// The same on a frame: rows are J(w)^T m and, of a hinge's axis A, A . m.
TurnSquare frame_curvature(const Model& model, const GuideSeat& seat, const Turn& turn, const Carried& carried,
                           const VectorX& q, const Configuration& c) {
  TurnSquare out = turn.transpose() * ((carried.products - carried.products.trace() * Matrix3::Identity()) * turn);
  if (model.planar()) return out;
  const FrameStencil& half = model.half[at(seat.half)];
  out.topLeftCorner<3, 3>() += cayley_moment_slope(q.segment<3>(model.frame_dof[at(half.frame)]), carried.moment);
  if (half.hinge >= 0)
    out.bottomLeftCorner<1, 3>() += hinge_axis(model, seat, c).cross(carried.moment).transpose() * turn.leftCols<3>();
  return out;
}

/// Derivatives of the arm and the tangent of a guide.
template <int width>
Carried carried_by(const Segment& segment, int end, const Pull<width>& pull) {
  Carried out;
  out.add(segment.guide[end].arm, direction(end) * pull.g);
  if constexpr (width == kSmooth) out.add(segment.guide[end].tangent, pull.y);
  return out;
}

/// Pairs of neighbouring edges, and the signs of their tangents in this order. Edges are neighbours if they follow each
/// other along a rod, with or without a support between them, or if a stencil of rods in a row joins them.
using Neighbours = std::map<std::pair<int, int>, std::pair<double, double>>;

Neighbours neighbours_of(const Model& model) {
  Neighbours out;
  for (const BendStencil& s : model.bend) {
    const auto a = static_cast<double>(s.sign[0]), b = static_cast<double>(s.sign[1]);
    out[{s.edge[0], s.edge[1]}] = {a, b};
    out[{s.edge[1], s.edge[0]}] = {-b, -a};
  }
  for (std::size_t r = 0; r < model.description.rods.size(); ++r) {
    const int first = model.rod_first_edge[r], last = model.rod_first_edge[r + 1] - 1;
    const auto add = [&](int a, int b) { out[{a, b}] = {1.0, 1.0}, out[{b, a}] = {-1.0, -1.0}; };
    for (int e = first; e < last; ++e) add(e, e + 1);
    if (model.description.rods[r].closed) add(last, first);
  }
  return out;
}

/// Index of the stencil between an edge and the frame at its tail (`frame_first`) or at its head; -1 if there is none.
int half_at(const Model& model, int edge, bool frame_first) {
  for (std::size_t h = 0; h < model.half.size(); ++h)
    if (model.half[h].edge == edge && model.half[h].frame_first == frame_first) return static_cast<int>(h);
  return -1;
}

GuideSeat seat_of(const Model& model, const TendonGuide& guide, const Vector2& offset) {
  GuideSeat seat;
  if (guide.on_body()) {
    seat.edge = -1;
    seat.node = guide.edge;
    seat.offset.setZero();
    return seat;
  }
  seat.edge = model.rod_first_edge[at(guide.rod)] + guide.edge;
  seat.share = guide.place == GuidePlace::start ? 0.0 : guide.place == GuidePlace::end ? 1.0 : 0.5;
  seat.offset = offset;
  if (guide.place != GuidePlace::middle) seat.half = half_at(model, seat.edge, guide.place == GuidePlace::start);
  if (!model.planar()) return seat;
  const Vector3 t = to_eigen(model.initial_tangent[at(seat.edge)]),
                d1 = model.description.rods[at(guide.rod)].directors.row(guide.edge),
                arm = offset.x() * d1 + offset.y() * t.cross(d1);
  seat.offset = {arm.dot(model.plane->normal.cross(t)), 0.0};
  return seat;
}

/// True if a piece follows a rod; sets the signs of tangents.
bool follows(const Neighbours& neighbours, const Model& model, GuideSeat (&seat)[2]) {
  const auto middle = [](const GuideSeat& of) { return of.on_edge() && of.share == 0.5; };
  if (middle(seat[0]) && middle(seat[1])) {
    const auto found = neighbours.find({seat[0].edge, seat[1].edge});
    if (found == neighbours.end()) return false;
    std::tie(seat[0].sign, seat[1].sign) = found->second;
    return true;
  }
  for (int k = 0; k < 2; ++k) {
    if (seat[k].half < 0 || !middle(seat[1 - k]) || seat[1 - k].edge != seat[k].edge) continue;
    seat[0].sign = seat[1].sign = model.half[at(seat[k].half)].frame_first == (k == 0) ? 1.0 : -1.0;
    return true;
  }
  return false;
}

SegmentUnknowns unknowns_of(const Model& model, const TendonSegment& segment) {
  SegmentUnknowns out;
  std::fill(std::begin(out.dofs), std::end(out.dofs), -1);
  const auto place_of = [&](int first, int count) {
    const auto place = static_cast<int>(std::find(out.dofs, out.dofs + out.size, first) - out.dofs);
    if (place < out.size) return place;
    for (int i = 0; i < count; ++i) out.dofs[out.size++] = first + i;
    return place;
  };
  for (int k = 0; k < 2; ++k) {
    const GuideSeat& seat = segment.seat[k];
    GuideUnknowns& u = out.guide[k];
    if (seat.on_body()) {
      u.node = place_of(model.node_dof[at(seat.node)], model.dimension);
      continue;
    }
    if (seat.half < 0) {
      u.tail = place_of(model.tail_dof[at(seat.edge)], model.dimension);
      if (!model.planar()) u.angle = place_of(model.edge_dof[at(seat.edge)], 1);
      u.head = place_of(model.head_dof[at(seat.edge)], model.dimension);
      continue;
    }
    const FrameStencil& half = model.half[at(seat.half)];
    u.node = place_of(node_dof_at(model, seat), model.dimension);
    u.frame = place_of(model.frame_dof[at(half.frame)], model.frame_size());
    if (!model.planar() && half.hinge >= 0) u.hinge = place_of(model.hinges[at(half.hinge)].dof, 1);
  }
  return out;
}

/// Sets the spans of the pieces of one tendon beside frames. An edge turns less at a frame, and as much more at its
/// other end (`Model::half_share`); the two pieces there divide the edge in the same shares.
void share_spans(const Model& model, std::span<TendonSegment> pieces) {
  for (std::size_t i = 0; i < pieces.size(); ++i)
    for (int k : {0, 1}) {
      const GuideSeat& seat = pieces[i].seat[k];
      const bool alone = k == 0 ? i == 0 : i + 1 == pieces.size();
      if (seat.half >= 0 || alone || !pieces[i].smooth) continue;
      TendonSegment& next = pieces[k == 0 ? i - 1 : i + 1];
      const int half = half_at(model, seat.edge, (k == 1) == (seat.sign > 0.0));
      if (half < 0 || !next.smooth) continue;
      const double less = 0.5 - model.half_share(half);
      pieces[i].span[k] -= less;
      next.span[1 - k] += less;
    }
}

}  // namespace

std::vector<TendonSegment> tendon_segments(const Model& model) {
  std::vector<TendonSegment> out;
  const Neighbours neighbours = neighbours_of(model);
  int number = 0;
  for (const TendonDescription& tendon : model.description.tendons) {
    for (std::size_t g = 0; g + 1 < tendon.guides.size(); ++g) {
      TendonSegment segment{.tendon = number, .smooth = false, .seat = {}, .unknowns = {}};
      for (std::size_t k = 0; k < 2; ++k)
        segment.seat[k] =
            seat_of(model, tendon.guides[g + k], tendon.offsets.row(static_cast<Eigen::Index>(g + k)).transpose());
      segment.smooth = follows(neighbours, model, segment.seat);
      segment.unknowns = unknowns_of(model, segment);
      out.push_back(segment);
    }
    ++number;
    share_spans(model, std::span(out).last(tendon.guides.size() - 1));
  }
  return out;
}

namespace {

template <int width>
void add_local(const Model& model, const TendonSegment& segment, double tension, const VectorX& q,
               const Configuration& c, bool with_matrix, TendonLocal& out) {
  const Segment now = segment_at(model, segment, q, c);
  out.energy = tension * now.length;
  std::optional<Changes<width>> by;
  if (with_matrix) by.emplace(model, segment, now, q, c);
  const Pull<width> pull(tension, now, now, by ? &*by : nullptr);
  Work<width> work(with_matrix);
  for (int k = 0; k < 2; ++k) {
    const GuideSeat& seat = segment.seat[k];
    const EdgeFrame<double>& e = now.guide[k].frame;
    const Carried carried = carried_by(now, k, pull);
    const Vector3& m = carried.moment;
    const double axial = segment.span[k] * pull.axial;
    auto rows = work.gradient.template segment<kTurns>(kTurns * k);
    if (seat.half >= 0) {
      rows = turn_of(model, segment, k, now.guide[k], q, c).transpose() * m;
    } else if (seat.on_edge()) {
      const Vector3 t = to_eigen(e.tangent);
      const double about = m.dot(t);
      rows.template head<3>() = e.inverse_length * m.cross(t) + about * to_eigen(e.spin) + axial * t;
      rows(3) = about;
    }
    if constexpr (width == kStraight) work.gradient.template segment<3>(kSmooth + 3 * k) = direction(k) * pull.g;
    if (!by || seat.on_body()) continue;
    work.own(k) += seat.half < 0 ? edge_curvature(e, by->turn[k], carried, axial)
                                 : frame_curvature(model, seat, by->turn[k], carried, q, c);
  }
  if (by) {  // pull has derivatives by one of two equal arguments: half of the total
    work.hessian.noalias() += 2.0 * (by->arms.transpose() * pull.by_g);
    if constexpr (width == kSmooth)
      work.hessian.noalias() += 2.0 * (by->sum.transpose() * pull.by_y) + 2.0 * (by->span.transpose() * pull.by_axial);
  }
  put(model, segment, work, with_matrix, out);
}

}  // namespace

void tendon_local(const Model& model, const TendonSegment& segment, double tension, const VectorX& q,
                  const Configuration& c, bool with_matrix, TendonLocal& out) {
  if (segment.smooth)
    add_local<kSmooth>(model, segment, tension, q, c, with_matrix, out);
  else
    add_local<kStraight>(model, segment, tension, q, c, with_matrix, out);
}

Vector3 guide_moment(const Model& model, const TendonSegment& segment, int end, double tension, const VectorX& q,
                     const Configuration& c) {
  const Segment now = segment_at(model, segment, q, c);
  if (segment.smooth) return carried_by(now, end, Pull<kSmooth>(tension, now, now, nullptr)).moment;
  return carried_by(now, end, Pull<kStraight>(tension, now, now, nullptr)).moment;
}

Vector3 guide_hinge_axis(const Model& model, const TendonSegment& segment, int end, const Configuration& c) {
  return hinge_axis(model, segment.seat[end], c);
}

double segment_length(const Model& model, const TendonSegment& segment, const VectorX& q, const Configuration& c) {
  return segment_at(model, segment, q, c).length;
}

double free_end_compliance(const Model& model, const Parameters& parameters, const TendonSegment& segment) {
  double sum = 0.0;
  for (int k : {0, 1}) {
    const GuideSeat &seat = segment.seat[k], &before = segment.seat[1 - k];
    if (seat.half >= 0 || seat.share == 0.5 || before.share != 0.5 || before.edge != seat.edge) continue;
    const int node = (seat.share == 0.0 ? model.tail_dof : model.head_dof)[at(seat.edge)];
    const auto meet = std::count(model.tail_dof.begin(), model.tail_dof.end(), node) +
                      std::count(model.head_dof.begin(), model.head_dof.end(), node);
    if (meet > 1) continue;
    const Vector2 bend = bend_of(model, parameters, seat.edge);
    for (int axis = 0; axis < (model.planar() ? 1 : 2); ++axis)
      sum += 0.5 * model.edge_arc(seat.edge) * seat.offset[axis] * seat.offset[axis] / bend[axis];
  }
  return sum;
}

MatrixX3 guide_points(const Model& model, int tendon, const VectorX& q, const Configuration& c) {
  const TendonDescription& of = model.description.tendons[at(tendon)];
  MatrixX3 out(of.offsets.rows(), 3);
  for (Eigen::Index g = 0; g < out.rows(); ++g) {
    const GuideSeat seat = seat_of(model, of.guides[static_cast<std::size_t>(g)], of.offsets.row(g).transpose());
    const Vector3 p = Guide(model, seat, [&](int dof) { return node_of(model, q, dof); }, c).point;
    out.row(g) = (model.planar() ? model.plane->origin + p.x() * model.plane->first + p.y() * model.plane->second : p)
                     .transpose();
  }
  return out;
}

}  // namespace withe
