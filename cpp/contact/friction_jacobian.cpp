#include "contact/friction_jacobian.hpp"

#include <cmath>

#include "contact/friction_curve.hpp"

namespace withe {
namespace {

// Ways in which a contact moves: dp, du, dv (3 each), both angles.
constexpr int kEdge[2] = {3, 6}, kAngle[2] = {9, 10}, kWays = 11;

/// Derivatives by them.
struct Slopes {
  double s[kWays] = {}, t[kWays] = {}, pressing[kWays] = {};
  Vec3d between[kWays] = {};
  Vec3d lever[kWays] = {};  ///< c
  Vec3d turn[kWays] = {};   ///< omega
  Vec3d force[kWays];
  Vec3d moment[kWays];  ///< m
};

/// Point of contact and normal force: derivatives by all but the angles.
void add_contact_slopes(const FrictionSetting& f, const SlippingSurfaces<double>& c, Slopes& d) {
  const ContactPair& pair = *f.pair;
  const Vec3d &u = c.sides[0].edge, &v = c.sides[1].edge;
  double K[2][2];
  parameter_inverse(f.points.s_free, f.points.t_free, u, v, pair.weight_a, pair.weight_b, K);
  const Vec3d a = K[0][1] * v - K[0][0] * u, b = K[1][1] * v - K[1][0] * u;
  for (int k = 0; k < 3; ++k) {
    const double across = c.between[k];
    d.pressing[k] = -c.law.by_end / c.distance * across;
    d.s[k] = a[k];
    d.t[k] = b[k];
    d.between[k] = kUnitVectors[k] + d.s[k] * u - d.t[k] * v;
    d.s[kEdge[0] + k] = -K[0][0] * across;
    d.t[kEdge[0] + k] = -K[1][0] * across;
    d.between[kEdge[0] + k] = across * a;
    if (pair.rod_b < 0) continue;
    d.s[kEdge[1] + k] = K[0][1] * across;
    d.t[kEdge[1] + k] = K[1][1] * across;
    d.between[kEdge[1] + k] = -across * b;
  }
}

/// Derivatives of a turning edge by its vector at the end.
double edge_share(const FrictionSetting& f) { return f.middle ? 0.5 : 1.0; }

/// Rotations and spins of edges, and their levers.
void add_turn_slopes(const FrictionSetting& f, const SlippingSurfaces<double>& c, Slopes& d) {
  for (int j = 0; j < kWays; ++j) {
    const Vec3d& moved = d.between[j];
    d.lever[j] = f.pair->rod_b < 0 ? c.inverse * (moved - dot(c.normal, moved) * c.normal) : moved;
    if (!f.middle) continue;
    const Vec3d way = d.s[j] * c.sides[0].change - d.t[j] * c.sides[1].change;
    d.lever[j] -= 0.5 * (j < 3 ? kUnitVectors[j] + way : way);
  }
  const double share = edge_share(f);
  for (int b = 0; b < c.bodies; ++b) {
    const SlippingEdge<double>& side = c.sides[b];
    const double rho = arm_length(*f.pair, b), inverse = side.inverse, angle = dot(side.turn, side.tangent);
    const Vec3d start = side.edge - side.change, bend = side.turn - angle * side.tangent;
    for (int k = 0; k < 3; ++k) {
      const double along = side.tangent[k];
      d.turn[kEdge[b] + k] = (rho * inverse) * (inverse * cross(start, kUnitVectors[k]) - (2.0 * share * along) * bend +
                                                (share * angle) * (kUnitVectors[k] - along * side.tangent));
    }
    if (!f.spatial) continue;
    const WorkingTurnSlopes spun = f.finite_turns ? working_turn_slopes(side) : WorkingTurnSlopes{};
    d.turn[kAngle[b]] = (rho * spun.angle) * side.tangent;
    for (int k = 0; k < 3; ++k) d.turn[kEdge[b] + k] += (rho * spun.edge[k]) * side.tangent;
  }
}

/// omega
Vec3d turn_of(const FrictionSetting& f, const SlippingSurfaces<double>& c) {
  Vec3d turn{};
  for (int b = 0; b < c.bodies; ++b) turn += arm_length(*f.pair, b) * c.sides[b].turn;
  return turn;
}

/// Derivatives of `obstacle_arm`.
Vec3d obstacle_arm_slope(const FrictionSetting& f, const SlippingSurfaces<double>& c, const Slopes& d, int j) {
  if (f.rolling) return -f.pair->radius_a * d.lever[j];
  return d.t[j] * c.sides[1].edge + f.pair->radius_b * d.lever[j];
}

/// Converts the force of the greatest coefficient to that of `direct_friction`; an obstacle's normal turns by `lever`.
void direct_slopes(const FrictionSetting& f, const SlippingSurfaces<double>& c, Slopes& d) {
  const double share = dot(c.along, c.plain), across = f.pair->across, more = f.pair->along(share) - across;
  const Vec3d &e = c.sides[0].edge, &n = c.normal;
  const double inverse = 1.0 / std::sqrt(dot(e, e));
  const Vec3d t = inverse * e;
  for (int j = 0; j < kWays; ++j) {
    const int k = j - kEdge[0];
    const Vec3d turned = k >= 0 && k < 3 ? inverse * (kUnitVectors[k] - t[k] * t) : Vec3d{};
    const Vec3d& leant = d.lever[j];
    const Vec3d along = turned - (dot(turned, n) + dot(t, leant)) * n - dot(t, n) * leant;
    d.force[j] = across * d.force[j] + (more * (dot(along, c.plain) + dot(c.along, d.force[j]))) * c.along +
                 (more * share) * along;
  }
}

/// The slip, with the part along the normal that it loses as that turns, and the force on it.
void add_force_slopes(const FrictionSetting& f, const SlippingSurfaces<double>& c, Slopes& d) {
  const Vec3d &n = c.normal, &lever = c.lever, turn = turn_of(f, c);
  const Vec3d way = whole_way(f, c);
  const double off = dot(way, n);
  const Vec3d slip = way - off * n;
  const ForceLaw g = force_law(f, c.pressing, dot(slip, slip), c.friction.sticking);
  const Vec3d dual = g.dual_slip(slip, f.predicted, f.friction * c.pressing);
  const Vec3d change_a = c.sides[0].change, change_b = f.pair->rod_b < 0 ? Vec3d{} : c.sides[1].change;
  for (int j = 0; j < kWays; ++j) {
    const Vec3d across = c.inverse * d.between[j];
    Vec3d moved = cross(lever, d.turn[j]) - cross(turn, d.lever[j]);
    if (!f.rolling) moved += d.s[j] * change_a - d.t[j] * change_b;
    if (!f.rolling && j < 3) moved += kUnitVectors[j];
    if (dot(f.turn, f.turn) > 0.0) moved -= cross(f.turn, obstacle_arm_slope(f, c, d, j));
    moved -= off * across;
    d.force[j] = g.factor * moved - (g.factor * (dot(n, moved) + dot(slip, across))) * n +
                 (2.0 * g.by_square * dot(slip, moved)) * dual + (g.by_pressing * d.pressing[j]) * slip;
  }
}

/// Force of the moment m on an edge, rho (m x t / |e| + (t . m) spin) and rho t . m, by its ways.
void add_couple_slopes(const FrictionSetting& f, const SlippingEdge<double>& side, int b, const Vec3d& m,
                       const Vec3d (&moment)[kWays], Vec3d (&couple)[kWays], double (&axial)[kWays]) {
  const Vec3d& t = side.tangent;
  const double rho = arm_length(*f.pair, b), inverse = side.inverse, along = dot(t, m);
  for (int j = 0; j < kWays; ++j) {
    axial[j] = rho * dot(t, moment[j]);
    couple[j] += (rho * inverse) * cross(moment[j], t) + axial[j] * side.spin;
  }
  // With p the tangent that frames are transported from, spin = -p x t / (|e| (1 + p . t)), and
  // dspin = -(p x de / |e| + spin ((2 + p . t) t + p) . de) / (|e| (1 + p . t)).
  const Vec3d& source = f.source[b];
  const double facing = dot(source, t), share = inverse / (1.0 + facing), moved = edge_share(f);
  const Vec3d bend = inverse * cross(m, t), mean = (2.0 + facing) * t + source;
  for (int k = 0; k < 3; ++k) {
    const double by = moved * rho, lean = inverse * (m[k] - along * t[k]);
    Vec3d& own = couple[kEdge[b] + k];
    own += (by * inverse) * (inverse * cross(m, kUnitVectors[k]) - (2.0 * t[k]) * bend);
    if (!f.spatial) continue;
    axial[kEdge[b] + k] += by * lean;
    own += (by * (lean - along * share * mean[k])) * side.spin -
           (by * along * share * inverse) * cross(source, kUnitVectors[k]);
  }
}

using Row = double[kContactUnknowns];

/// From ways to unknowns: dp = sum_i w_i dx_i, du = da1 - da0, dv = db1 - db0.
template <class Way>
void spread(const double (&w)[4], const Way& way, Row& row) {
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 3; ++k) {
      const double edge = way(kEdge[i / 2] + k);
      row[3 * i + k] = w[i] * way(k) + (i % 2 == 0 ? -edge : edge);
    }
  for (int b = 0; b < 2; ++b) row[12 + b] = way(kAngle[b]);
}

/// Forces on the ends of edge b, and on its angle.
void add_rows(const FrictionSetting& f, const SlippingSurfaces<double>& c, int b, const Vec3d& m, const Slopes& d,
              double (&jacobian)[kContactUnknowns][kContactUnknowns]) {
  Vec3d couple[kWays] = {};
  double axial[kWays] = {};
  // w_i F with s and t that give way, too
  for (int j = 0; j < kWays && !f.rolling; ++j) couple[j] = (b == 0 ? d.s[j] : -d.t[j]) * c.friction.force;
  if (b < c.bodies) add_couple_slopes(f, c.sides[b], b, m, d.moment, couple, axial);
  const double of_tail = f.rolling ? 0.0 : c.w[2 * b], of_head = f.rolling ? 0.0 : c.w[2 * b + 1];
  Row forces, couples;
  for (int k = 0; k < 3; ++k) {
    spread(c.w, [&](int j) { return d.force[j][k]; }, forces);
    spread(c.w, [&](int j) { return couple[j][k]; }, couples);
    Row &tail = jacobian[6 * b + k], &head = jacobian[6 * b + 3 + k];
    for (int j = 0; j < kContactUnknowns; ++j) {
      tail[j] += of_tail * forces[j] - couples[j];
      head[j] += of_head * forces[j] + couples[j];
    }
  }
  if (b >= c.bodies || !f.spatial) return;
  spread(c.w, [&](int j) { return axial[j]; }, couples);
  for (int j = 0; j < kContactUnknowns; ++j) jacobian[12 + b][j] += couples[j];
}

}  // namespace

