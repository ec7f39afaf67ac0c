#include "contact/plane_contact.hpp"

#include <algorithm>
#include <cmath>

#include "contact/pressing.hpp"
#include "geometry/vec2.hpp"

namespace withe {
namespace {

using Point = Vec2<double>;
/// A number for each coordinate of a piece's nodes.
using PieceRow = double[kPlaneUnknowns];

Point in_plane(const Vec3d& v) { return {v.x, v.y}; }
Point node(const Touching& t, int i) { return {t.now[3 * i], t.now[3 * i + 1]}; }
Point start_node(const ContactProblem& problem, const ContactPair& pair, int i) {
  const int first = problem.model().node_dof[at(pair.piece.node[i])];
  return {problem.start->q(first), problem.start->q(first + 1)};
}

/// Across and along a plane.
struct Axes {
  Point normal, along;

  explicit Axes(const Obstacle& o) : normal(in_plane(o.other)), along(-turned(normal)) {}
};

/// h_i n at each node.
void set_along_normal(const Point& normal, const double (&h)[3], PieceRow& out) {
  for (int i = 0; i < 3; ++i) {
    out[2 * i] = h[i] * normal.x;
    out[2 * i + 1] = h[i] * normal.y;
  }
}

/// Derivatives of a piece's distance by heights, and of the place s where it touches.
struct HeightSlopes {
  double distance[3], s[3];

  HeightSlopes(const CurveWeights& w, const CurveDistance<double>& d) {
    const double share = d.bend_share(), half = 0.5 * d.s * d.s * share, by_s = d.free ? -1.0 / d.stiff : 0.0;
    for (int i = 0; i < 3; ++i) {
      distance[i] = w.middle[i] + d.s * w.slope[i] + half * w.bend[i];
      s[i] = by_s * (w.slope[i] + d.s * share * w.bend[i]);
    }
  }
};

/// From the gradient by heights at the end of the step to the mean with that at its start, see pressing.cpp.
void add_height_start(const ContactProblem& problem, const Touching& t, const Axes& axes, bool geometric,
                      double (&along)[3], double (*derivative)[3]) {
  const ContactPair& pair = t.pair;
  const CurveDistance<double> start = problem.curve_at_start(pair);
  const Point shift = in_plane(problem.shift_of(pair));
  double way[3] = {};
  for (int i = 0; i < pair.piece.weights->nodes; ++i)
    way[i] = dot(axes.normal, node(t, i) - start_node(problem, pair, i) - shift);
  add_start_direction(HeightSlopes(*pair.piece.weights, start).distance, way, t.proximity.distance - start.distance,
                      geometric, along, derivative);
}

void set_plane_pressing(const ContactProblem& problem, const Touching& t, const Axes& axes, const HeightSlopes& slopes,
                        bool geometric, bool with_hessian, PlaneLocal& out) {
  const CurvePiece& piece = t.pair.piece;
  const CurveDistance<double>& end = t.proximity.curve;
  double along[3], derivative[3][3] = {};
  std::copy(slopes.distance, slopes.distance + 3, along);
  if (with_hessian && geometric) {
    // See add_curve_hessian: d^2 D = -phi ds^2 + (s^2 / 2) phi'' dg2^2.
    const double bent = 0.5 * end.s * end.s * end.bend_change(piece.least_bend);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        derivative[i][j] =
            bent * piece.weights->bend[i] * piece.weights->bend[j] - end.stiff * slopes.s[i] * slopes.s[j];
  }
  if (problem.means_direction())
    add_height_start(problem, t, axes, geometric, along, with_hessian ? derivative : nullptr);
  set_along_normal(axes.normal, along, out.gradient);
  for (double& force : out.gradient) force *= t.pressing.first;
  for (int i = 0; i < 3 && with_hessian; ++i) {
    double heights[3];
    PieceRow row;
    for (int j = 0; j < 3; ++j)
      heights[j] = t.pressing.first * derivative[i][j] + t.pressing.by_end * along[i] * slopes.distance[j];
    set_along_normal(axes.normal, heights, row);
    for (int j = 0; j < kPlaneUnknowns; ++j) {
      out.hessian[2 * i][j] = axes.normal.x * row[j];
      out.hessian[2 * i + 1][j] = axes.normal.y * row[j];
    }
  }
}

/// An edge of a piece, and its rotation.
struct PlaneEdge {
  Point now, start;    ///< [m]
  double inverse;      ///< inverse of its squared length
  double turn;         ///< phi
  double lever;        ///< r m_b [m]
  double lever_slope;  ///< derivative of `lever` by s [m]

