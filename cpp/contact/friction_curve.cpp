#include "contact/friction_curve.hpp"

#include <cmath>

namespace withe {
namespace {

// Unknowns that move a contact: three nodes, and both angles.
constexpr int kCurveAngle = 9, kCurveWays = 11;

int unknown_of(int way) { return way < kCurveAngle ? way : way + 3; }

/// Derivatives by them.
struct CurvedSlopes {
  double s[kCurveWays] = {}, pressing[kCurveWays] = {};
  Vec3d normal[kCurveWays] = {}, turn[kCurveWays] = {};  ///< n, omega
  Vec3d force[kCurveWays], moment[kCurveWays];           ///< F, F x n
};

struct Curve {
  const CurveWeights& w;
  double s, weight[3], weight_slope[3];  ///< w_i, w_i'
  double lever[2] = {};                  ///< r m_b
  int ways[kCurveWays], count = 0;       ///< indices of existing unknowns: in a plane two per node

  /// Calls see(j) for each unknown, without `angles` for those of nodes only.
  template <class See>
  void each_way(bool angles, const See& see) const {
    for (int i = 0; i < count; ++i)
      if (angles || ways[i] < kCurveAngle) see(ways[i]);
  }
};

Curve curve_of(const FrictionSetting& f, const SlippingSurfaces<double>& c) {
  Curve out{.w = *f.pair->piece.weights, .s = c.s, .weight = {}, .weight_slope = {}, .ways = {}};
  for (int j = 0; j < kCurveWays; ++j)
    if (f.spatial || (j < 3 * out.w.nodes && j % 3 < 2)) out.ways[out.count++] = j;
  for (int i = 0; i < 3; ++i) {
    out.weight[i] = out.w.at(i, c.s);
    out.weight_slope[i] = out.w.slope[i] + out.w.bend[i] * c.s;
  }
  for (int b = 0; b < c.bodies; ++b) out.lever[b] = f.pair->radius_a * (out.w.share[b] + out.w.share_slope[b] * c.s);
  return out;
}

/// Point of contact, normal force, and normal.
void add_contact_slopes(const FrictionSetting& f, const SlippingSurfaces<double>& c, const Curve& curve,
                        const Vec3d (&x)[3], CurvedSlopes& d) {
  const Vec3d nodes[4] = {x[0], x[1], x[2], {}};
  const CurveDistance<double> distance = distance_of(f, nodes);
  const CurveSlopes slopes = curve_slopes(f.pair->piece, distance);
  const PointDistance<double> point = distance_to(*f.obstacle, curve_point(curve.w, x, c.s));
  const NormalChange change(*f.obstacle, point);
  const Vec3d tangent = curve_direction(curve.w, x, c.s);
  curve.each_way(false, [&](int j) {
    d.s[j] = slopes.s[j];
    d.pressing[j] = -c.law.by_end * slopes.distance[j];
    d.normal[j] = change.of_direction(curve.weight[j / 3] * kUnitVectors[j % 3] + d.s[j] * tangent);
  });
}

void add_turn_slopes(const FrictionSetting& f, const SlippingSurfaces<double>& c, const Curve& curve, CurvedSlopes& d) {
  for (int b = 0; b < c.bodies; ++b) {
    const SlippingEdge<double>& side = c.sides[b];
    const double rho = curve.lever[b], inverse = side.inverse, angle = dot(side.turn, side.tangent);
    const Vec3d start = side.edge - side.change, bend = side.turn - angle * side.tangent;
    for (int k = 0; k < 3; ++k) {
      const double along = side.tangent[k];
      const Vec3d turned = (rho * inverse) * (inverse * cross(start, kUnitVectors[k]) - (2.0 * along) * bend +
                                              angle * (kUnitVectors[k] - along * side.tangent));
      d.turn[3 * side.tail + 3 + k] += turned;
      d.turn[3 * side.tail + k] -= turned;
    }
    if (f.spatial) {
      const WorkingTurnSlopes spun = f.finite_turns ? working_turn_slopes(side) : WorkingTurnSlopes{};
      d.turn[kCurveAngle + b] = (rho * spun.angle) * side.tangent;
      for (int k = 0; k < 3; ++k) {
        const Vec3d turned = (rho * spun.edge[k]) * side.tangent;
        d.turn[3 * side.tail + 3 + k] += turned;
        d.turn[3 * side.tail + k] -= turned;
      }
    }
    const double grown = f.pair->radius_a * curve.w.share_slope[b];
    curve.each_way(false, [&](int j) { d.turn[j] += (grown * d.s[j]) * side.turn; });
  }
}

/// Derivatives of `obstacle_arm`: of a - (delta - r) n with a = c(s), da - (n . da) n - (delta - r) dn.
Vec3d obstacle_arm_slope(const FrictionSetting& f, const Curve& curve, const Vec3d (&x)[3],
                         const PointDistance<double>& point, const CurvedSlopes& d, int j) {
  if (f.rolling) return -f.pair->radius_a * d.normal[j];
  Vec3d moved = d.s[j] * curve_direction(curve.w, x, curve.s);
  if (j < kCurveAngle) moved += curve.weight[j / 3] * kUnitVectors[j % 3];
  return moved - dot(point.normal, moved) * direction_of(*f.obstacle, point) -
         (point.distance - f.pair->radius_b) * d.normal[j];
}

void add_force_slopes(const FrictionSetting& f, const SlippingSurfaces<double>& c, const Curve& curve,
                      const Vec3d (&x)[3], CurvedSlopes& d) {
  const Vec3d &n = c.normal, way = whole_way(f, c);
  const double off = dot(way, n);
  const Vec3d slip = way - off * n;
  const ForceLaw g = force_law(f, c.pressing, dot(slip, slip), c.friction.sticking);
  const Vec3d dual = g.dual_slip(slip, f.predicted, f.friction * c.pressing);
  const bool turns = dot(f.turn, f.turn) > 0.0;
  const PointDistance<double> point =
      turns ? distance_to(*f.obstacle, curve_point(curve.w, x, curve.s)) : PointDistance<double>{};
  Vec3d turn{}, moved_on{};
  for (int b = 0; b < c.bodies; ++b) turn += curve.lever[b] * c.sides[b].turn;
  for (int i = 0; i < curve.w.nodes; ++i)
    moved_on += curve.weight_slope[i] * (x[i] - Vec3d{f.start[3 * i], f.start[3 * i + 1], f.start[3 * i + 2]});
  curve.each_way(true, [&](int j) {
    const Vec3d& across = d.normal[j];
    Vec3d moved = cross(n, d.turn[j]) - cross(turn, across);
    if (!f.rolling) moved += d.s[j] * moved_on;
    if (!f.rolling && j < kCurveAngle) moved += curve.weight[j / 3] * kUnitVectors[j % 3];
    if (turns) moved -= cross(f.turn, obstacle_arm_slope(f, curve, x, point, d, j));
    d.force[j] = g.factor * (moved - off * across) - (g.factor * (dot(n, moved) + dot(slip, across))) * n +
                 (2.0 * g.by_square * dot(slip, moved - off * across)) * dual + (g.by_pressing * d.pressing[j]) * slip;
  });
}

/// Converts the force of the greatest coefficient to that of `direct_friction`.
void direct_slopes(const FrictionSetting& f, const SlippingSurfaces<double>& c, const Curve& curve, const Vec3d (&x)[3],
                   CurvedSlopes& d) {
  const double share = dot(c.along, c.plain), across = f.pair->across, more = f.pair->along(share) - across;
  const Vec3d e = rod_direction(f, c), &n = c.normal;
  const double inverse = 1.0 / std::sqrt(dot(e, e));
  const Vec3d t = inverse * e;
  const bool edge = curve.w.edges == 1;  // the direction is that of its edge
  const double of_edge[3] = {-1.0, 1.0, 0.0};
  Vec3d bend{};
  for (int i = 0; i < curve.w.nodes; ++i) bend += curve.w.bend[i] * x[i];
  curve.each_way(true, [&](int j) {
    Vec3d change = d.s[j] * bend;
    if (j < kCurveAngle) change += (edge ? of_edge : curve.weight_slope)[j / 3] * kUnitVectors[j % 3];
    const Vec3d turned = inverse * (change - dot(t, change) * t), &leant = d.normal[j];
    const Vec3d along = turned - (dot(turned, n) + dot(t, leant)) * n - dot(t, n) * leant;
    d.force[j] = across * d.force[j] + (more * (dot(along, c.plain) + dot(c.along, d.force[j]))) * c.along +
                 (more * share) * along;
  });
}

/// Force of the moment m = F x n on an edge, r m_b (m x t / |e| + (t . m) spin), and to its angle.
void add_couples(const FrictionSetting& f, const SlippingSurfaces<double>& c, const Curve& curve, int b,
                 const CurvedSlopes& d, double (&jacobian)[kContactUnknowns][kContactUnknowns]) {
  const SlippingEdge<double>& side = c.sides[b];
  const Vec3d &t = side.tangent, m = cross(c.friction.force, c.normal);
  const double rho = curve.lever[b], inverse = side.inverse, along = dot(t, m);
  const double grown = f.pair->radius_a * curve.w.share_slope[b];
  Vec3d couple[kCurveWays] = {};
  double axial[kCurveWays] = {};
  curve.each_way(true, [&](int j) {
    const Vec3d moment = rho * d.moment[j] + (grown * d.s[j]) * m;
    axial[j] = f.spatial ? dot(t, moment) : 0.0;
    couple[j] = inverse * cross(moment, t) + axial[j] * side.spin;
  });
  // By the edge itself; see add_couple_slopes of friction_jacobian.cpp.
  const Vec3d& source = f.source[b];
  const double facing = f.spatial ? dot(source, t) : 0.0, share = inverse / (1.0 + facing);
  const Vec3d bend = inverse * cross(m, t), mean = (2.0 + facing) * t + source;
  for (int k = 0; k < 3; ++k) {
    Vec3d own = (rho * inverse) * (inverse * cross(m, kUnitVectors[k]) - (2.0 * t[k]) * bend);
    const double lean = inverse * (m[k] - along * t[k]);
    if (f.spatial)
      own += (rho * (lean - along * share * mean[k])) * side.spin -
             (rho * along * share * inverse) * cross(source, kUnitVectors[k]);
    const int head = 3 * side.tail + 3 + k, tail = 3 * side.tail + k;
    couple[head] += own;
    couple[tail] -= own;
    if (!f.spatial) continue;
    axial[head] += rho * lean;
    axial[tail] -= rho * lean;
  }
  curve.each_way(true, [&](int j) {
    for (int k = 0; k < 3; ++k) {
      jacobian[3 * side.tail + 3 + k][unknown_of(j)] += couple[j][k];
      jacobian[3 * side.tail + k][unknown_of(j)] -= couple[j][k];
    }
    if (f.spatial) jacobian[12 + b][unknown_of(j)] += axial[j];
  });
}

}  // namespace

void add_curve_friction_jacobian(const FrictionSetting& f, const SlippingSurfaces<double>& c,
                                 double (&jacobian)[kContactUnknowns][kContactUnknowns]) {
  const Vec3d x[3] = {c.node[0], c.node[1], c.node[2]};
  const Curve curve = curve_of(f, c);
  CurvedSlopes d;
  add_contact_slopes(f, c, curve, x, d);
  add_turn_slopes(f, c, curve, d);
  add_force_slopes(f, c, curve, x, d);
  if (!f.isotropic) direct_slopes(f, c, curve, x, d);
  curve.each_way(true,
                 [&](int j) { d.moment[j] = cross(d.force[j], c.normal) + cross(c.friction.force, d.normal[j]); });
  for (int i = 0; i < curve.w.nodes && !f.rolling; ++i)
    curve.each_way(true, [&](int j) {
      const Vec3d force = curve.weight[i] * d.force[j] + (curve.weight_slope[i] * d.s[j]) * c.friction.force;
      for (int k = 0; k < 3; ++k) jacobian[3 * i + k][unknown_of(j)] += force[k];
    });
  for (int b = 0; b < c.bodies; ++b) add_couples(f, c, curve, b, d, jacobian);
}

}  // namespace withe
