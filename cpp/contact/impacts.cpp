#include "contact/impacts.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace withe {
namespace {

// An impact is over after so many swings of its contact and steps, and forgotten after twice as many.
constexpr double kSwings = 12.0, kSteps = 4.0;
// What gives nothing back leaves where it came to at kParting kLeastParting of the speed of approach: within some 90
// swings, which are those of a contact at its stiffest. What contact stores until then is lost as well.
constexpr double kSwingsOut = 128.0;
// The speed of approach of what rests, if it does not fall on; over the speed of rest.
constexpr double kLeastApproach = 1e-9;
// Surfaces that part faster than this, over the speed at which they will have parted, give back no more than
// restitution says: slower ones have a four-hundredth of the energy that is to be left. That speed is so much of that
// of approach, at least.
constexpr double kParting = 0.05, kLeastParting = 0.3;
// What an impact gives back is known within this many swings.
constexpr double kResolvedSwings = 4.0;
// Backward Euler leaves 1 / (w dt)^2 of the speed with which surfaces meet where a step is long for a swing, w dt = pi
// dt over its time: after this many swings less than a hundredth, so that what gives back no more needs no steps of its
// own.
constexpr double kLeftBehind = 0.01, kLongSwings = 3.2;
// Surfaces that meet within a step press along a mean of the directions in which they lie to each other at its ends,
// which is off the one in which they meet by half of what is between these, at most [rad]. Where bodies touch already,
// contacts take over from others as these slide, time and again: there it counts for this share. Within one rod it does
// not: knots that are pulled by some radii a step come out right without, in a tenth of the steps.
constexpr double kMostTurn = 0.05, kHandover = 0.125;
// A rod rolls if where it touches tilts against the obstacle so that one end of that goes up against its middle faster
// than this, over the speed of rest: so far from there it is as much nearer as surfaces are deep in each other, or so
// many pieces of its curve at most. It has rolled off a piece when its slope has changed by so much, over what changes
// it by a whole piece.
constexpr double kTilting = 0.03, kMostPieces = 16.0, kRolledOff = 2.0;

/// From 0 to 1 where x does, without a corner.
double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

double smooth_slope(double x) { return x > 0.0 && x < 1.0 ? 6.0 * x * (1.0 - x) : 0.0; }

/// Steps in a swing by which what an impact gives back, e of the speed, is known to a hundredth: in the one in which it
/// turns round nothing of the speed is lost, which is the more the less is to be left.
double steps_in_swing(double restitution) { return std::clamp(10.0 / std::max(restitution, 1e-3), 12.0, 40.0); }

/// 1 for surfaces that have just met at a speed, 0 for those that rest on each other: of an impact that is over after
/// so many swings.
double share_within(const ContactProblem& problem, const Touching& t, double speed, double swings) {
  if (!(t.approach > 0.0)) return 0.0;
  const double over = swings * swing_time(problem, t) + kSteps * problem.duration;
  return smooth_step(speed / rest_speed(problem, t.pair) - 1.0) * smooth_step(2.0 - t.age / over);
}

/// Mean speed of approach over the step, of surfaces on their way in [m/s]; 0 of others. As the step began they may
/// have been at rest, or on their way off.
double speed_in_step(const ContactProblem& problem, const Touching& t) {
  if (!(t.approach > 0.0) || t.age > 0.0 || problem.pressing < Pressing::mean) return 0.0;
  return (start_distance(problem, t.pair) - t.proximity.distance) / problem.duration;
}

/// Speed of an impact by the end of the step [m/s].
double speed_of_impact(const ContactProblem& problem, const Touching& t) {
  return std::max(t.approach, speed_in_step(problem, t));
}

/// True if the step begins with contacts of the same bodies.
bool touches_already(const ContactProblem& problem, const ContactPair& pair) {
  const auto body = [&](int b) { return b < 0 ? b : problem.model().edge_rod[at(b)]; };
  return std::any_of(problem.start->contacts.begin(), problem.start->contacts.end(), [&](const ContactRecord& record) {
    return body(record.key.a) == body(pair.key.a) && body(record.key.b) == body(pair.key.b);
  });
}

/// The rate, as the step begins, of what depends on the place of a piece of a curve against its obstacle, by what it
/// changes with the nodes.
double curve_rate(const ContactProblem& problem, const ContactPair& pair, const double (&slope)[9]) {
  Vec3d v[4];
  problem.bodies.end_points(pair, problem.start->v, v);
  const Vec3d moved = problem.velocity_of(pair);
  double rate = 0.0;
  for (int i = 0; i < 3 * pair.piece.weights->nodes; ++i) rate += slope[i] * (v[i / 3] - moved)[i % 3];
  return rate;
}

/// True if a rod rolls on or off a piece of its curve, which then tilts against the obstacle, and has not touched it
/// for longer than that takes. What such a piece takes the next one gives back: they do not come to rest.
bool rolls(const ContactProblem& problem, const Touching& t) {
  const ContactPair& pair = t.pair;
  if (!(t.approach > 0.0) || !pair.curve() || pair.piece.weights->edges < 2) return false;
  const CurveDistance<double> start = problem.curve_at_start(pair);
  const double rate = curve_rate(problem, pair, curve_slopes(pair.piece, start).slope);
  const double depth = kDepth * pair.small_radius(), pieces = std::sqrt(2.0 * depth / std::abs(start.bend));
  return std::abs(rate) * std::clamp(pieces, 1.0, kMostPieces) > kTilting * rest_speed(problem, pair) &&
         std::abs(rate) * t.age < kRolledOff * start.stiff;
}

/// What presses elastically in a step: 1 of surfaces that have just met, and where a rod rolls; 0 of those that rest on
/// each other.
double elastic_share(const ContactProblem& problem, const Touching& t) {
  const double share = share_within(problem, t, speed_of_impact(problem, t), kSwings);
  return share < 1.0 && problem.pressing >= Pressing::mean && rolls(problem, t) ? 1.0 : share;
}

/// By how much the direction from one surface to the other turns in the step [rad].
double turned(const ContactProblem& problem, const Touching& t) {
  Vec3d first, last;
  if (t.pair.curve()) {
    first = problem.curve_at_start(t.pair).sample[1].normal;
    last = t.proximity.curve.sample[1].normal;
  } else {
    Vec3d x[4];
    first = problem.closest_at_start(t.pair, x).between;
    last = t.proximity.points.between;
  }
  const Vec3d across = cross(first, last);
  return std::atan2(std::sqrt(dot(across, across)), dot(first, last));
}

}  // namespace