  /// Force of a unit moment on the edge at its head; the opposite acts at its tail [1/m].
  Point arm() const { return inverse * turned(now); }
};

/// Slip of such a surface, and the friction on it.
class PlaneSlip {
 public:
  // Called, it would go through memory.
  [[gnu::always_inline]] PlaneSlip(const ContactProblem& problem, const Touching& t, double rate)
      : axes_(problem.bodies.obstacle(t.pair)) {
    const ContactPair& pair = t.pair;
    const CurveWeights& w = *pair.piece.weights;
    const double s = t.proximity.curve.s, radius = problem.description().centreline_friction ? 0.0 : pair.radius_a;
    const Point drift =
        problem.anchored() ? in_plane(problem.shift_of(pair) - t.stick) : in_plane(problem.shift_of(pair));
    double slip = -dot(axes_.along, drift), by_s = 0.0;
    Point last{}, last0{};
    for (int i = 0; i < 3; ++i) {
      weight_[i] = w.at(i, s);
      weight_slope_[i] = w.slope[i] + w.bend[i] * s;
      if (i == w.nodes) {
        edge_[i - 1] = {};
        break;
      }
      const Point x = node(t, i), x0 = start_node(problem, pair, i);
      const double way = dot(axes_.along, x - x0);
      slip += weight_[i] * way;
      by_s += weight_slope_[i] * way;
      if (i > 0) {
        const int b = i - 1;
        const Point now = x - last, start = x0 - last0;
        const double inverse = 1.0 / dot(now, now), turn = inverse * cross(start, now);
        edge_[b] = {now, start, inverse, turn, radius * (w.share[b] + w.share_slope[b] * s), radius * w.share_slope[b]};
        slip += edge_[b].lever * turn;
        by_s += edge_[b].lever_slope * turn;
      }
      last = x;
      last0 = x0;
    }
    slip_ = slip;
    by_s_ = by_s;
    find_force(problem, t, rate);
  }

  const Axes& axes() const { return axes_; }
  double force() const { return force_; }
  double slip() const { return slip_; }
  double limit() const { return limit_; }
  const ForceLaw& law() const { return law_; }
  bool sticking() const { return sticking_; }
  double stick() const { return stick_; }

  /// Derivative of the slip. `s`: derivative of the place where the piece touches.
  void slope(const PieceRow& s, PieceRow& out) const {
    spread(
        weight_, [](const PlaneEdge& e) { return (e.lever * e.inverse) * (turned(e.start) - (2.0 * e.turn) * e.now); },
        out);
    for (int k = 0; k < kPlaneUnknowns; ++k) out[k] += by_s_ * s[k];
  }

  /// Adds its forces on the nodes and, if requested, their derivative.
  void add(const Touching& t, const HeightSlopes& d, const Vec3d* predicted, bool with_hessian, PlaneLocal& out) const {
    PieceRow ways;
    spread(weight_, [](const PlaneEdge& e) { return e.lever * e.arm(); }, ways);
    for (int k = 0; k < kPlaneUnknowns; ++k) out.gradient[k] += force_ * ways[k];
    if (!with_hessian) return;
    PieceRow s, distance, change, ways_by_s;
    set_along_normal(axes_.normal, d.s, s);
    set_along_normal(axes_.normal, d.distance, distance);
    slope(s, change);
    const double dual =
        predicted && law_.factor > 0.0 ? limit_ / law_.factor * dot(axes_.along, in_plane(*predicted)) : slip_;
    const double by_slip = law_.factor + 2.0 * law_.by_square * slip_ * dual,
                 by_distance = -law_.by_pressing * slip_ * t.pressing.by_end;
    for (int k = 0; k < kPlaneUnknowns; ++k) change[k] = by_slip * change[k] + by_distance * distance[k];
    spread(weight_slope_, [](const PlaneEdge& e) { return e.lever_slope * e.arm(); }, ways_by_s);
    for (int k = 0; k < kPlaneUnknowns; ++k) s[k] *= force_;
    for (int i = 0; i < kPlaneUnknowns; ++i)
      for (int j = 0; j < kPlaneUnknowns; ++j) out.hessian[i][j] += ways[i] * change[j] + ways_by_s[i] * s[j];
    for (int b = 0; b < 2; ++b) add_turned_arm(b, out);
  }

 private:
  /// weight_i t at the nodes, and of each edge a vector at its head and minus that at its tail.
  template <class OfEdge>
  void spread(const double (&weight)[3], const OfEdge& of_edge, PieceRow& out) const {
    const Point first = of_edge(edge_[0]), second = of_edge(edge_[1]);
    const Point nodes[3] = {weight[0] * axes_.along - first, weight[1] * axes_.along + first - second,
                            weight[2] * axes_.along + second};
    for (int i = 0; i < 3; ++i) {
      out[2 * i] = nodes[i].x;
      out[2 * i + 1] = nodes[i].y;
    }
  }

