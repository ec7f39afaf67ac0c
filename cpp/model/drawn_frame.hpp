#pragma once
/// The drawn frame of a rod at a node, which a clamp holds, or to which a joint is attached.
///
/// It lies between the frames F0, F1 of two edges of lengths l0, l1, or half an edge beyond them at a rod's end:
///   F = exp(s v) F0,    v = log(F1 F0^T),    s = l0 / (l0 + l1) between them, s = -l0 / (l0 + l1) at the start,
///   F = exp(s v) F1 with s = l1 / (l0 + l1) at the end.

#include "geometry/rotation.hpp"
#include "model/model.hpp"

namespace withe {

/// Edges that arrive at and leave a node of a rod; -1 if there is none.
struct EdgesAtNode {
  int in, out;
};
inline EdgesAtNode edges_at_node(const RodDescription& rod, int first_edge, int node) {
  const int count = static_cast<int>(rod.nodes.size()) - (rod.closed ? 0 : 1);
  const int in = node > 0 ? node - 1 : rod.closed ? count - 1 : -1, out = node < count ? node : -1;
  return {in < 0 ? -1 : first_edge + in, out < 0 ? -1 : first_edge + out};
}

/// The two edges that the frame at a node follows from; of a rod of one edge this alone.
struct FrameEdges {
  enum class Place { start, between, end };
  int before, after;
  Place place;

  bool alone() const { return before == after; }
  /// s, of lengths l0 and l1.
  double share(double l0, double l1) const {
    return (place == Place::start ? -l0 : place == Place::end ? l1 : l0) / (l0 + l1);
  }
};
inline FrameEdges frame_edges(const RodDescription& rod, int first_edge, int node) {
  using enum FrameEdges::Place;
  const auto [in, out] = edges_at_node(rod, first_edge, node);
  const bool several = rod.nodes.size() > 2;
  if (in < 0) return several ? FrameEdges{out, out + 1, start} : FrameEdges{out, out, start};
  if (out < 0) return several ? FrameEdges{in - 1, in, end} : FrameEdges{in, in, end};
  return {in, out, between};
}

/// F of the frames of both edges, columns d1, d2, t.
inline Matrix3 drawn_frame(const FrameEdges& at, const Matrix3& before, const Matrix3& after, double l0, double l1) {
  if (at.alone()) return before;
  const Vector3 turn = rotation_log(after * before.transpose());
  return rotation_exp(at.share(l0, l1) * turn) * (at.place == FrameEdges::Place::end ? after : before);
}

/// Rotation vector of F: by turns of both edges' frames, and by their lengths [1/m].
struct DrawnFrameSlopes {
  Matrix3 before, after;
  Vector3 length0, length1;
};
DrawnFrameSlopes drawn_frame_slopes(const FrameEdges& at, const Matrix3& before, const Matrix3& after, double l0,
                                    double l1);

/// Columns d1, d2, t of an edge as it was drawn.
inline Matrix3 drawn_edge_frame(const Model& model, int edge) {
  const Vector3 t = to_eigen(model.initial_tangent[at(edge)]), d1 = to_eigen(model.initial_director[at(edge)]);
  Matrix3 frame;
  frame << d1, t.cross(d1), t;
  return frame;
}

}  // namespace withe