double start_distance(const ContactProblem& problem, const ContactPair& pair) {
  if (pair.curve()) return problem.curve_at_start(pair).distance;
  Vec3d x[4];
  return std::sqrt(problem.closest_at_start(pair, x).square);
}

double rest_speed(const ContactProblem& problem, const ContactPair& pair) {
  return std::max(std::sqrt(problem.parameters->gravity * kDepth * pair.small_radius()),
                  problem.parameters->slip_tolerance);
}

double least_approach(const ContactProblem& problem, const ContactPair& pair) {
  return kLeastApproach * rest_speed(problem, pair);
}

double swing_time(const ContactProblem& problem, const Touching& t) {
  return std::numbers::pi * std::sqrt(0.5 * problem.mass_of(t.pair) * t.pair.share / t.stiffness);
}

bool impact_lasts(const ContactProblem& problem, const Touching& t) {
  return elastic_share(problem, t) > 0.0 ||
         (t.pair.restitution < 1.0 && share_within(problem, t, t.approach, kSwingsOut) > 0.0);
}

ElasticShareSlopes elastic_share_slopes(const ContactProblem& problem, const Touching& t) {
  ElasticShareSlopes out;
  if (!(t.approach > 0.0) || elastic_share(problem, t) == 1.0) return out;
  const double rest = rest_speed(problem, t.pair), swing = swing_time(problem, t),
               over = kSwings * swing + kSteps * problem.duration;
  const double speed = speed_of_impact(problem, t), fast = speed / rest - 1.0, fresh = 2.0 - t.age / over;
  const double by_fast = smooth_slope(fast) * smooth_step(fresh), by_fresh = smooth_step(fast) * smooth_slope(fresh);
  if (speed > t.approach)
    out.way = by_fast / (rest * problem.duration);
  else
    out.approach = by_fast / rest;
  const double by_rest = -by_fast * speed / (rest * rest);
  if (rest > problem.parameters->slip_tolerance)
    out.gravity = 0.5 * by_rest * rest / problem.parameters->gravity;
  else
    out.slip_tolerance = by_rest;
  out.mass = by_fresh * t.age / (over * over) * kSwings * 0.5 * swing / problem.mass_of(t.pair);
  return out;
}

bool comes_near(const ContactProblem& problem, const Touching& t) {
  return t.age == 0.0 && t.apart() && t.proximity.distance < start_distance(problem, t.pair);
}

bool meets(const ContactProblem& problem, const ContactPair& pair) {
  return !problem.starting && !std::binary_search(problem.unrecorded.begin(), problem.unrecorded.end(), pair.key);
}

double first_approach(const ContactProblem& problem, const ContactPair& pair) {
  if (problem.pressing == Pressing::still || !meets(problem, pair)) return 0.0;
  return std::max(approach_speed(problem, pair), least_approach(problem, pair));
}

double nearing(const ContactProblem& problem, const ContactPair& pair) {
  if (pair.curve()) {
    const CurveSlopes slopes = curve_slopes(pair.piece, problem.curve_at_start(pair));
    return -curve_rate(problem, pair, slopes.distance);
  }
  Vec3d x[4], v[4];
  problem.bodies.end_points(pair, problem.start->v, v);
  if (pair.key.b < 0) v[2] = v[3] = problem.velocity_of(pair);
  const ClosestPoints c = problem.closest_at_start(pair, x);
  double w[4];
  end_weights(c.s, c.t, w);
  Vec3d rate{};
  for (int i = 0; i < 4; ++i) rate += w[i] * v[i];
  return -dot(c.between, rate) / std::sqrt(std::max(dot(c.between, c.between), 1e-300));
}