void add_face_friction_jacobian(const FrictionSetting& f, const double (&unknown)[kContactUnknowns],
                                double (&jacobian)[kContactUnknowns][kContactUnknowns]) {
  using ByUnknown = Dual<kContactUnknowns>;
  ByUnknown x[kContactUnknowns], gradient[kContactUnknowns];
  for (int i = 0; i < kContactUnknowns; ++i) x[i] = ByUnknown::unknown(unknown[i], i);
  friction_gradient(f, x, gradient);
  for (int i = 0; i < kContactUnknowns; ++i)
    for (int j = 0; j < kContactUnknowns; ++j) jacobian[i][j] += gradient[i].slope[j];
}

void add_friction_jacobian(const FrictionSetting& f, const SlippingSurfaces<double>& c,
                           double (&jacobian)[kContactUnknowns][kContactUnknowns]) {
  if (f.pair->curve()) {
    add_curve_friction_jacobian(f, c, jacobian);
    return;
  }
  const bool obstacle = f.pair->rod_b < 0;
  const Vec3d &force = c.friction.force, &lever = c.lever;
  Slopes d;
  add_contact_slopes(f, c, d);
  add_turn_slopes(f, c, d);
  add_force_slopes(f, c, d);
  if (!f.isotropic) direct_slopes(f, c, d);
  for (int j = 0; j < kWays; ++j) d.moment[j] = cross(d.force[j], lever) + cross(force, d.lever[j]);
  for (int b = 0; b < (obstacle ? 1 : 2); ++b) add_rows(f, c, b, cross(force, lever), d, jacobian);
}

}  // namespace withe
