#pragma once
/// A tendon runs without friction through guides on rods and has one tension T [N] [Rucker and Webster 2011, IEEE
/// Trans. Robot. 27]. A guide is at p = x + r with r = a d1 + b d2, where x is a place on an edge and (a, b) [m] an
/// offset along the edge's material directors. At a rod's end that is rigid with a joint or a clamp, the guide is on
/// that joint or clamp. A guide on a rigid body is a point that the body carries, with r = 0. The tendon's forces are
/// minus the gradient of T L. Its length L is a sum over pieces from one guide to the next. A straight piece has L =
/// |p' - p|. A piece between neighbours of one rod has
///   L^2 = (l + A)^2 + r^2 - B^2,   A = 4 B / 3 - p / 6,
/// with r = r' - r, s = t + t', p = s . r and B = p / |s|. The length l reaches from the middle of an edge to the
/// middle of the next edge, or to the wall. It is half of each edge, but 5/12 at a frame and 7/12 on the other side of
/// that edge, as in `Model::half_share`, because edges turn in these shares. A tendon beside the smooth rod has this
/// length. For edges that turn by phi towards the tendon, A is -h phi up to phi^5, and B is the chord -2 h sin(phi /
/// 2). r^2 - B^2 is the contribution of twist and winding. The distance p' - p would be shorter by l phi^2 / 8, which
/// on coarse meshes is as large as h phi.
///
/// The forces of a step use means over both configurations (of A, B, p, 1 / |s|, vectors, L). For two equal
/// configurations they are the gradient. With a = l + A, b = 4 a / 3 - B and m = b / |s| - a / 6, the forces
///   on arms -+ (T / L) (r + m s),   on tangents (T / L) (m r - b p s / (|s| |s0| |s1|)),   along edges (T / L) a / 2
/// are a discrete gradient: their work is T times the change of the length. For a straight piece the force is T D / L
/// on arms. Moments are in balance. In energy-momentum steps, an edge or frame turns its moment into forces that do
/// exactly this work over its finite rotation; see `MovingEdge` and `HingeArm`.
///
/// An edge or frame with a vector v, on which a force f acts, has the moment m = v x f, and
///   d^2 (v . f) = (f . w)(v . w) - (f . v) |w|^2 + m . d(w)
/// as it turns by w. An edge turns by w = t x de / l + t (d theta + spin . de), so that
///   m . d(w) = - 2 (m . (t x de)) (t . de) / l^2 + (m - (m . t) t) . de (d theta + spin . de) / l
///              - (m . t) (spin . de)(bow . de).

#include "elasticity/discrete_elements.hpp"

namespace withe {

/// Two edges without a common node have the most unknowns.
constexpr int kTendonUnknowns = 14;
using TendonLocal = LocalOf<kTendonUnknowns>;

/// Seat of a guide: an edge, a frame, or a node that a body carries.
struct GuideSeat {
  int edge = 0;        ///< -1: a node
  int node = -1;       ///< of a body
  double share = 0.5;  ///< along the edge, 0 at its tail
  int half = -1;       ///< stencil between edge and frame, if the guide is on the attached part; else -1
  double sign = 1.0;   ///< sign of the tangent along the tendon
  Vector2 offset;      ///< along d1, d2; in a plane (normal x tangent, unused) [m]

  bool on_body() const { return node >= 0; }
  bool on_edge() const { return node < 0 && half < 0; }
};

/// Indices of the unknowns of the seat of a guide among the unknowns of its segment; -1: none.
struct GuideUnknowns {
  int tail = -1, angle = -1, head = -1;   ///< unknowns of an edge
  int node = -1, frame = -1, hinge = -1;  ///< unknowns of the part that is attached to a frame
};
struct SegmentUnknowns {
  int size = 0, dofs[kTendonUnknowns];  ///< -1 after the first `size`
  GuideUnknowns guide[2];
};

/// A piece of a tendon from one guide to the next.
struct TendonSegment {
  int tendon = 0;
  bool smooth = false;  ///< between neighbours of one rod
  GuideSeat seat[2];
  double span[2] = {0.5, 0.5};  ///< parts of the lengths of its edges that l has
  SegmentUnknowns unknowns;
};

/// All segments of all tendons, tendon by tendon.
std::vector<TendonSegment> tendon_segments(const Model& model);

/// Minus the forces of a segment's tension, and their derivatives, at q.
void tendon_local(const Model& model, const TendonSegment& segment, double tension, const VectorX& q,
                  const Configuration& c, bool with_matrix, TendonLocal& out);
/// The same over an energy-momentum step; derivatives are by its middle. Rows of frames are moments.
void discrete_tendon_local(const Model& model, const TendonSegment& segment, double tension, const DiscreteStep& step,
                           bool with_matrix, TendonLocal& out);

/// Moment on the part that carries a guide [N m], and the axis in space of the hinge about which it turns.
Vector3 guide_moment(const Model& model, const TendonSegment& segment, int end, double tension, const VectorX& q,
                     const Configuration& c);
Vector3 guide_hinge_axis(const Model& model, const TendonSegment& segment, int end, const Configuration& c);

/// L [m].
double segment_length(const Model& model, const TendonSegment& segment, const VectorX& q, const Configuration& c);
/// Shortening of a segment by the bending of half an edge at a free end, per tension [m/N]. It is
/// r^2 l / (2 EI), the value for an arc of length l / 2 under the moment T r. The elastic energy has no stencil there,
/// so that L does not contain it.
double free_end_compliance(const Model& model, const Parameters& parameters, const TendonSegment& segment);
/// Positions of the guides of a tendon, in the axes of space [m].
MatrixX3 guide_points(const Model& model, int tendon, const VectorX& q, const Configuration& c);

}  // namespace withe