void add_approach_slopes(const ContactProblem& problem, const Touching& touching, double by,
                         double (&start)[kContactUnknowns], double (&velocity)[kContactUnknowns]) {
  if (by == 0.0) return;
  const ContactPair& pair = touching.pair;
  const double near = nearing(problem, pair);
  if (std::abs(near) != touching.approach) return;  // it is the least
  if (near < 0.0) by = -by;
  Vec3d x[4], v[4];
  problem.bodies.end_points(pair, problem.start->v, v);
  const Vec3d moved = problem.velocity_of(pair);
  if (pair.curve()) {
    const CurveDistance<double> distance = problem.curve_at_start(pair);
    const CurveSlopes slopes = curve_slopes(pair.piece, distance);
    double H[9][9] = {};
    add_curve_hessian(pair.piece, problem.bodies.obstacle(pair), distance, slopes, 1.0, 9, &H[0][0]);
    for (int i = 0; i < 3 * pair.piece.weights->nodes; ++i) {
      velocity[i] -= by * slopes.distance[i];
      for (int j = 0; j < 9; ++j) start[j] -= by * H[i][j] * (v[i / 3] - moved)[i % 3];
    }
    return;
  }
  if (pair.key.b < 0) v[2] = v[3] = moved;
  const ClosestPoints c = problem.closest_at_start(pair, x);
  using ByPoints = Dual<12>;
  Vec3<ByPoints> p[4], rate{};
  for (int i = 0; i < 4; ++i)
    p[i] = {ByPoints::unknown(x[i].x, 3 * i), ByPoints::unknown(x[i].y, 3 * i + 1),
            ByPoints::unknown(x[i].z, 3 * i + 2)};
  const Vec3<ByPoints> r = p[0] - p[2], u = p[1] - p[0], w = p[3] - p[2];
  ByPoints s = c.s, t = c.t, weight[4];
  solve_parameters(r, u, w, pair.weight_a, pair.weight_b, c.s_free, c.t_free, s, t);
  end_weights(s, t, weight);
  for (int i = 0; i < 4; ++i) rate += weight[i] * Vec3<ByPoints>{v[i].x, v[i].y, v[i].z};
  const Vec3<ByPoints> between = r + s * u - t * w;
  const ByPoints inverse = 1.0 / sqrt(dot(between, between)), speed = -inverse * dot(between, rate);
  for (int i = 0; i < 12; ++i) {
    start[i] += by * speed.slope[i];
    velocity[i] -= by * inverse.value * weight[i / 3].value * between[i % 3].value;
  }
}

void set_pressing(const ContactProblem& problem, Touching& t) {
  const ContactPair& pair = t.pair;
  const double tolerance = problem.tolerance(pair, t.stiffness / pair.share);
  t.law = {problem.description().law, pair.radii(), tolerance, t.stiffness, t.yielded};
  t.energy = t.law.energy(t.proximity.distance);
  t.energy.value *= t.stiffness;
  t.energy.first *= t.stiffness;
  t.energy.second *= t.stiffness;
  t.pressing = {t.energy.first, t.energy.second, 0.0};
  if (problem.pressing == Pressing::still) return;
  const double share = elastic_share(problem, t);
  const double lost = pair.restitution < 1.0 ? (1.0 - pair.restitution * pair.restitution) *
                                                   share_within(problem, t, t.approach, kSwingsOut)
                                             : 0.0;
  if (share == 0.0 && lost == 0.0) return;
  // Friction that goes with the force k E'(D0) asks for the same force at the end of the step before.
  const bool lags = problem.lags() && pair.friction > 0.0;
  if (problem.pressing >= Pressing::mean && !lags) {
    t.law.elastic = share;
    if (share < 1.0) t.law.elastic_by_way = elastic_share_slopes(problem, t).way;
  }
  t.law.restitution = std::sqrt(1.0 - lost);
  t.law.parting = kParting * std::max(t.law.restitution, kLeastParting) * t.approach * problem.duration;
  if (t.law.elastic == 0.0 && !(t.law.restitution < 1.0)) return;
  t.before = start_distance(problem, pair);
  const bool begins = t.law.elastic > 0.0 && t.age == 0.0 && pair.rod_a != pair.rod_b;
  t.turn = begins ? turned(problem, t) : 0.0;
  if (t.turn > kMostTurn && touches_already(problem, pair)) t.turn *= kHandover;
  t.pressing = t.law.at(t.before, t.proximity.distance);
}

bool unresolved(const ContactProblem& problem, const Touching& t, double dt) {
  if (t.lagged >= 0) return false;
  if (t.turn * dt > kMostTurn * problem.duration) return true;
  if (!(t.law.restitution < 1.0)) return false;
  const double swing = swing_time(problem, t);
  const bool keeps_nothing = problem.pressing == Pressing::end && t.pair.restitution <= kLeftBehind;
  if (keeps_nothing && dt > kLongSwings * swing) return false;
  return t.age < kResolvedSwings * swing && steps_in_swing(t.pair.restitution) * dt > swing;
}

}  // namespace withe
