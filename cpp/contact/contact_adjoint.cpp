#include "contact/contact_adjoint.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "contact/contact_friction.hpp"
#include "contact/contact_set.hpp"
#include "contact/impacts.hpp"
#include "contact/mean_points.hpp"
#include "contact/pressing.hpp"

namespace withe {
namespace {

using ByStart = Dual<kContactUnknowns>;
using Rows = double[kContactUnknowns];

Vec3<ByStart> lifted(const Vec3d& v) { return {ByStart(v.x), ByStart(v.y), ByStart(v.z)}; }

int tail_of(const ContactPair& pair, int side) { return pair.curve() ? side : 2 * side; }

Vec3d point_of(const Rows& values, int i) { return {values[3 * i], values[3 * i + 1], values[3 * i + 2]}; }

/// Derivatives of the distance at the start, `Touching::before` where it does not go by the end.
void set_distance_slopes(const ContactProblem& problem, const ContactPair& pair, double (&slopes)[12]) {
  std::fill(std::begin(slopes), std::end(slopes), 0.0);
  Vec3d x[4];
  if (pair.curve()) {
    const CurveSlopes of_curve = curve_slopes(pair.piece, problem.curve_at_start(pair));
    std::copy(std::begin(of_curve.distance), std::end(of_curve.distance), slopes);
    return;
  }
  const ClosestPoints c = problem.closest_at_start(pair, x);
  double w[4];
  end_weights(c.s, c.t, w);
  for (int i = 0; i < 12; ++i) slopes[i] = w[i / 3] * c.between[i % 3] / std::sqrt(c.square);
}

/// The start with its derivatives by itself, tangents among them.
SlipStart<ByStart> start_of(const FrictionSetting& f) {
  SlipStart<ByStart> start(f);
  for (int i = 0; i < kContactUnknowns; ++i) start.unknown[i].slope[i] = 1.0;
  const int edges = f.pair->curve() ? f.pair->piece.weights->edges : f.pair->rod_b < 0 ? 1 : 2;
  for (int b = 0; b < edges && f.spatial; ++b) {
    const int tail = tail_of(*f.pair, b);
    const Vec3<ByStart> e = start.point(tail + 1) - start.point(tail);
    start.source[b] = (1.0 / sqrt(dot(e, e))) * e;
  }
  return start;
}

/// By the slip tolerance nu, of a scalar that is proportional to tanh(c |S|) / |S|, c = K / (2 dt) ~ 1 / nu.
double by_tolerance(double scalar, double square, double rate, double tolerance) {
  const double share = std::tanh(rate * std::sqrt(square));
  return -scalar * (1.0 - share * share) / slip_factor(square, rate) * rate / tolerance;
}

/// Derivatives of friction by its force at the end of the step.
void add_implicit_friction(const ContactProblem& problem, const Touching& t, FrictionKind kind, const Rows& rows,
                           ContactAdjoint& out) {
  const FrictionSetting f = friction_setting(problem, t, kind, 1.0, nullptr);
  ByStart now[kContactUnknowns], gradient[kContactUnknowns];
  for (int i = 0; i < kContactUnknowns; ++i) now[i] = t.now[i];
  SlipStart<ByStart> start = start_of(f);
  if (t.law.elastic > 0.0) {
    double slopes[12];
    set_distance_slopes(problem, t.pair, slopes);
    std::copy(std::begin(slopes), std::end(slopes), start.before.slope);
  }
  const SlippingSurfaces<ByStart> c = slipping_surfaces(f, start, now);
  add_friction_gradient(f, c, gradient);
  ByStart scalar;
  for (int i = 0; i < kContactUnknowns; ++i) scalar += rows[i] * gradient[i];
  for (int i = 0; i < kContactUnknowns; ++i) out.start[i] += scalar.slope[i];
  const double off = dot(c.way, c.normal).value, square = std::max(dot(c.way, c.way).value - off * off, 0.0);
  out.slip_tolerance += by_tolerance(scalar.value, square, f.rate, problem.parameters->slip_tolerance);
  if (kind == FrictionKind::rolling) {
    out.rolling += scalar.value / f.friction;
    return;
  }
  // Friction is linear in its coefficients.
  for (int k = 0; k < 3; ++k) {
    ContactPair pair = t.pair;
    pair.set_friction(k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0);
    FrictionSetting unit = f;
    unit.pair = &pair;
    unit.friction = pair.friction;
    unit.isotropic = pair.isotropic();
    double force[kContactUnknowns] = {};
    friction_gradient(unit, t.now, force);
    for (int i = 0; i < kContactUnknowns; ++i) out.friction[k] += rows[i] * force[i];
  }
}

/// J times a way of the unknowns, J of surfaces that touch at the start: see `set_slip` of lagged_friction.cpp.
Vec3<ByStart> start_slip(const FrictionSetting& f, const SlippingSurfaces<ByStart>& c,
                         const ByStart (&way)[kContactUnknowns]) {
  const ContactPair& pair = *f.pair;
  const auto point = [&](int i) { return Vec3<ByStart>{way[3 * i], way[3 * i + 1], way[3 * i + 2]}; };
  Vec3<ByStart> slip{};
  for (int i = 0; i < 4; ++i) slip += c.w[i] * point(i);
  const int bodies = f.centreline ? 0 : pair.curve() ? pair.piece.weights->edges : pair.rod_b < 0 ? 1 : 2;
  for (int b = 0; b < bodies; ++b) {
    const int tail = tail_of(pair, b);
    const Vec3<ByStart>& edge = c.sides[b].edge;
    const ByStart inverse = 1.0 / sqrt(dot(edge, edge));
    const Vec3<ByStart> tangent = inverse * edge,
                        arm = pair.curve() ? piece_arm(pair, b, c.s, c.normal)
                                           : contact_arm(pair, b, pair.rod_b < 0 ? c.normal : c.between, c.whole);
    Vec3<ByStart> turn = inverse * cross(tangent, point(tail + 1) - point(tail));
    if (f.spatial) turn += way[12 + b] * tangent;
    slip += turn_sign(f, b) * cross(turn, arm);
  }
  return slip - dot(slip, c.normal) * c.normal;
}

/// F(S) . J rows, S = J (q1 - q0) and N at the start.
void add_lagged_friction(const ContactProblem& problem, const Touching& t, const Rows& rows, ContactAdjoint& out) {
  if (problem.description().friction_law == FrictionLaw::semi_explicit)
    throw std::invalid_argument(
        "no gradient is available with semi-explicit friction: use "
        "friction_model='lagged'");
  if (dot(problem.turn_of(t.pair), problem.turn_of(t.pair)) > 0.0)
    throw std::invalid_argument(
        "no gradient is available with lagged friction on an obstacle that turns: use "
        "friction_model='implicit'");
  const FrictionSetting f = friction_setting(problem, t, FrictionKind::slipping, 1.0, nullptr);
  const SlipStart<ByStart> start = start_of(f);
  SlippingSurfaces<ByStart> c;
  Vec3<ByStart> x[4];
  // The obstacle has its position at the end: rods have the same relative position as before its motion.
  const Vec3<ByStart> shift = lifted(problem.shift_of(t.pair));
  for (int i = 0; i < 4; ++i) x[i] = t.pair.curve() || i < 2 ? start.point(i) + shift : start.point(i);
  for (int b = 0; b < 2; ++b) c.sides[b].edge = x[tail_of(t.pair, b) + 1] - x[tail_of(t.pair, b)];
  find_contact(f, start, x, c);
  ByStart moved[kContactUnknowns], multiplied[kContactUnknowns];
  for (int i = 0; i < kContactUnknowns; ++i) {
    moved[i] = t.now[i] - start.unknown[i];
    if (i >= 12 && f.finite_turns) moved[i] = finite_turn(moved[i]);
    multiplied[i] = rows[i];
  }
  const Vec3<ByStart> slip = start_slip(f, c, moved) - (shift - dot(shift, c.normal) * c.normal);
  const ByStart square = dot(slip, slip),
                share = c.pressing * slip_factor(square, f.rate) * dot(slip, start_slip(f, c, multiplied)),
                scalar = t.pair.friction * share;
  for (int i = 0; i < kContactUnknowns; ++i) out.start[i] += scalar.slope[i];
  out.slip_tolerance += by_tolerance(scalar.value, square.value, f.rate, problem.parameters->slip_tolerance);
  out.friction[0] += share.value;  // directions count the same
}

/// Derivatives of `set_mean_pressing` in pressing.cpp.
void add_mean_pressing(const ContactProblem& problem, const Touching& t, const Rows& rows, ContactAdjoint& out) {
  Vec3d start[4], end[4];
  const ClosestPoints first = problem.closest_at_start(t.pair, start);
  t.end_points(end);
  Vec3<ByStart> x0[4], x1[4];
  for (int i = 0; i < 4; ++i) {
    x0[i] = {ByStart::unknown(start[i].x, 3 * i), ByStart::unknown(start[i].y, 3 * i + 1),
             ByStart::unknown(start[i].z, 3 * i + 2)};
    x1[i] = lifted(end[i]);
  }
  const MeanPoints<ByStart> mean = mean_points(t.pair, first, t.proximity.points, x0, x1);
  ByStart along;
  for (int i = 0; i < 4; ++i) along += mean.weight[i] * dot(lifted(point_of(rows, i)), mean.ways);
  const ByStart scalar = chain(mean.start, t.pressing.first, t.pressing.by_start) / (mean.start + mean.end) * along;
  for (int i = 0; i < 12; ++i) out.start[i] += scalar.slope[i];
}

/// Derivatives of `add_curve_pressing`, f (g1 + b (g0 - g1)), see `StartShare`.
void add_curve_pressing(const ContactProblem& problem, const Touching& t, const Rows& rows, ContactAdjoint& out) {
  const CurvePiece& piece = t.pair.piece;
  Vec3d x0[4];
  problem.bodies.end_points(t.pair, problem.start->q, x0);
  const CurveDistance<double> start = problem.curve_at_start(t.pair);
  const CurveSlopes first = curve_slopes(piece, start), last = curve_slopes(piece, t.proximity.curve);
  const double (&g0)[9] = first.distance, (&g1)[9] = last.distance;
  double H[9][9] = {}, way[9] = {}, y0 = 0.0, y1 = 0.0;
  add_curve_hessian(piece, problem.bodies.obstacle(t.pair), start, first, 1.0, 9, &H[0][0]);
  for (int i = 0; i < 3 * piece.weights->nodes; ++i) {
    way[i] = (point_of(t.now, i / 3) - x0[i / 3] - problem.shift_of(t.pair))[i % 3];
    y0 += rows[i] * g0[i];
    y1 += rows[i] * g1[i];
  }
  const StartShare share = start_share(g0, g1, way, t.proximity.distance - start.distance);
  const double b = share.value, force = t.pressing.first, by_share = force * (y0 - y1);
  for (int i = 0; i < 9; ++i) {
    double bent = 0.0, turned = 0.0, parts = -share.by_part[i / 3] * g0[i];
    for (int j = 0; j < 9; ++j) {
      bent += H[i][j] * rows[j];
      turned += H[i][j] * way[j];
      parts += share.by_part[j / 3] * H[i][j] * way[j];
    }
    out.start[i] += t.pressing.by_start * (y1 + b * (y0 - y1)) * g0[i] + force * b * bent +
                    by_share * (0.5 * share.by_excess * (g1[i] - g0[i] - turned) +
                                share.by_apart * (turned - g0[i] + g1[i]) + parts);
  }
}

/// Along the direction at the end, by the distance at the start alone.
void add_end_pressing(const ContactProblem& problem, const Touching& t, double along, ContactAdjoint& out) {
  if (t.pressing.by_start == 0.0) return;
  double slopes[12];
  set_distance_slopes(problem, t.pair, slopes);
  for (int i = 0; i < 12; ++i) out.start[i] += along / t.pressing.first * t.pressing.by_start * slopes[i];
}

/// rows times minus the forces.
double times_forces(const ContactProblem& problem, const Touching& t, const Rows& rows, bool friction) {
  ContactLocal local{};
  if (friction)
    contact_local(problem, t, {}, false, local);
  else
    add_pressing(problem, t, false, true, local);
  double sum = 0.0;
  for (int i = 0; i < kContactUnknowns; ++i) sum += rows[i] * local.gradient[i];
  return sum;
}

/// Derivatives by the inputs of the elastic share of an impact: pressing and friction are proportional to the force.
void add_impact(const ContactProblem& problem, const Touching& t, const Rows& rows, double by_approach,
                ContactAdjoint& out) {
  if (!(t.approach > 0.0)) return;
  if (t.law.elastic > 0.0 && t.pressing.first != 0.0) {
    PressingLaw law = t.law;
    law.elastic = 1.0;
    double by_share = law.at(t.before, t.proximity.distance).first;
    law.elastic = 0.0;
    by_share -= law.at(t.before, t.proximity.distance).first;
    by_share *= times_forces(problem, t, rows, true) / t.pressing.first;
    const ElasticShareSlopes slopes = elastic_share_slopes(problem, t);
    by_approach += by_share * slopes.approach;
    out.slip_tolerance += by_share * slopes.slip_tolerance;
    out.gravity += by_share * slopes.gravity;
    out.mass += by_share * slopes.mass;
  }
  const ContactKey& key = t.pair.key;
  if (find_record(problem.renewed, key) == nullptr && find_record(problem.start->contacts, key) != nullptr)
    out.approach += by_approach;
  else
    add_approach_slopes(problem, t, by_approach, out.start, out.velocity);
}

}  // namespace

ContactAdjoint contact_adjoint(const ContactProblem& problem, const Touching& t, const Rows& rows, double by_approach) {
  ContactAdjoint out;
  if (problem.anchored() && t.pair.rubs())
    throw std::invalid_argument(
        "no gradient is available with anchored friction: use "
        "friction_model='implicit' or 'lagged'");
  if (t.lagged >= 0)
    add_lagged_friction(problem, t, rows, out);
  else
    for (const FrictionKind kind : kFrictionKinds)
      if (has_friction(problem, t, kind)) add_implicit_friction(problem, t, kind, rows, out);
  if (t.lagged >= 0) return out;
  if (problem.turns(t.pair))
    add_mean_pressing(problem, t, rows, out);
  else if (t.pair.curve() && problem.means_direction())
    add_curve_pressing(problem, t, rows, out);
  else
    add_end_pressing(problem, t, times_forces(problem, t, rows, false), out);
  add_impact(problem, t, rows, by_approach, out);
  return out;
}

}  // namespace withe