  [[gnu::always_inline]] void find_force(const ContactProblem& problem, const Touching& t, double rate) {
    const double mu = t.pair.friction, pressing = -t.pressing.first, slip = slip_;
    limit_ = mu * pressing;
    if (!problem.anchored()) {
      law_ = tanh_law(mu, pressing, slip * slip, rate);
      force_ = law_.factor * slip;
      stick_ = 0.0;
      sticking_ = rate * std::abs(slip) < 7.5;
      return;
    }
    const double stiffness = anchor_stiffness(t.pair, FrictionKind::slipping, t.stiffness),
                 most = std::max(limit_ / stiffness, 0.0);
    sticking_ = holds(slip * slip, most);
    const double inverse = 1.0 / std::abs(slip), factor = limit_ * inverse;
    law_ =
        sticking_ ? ForceLaw{stiffness, 0.0, 0.0} : ForceLaw{factor, -0.5 * factor * inverse * inverse, mu * inverse};
    force_ = law_.factor * slip;
    stick_ = force_ / stiffness;
  }

  /// Action of the moment F r m_b on the ends of a turning edge: derivative of N e / |e|^2 by e.
  void add_turned_arm(int b, PlaneLocal& out) const {
    const double moment = edge_[b].lever * force_;
    const Point arm = edge_[b].arm();
    const double twice = 2.0 * moment * arm.x * arm.y, apart = moment * (arm.x * arm.x - arm.y * arm.y);
    const double own[2][2] = {{-twice, apart}, {apart, twice}};
    const int tail = 2 * b, head = tail + 2;
    for (int r = 0; r < 2; ++r)
      for (int c = 0; c < 2; ++c) {
        out.hessian[tail + r][tail + c] += own[r][c];
        out.hessian[tail + r][head + c] -= own[r][c];
        out.hessian[head + r][tail + c] -= own[r][c];
        out.hessian[head + r][head + c] += own[r][c];
      }
  }

  Axes axes_;
  double weight_[3], weight_slope_[3];
  PlaneEdge edge_[2];  ///< zero if there is no edge
  double slip_, by_s_, limit_, force_, stick_;
  bool sticking_;
  ForceLaw law_;
};

}  // namespace

bool beside_plane(const ContactProblem& problem, const Touching& t) {
  if (!t.pair.curve() || !problem.model().planar() || t.lagged >= 0) return false;
  return problem.bodies.flat(t.pair) && t.pair.isotropic() && t.pair.rolling == 0.0 && problem.turn.empty();
}

void plane_contact(const ContactProblem& problem, const Touching& t, PlaneForces which,
                   const ContactLinearisation& linearisation, bool with_hessian, PlaneLocal& out) {
  const HeightSlopes slopes(*t.pair.piece.weights, t.proximity.curve);
  if (which != PlaneForces::friction)
    set_plane_pressing(problem, t, Axes(problem.bodies.obstacle(t.pair)), slopes, linearisation.geometric, with_hessian,
                       out);
  else
    out = {};
  if (which == PlaneForces::pressing || !rubs(problem, t)) return;
  const PlaneSlip slip(problem, t, slip_rate(problem, linearisation.regularisation));
  slip.add(t, slopes, with_hessian ? linearisation.friction.of(t.pair.key) : nullptr, with_hessian, out);
}

void add_plane_contact(const ContactProblem& problem, const Touching& t, PlaneForces which,
                       const ContactLinearisation& linearisation, bool with_hessian, ContactLocal& out) {
  PlaneLocal local;
  plane_contact(problem, t, which, linearisation, with_hessian, local);
  const auto place = [](int k) { return 3 * (k / 2) + k % 2; };
  for (int i = 0; i < kPlaneUnknowns; ++i) {
    out.gradient[place(i)] += local.gradient[i];
    for (int j = 0; j < kPlaneUnknowns && with_hessian; ++j) out.hessian[place(i)][place(j)] += local.hessian[i][j];
  }
}

FrictionForce<double> plane_friction(const ContactProblem& problem, const Touching& t, double rate) {
  const PlaneSlip slip(problem, t, rate);
  const Vec3d along{slip.axes().along.x, slip.axes().along.y, 0.0};
  return {slip.force() * along, slip.stick() * along, slip.sticking()};
}

Slipping plane_slipping(const ContactProblem& problem, const Touching& t, double rate, const VectorX& change) {
  const PlaneSlip slip(problem, t, rate);
  const Vec3d along{slip.axes().along.x, slip.axes().along.y, 0.0};
  PieceRow s, slope;
  set_along_normal(slip.axes().normal, HeightSlopes(*t.pair.piece.weights, t.proximity.curve).s, s);
  slip.slope(s, slope);
  double moved = 0.0;
  for (int i = 0; i < t.pair.piece.weights->nodes; ++i) {
    const Vec3d by = local_position(problem.model(), change, t.pair.piece.node[i]);
    moved += slope[2 * i] * by.x + slope[2 * i + 1] * by.y;
  }
  return {slip.slip() * along, moved * along, slip.law(), slip.limit()};
}

}  // namespace withe
