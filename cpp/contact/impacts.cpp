#include "contact/impacts.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace withe {
namespace {

// Time after which an impact presses less elastically, in swings of its contact and in steps; after twice as long it
// does so no more.
constexpr double kImpactSwings = 12.0, kImpactSteps = 4.0;
// Speed of approach of surfaces at rest, if they do not fall on, over `rest_speed`: above 0, which means no impact.
constexpr double kMinApproach = 1e-9;
// Turn in a step of the direction in which surfaces lie to each other [rad]. Surfaces that meet within a step press
// along a mean of the directions at both ends of the step, which is off the true one by half of that at most.
constexpr double kMaxImpactTurn = 0.05;
// Share of that turn that counts where bodies touch already: contacts take over from others as these slide, time and
// again. Within one rod it does not count: knots that are pulled by some radii a step come out right without, in a
// tenth of the steps.
constexpr double kSlidingTurnShare = 0.125;
// Way by which surfaces that are in each other separate in the step of an impact, over the way of their approach.
constexpr double kRecovery = 0.1;
// Distance tolerance in the step of an impact with a restitution below 1, over that of the contact. Surfaces do not
// press before they meet.
constexpr double kStrikeTolerance = 1e-3;
// Speed at which one end of a touching piece goes up against its middle, over `rest_speed`, from which on the rod
// rolls. The end is where the curve is nearer by the depth of contact, and at most kMaxPiecesToEnd pieces away.
constexpr double kMinRollingSpeed = 0.03, kMaxPiecesToEnd = 16.0;
// Change of a piece's slope, over the change from one piece to the next, after which a rod has rolled off the piece.
constexpr double kRolledOffSlope = 2.0;

/// From 0 to 1 where x does, without a corner.
double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

double smooth_slope(double x) { return x > 0.0 && x < 1.0 ? 6.0 * x * (1.0 - x) : 0.0; }

/// Elastic share of an impact that lasts `swings` oscillations: 1 for surfaces that have just met at a speed, 0 for
/// surfaces that rest on each other.
double share_within(const ContactProblem& problem, const Touching& t, double speed, double swings) {
  if (!(t.approach > 0.0)) return 0.0;
  const double over = swings * swing_time(problem, t) + kImpactSteps * problem.duration;
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

/// Rate, as the step begins, of a function of the place of a curve's piece against its obstacle, from its derivatives
/// by the nodes.
double curve_rate(const ContactProblem& problem, const ContactPair& pair, const double (&slope)[9]) {
  Vec3d v[4];
  problem.bodies.end_points(pair, problem.start->v, v);
  const Vec3d moved = problem.velocity_of(pair);
  double rate = 0.0;
  for (int i = 0; i < 3 * pair.piece.weights->nodes; ++i) rate += slope[i] * (v[i / 3] - moved)[i % 3];
  return rate;
}

/// True if a rod rolls on or off a piece of its curve. The piece then tilts against the obstacle, and has touched it
/// for no longer than rolling takes. The next piece returns the energy of such a piece: the pieces do not come to rest.
bool rolls(const ContactProblem& problem, const Touching& t) {
  const ContactPair& pair = t.pair;
  if (!(t.approach > 0.0) || !pair.curve() || pair.piece.weights->edges < 2) return false;
  const CurveDistance<double> start = problem.curve_at_start(pair);
  const double rate = curve_rate(problem, pair, curve_slopes(pair.piece, start).slope);
  const double depth = kDepth * pair.scale, pieces = std::sqrt(2.0 * depth / std::abs(start.bend));
  return std::abs(rate) * std::clamp(pieces, 1.0, kMaxPiecesToEnd) > kMinRollingSpeed * rest_speed(problem, pair) &&
         std::abs(rate) * t.age < kRolledOffSlope * start.stiff;
}

/// Elastic share of pressing in a step: 1 for surfaces that have just met, and for a rolling rod; 0 for surfaces that
/// rest on each other.
double elastic_share(const ContactProblem& problem, const Touching& t) {
  if (t.pair.restitution < 1.0) return 0.0;
  const double share = share_within(problem, t, speed_of_impact(problem, t), kImpactSwings);
  return share < 1.0 && problem.pressing >= Pressing::mean && rolls(problem, t) ? 1.0 : share;
}

/// Acceleration by gravity at which surfaces approach each other as the step begins [m/s^2].
double pull_of(const ContactProblem& problem, const Touching& t) {
  const VectorX& mass = problem.parameters->edge_mass;
  const auto falls = [&](int edge) { return edge >= 0 && std::isfinite(mass(edge)) ? 1.0 : 0.0; };
  return (falls(t.pair.key.b) - falls(t.pair.key.a)) * dot(problem.parameters->pull, t.proximity.normal);
}

/// True if surfaces with a restitution below 1 are on their way to an impact.
bool comes_to_strike(const Touching& t) { return t.pair.restitution < 1.0 && t.approach > 0.0 && t.age == 0.0; }

/// True if a force at the end of the step may keep surfaces where an impact leaves them. A barrier is infinite where
/// they touch, so it keeps its own distance.
bool is_placed(const ContactProblem& problem, const Touching& t) {
  return comes_to_strike(t) && problem.description().law != ContactLaw::barrier;
}

/// The impact of a contact that begins in the step, at a constant acceleration before and after it.
Strike strike_of(const ContactProblem& problem, const Touching& t) {
  const ContactPair& pair = t.pair;
  Strike strike;
  if (problem.pressing == Pressing::still || !comes_to_strike(t)) return strike;
  strike.happens = true;
  const double duration = problem.duration, rate = nearing(problem, pair), pull = pull_of(problem, t),
               start = start_distance(problem, pair) - pair.radii(), gap = std::max(0.0, start),
               square = rate * rate + 2.0 * pull * gap;
  double time = duration;  // until they meet
  if (square >= 0.0 && (rate > 0.0 || pull > 0.0))
    time = rate > 0.0 ? 2.0 * gap / (rate + std::sqrt(square)) : (std::sqrt(square) - rate) / pull;
  time = std::clamp(time, 0.0, duration);
  const double speed = std::max(0.0, rate + pull * time), left = duration - time;
  if (is_placed(problem, t)) strike.apart = std::min(0.0, start + kRecovery * speed * duration);
  // Surfaces rest that would come back within a step.
  const double parting = pair.restitution * speed;
  if (speed <= rest_speed(problem, pair) || 2.0 * parting <= pull * duration) return strike;
  strike.speed = parting - pull * left;
  if (is_placed(problem, t)) strike.apart += std::max(0.0, left * (parting - 0.5 * pull * left));
  return strike;
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
  return std::max(std::sqrt(problem.parameters->gravity * kDepth * pair.scale), problem.parameters->slip_tolerance);
}

double least_approach(const ContactProblem& problem, const ContactPair& pair) {
  return kMinApproach * rest_speed(problem, pair);
}

double swing_time(const ContactProblem& problem, const Touching& t) {
  return std::numbers::pi * std::sqrt(0.5 * problem.mass_of(t.pair) * t.pair.share / t.stiffness);
}

bool impact_lasts(const ContactProblem& problem, const Touching& t) { return elastic_share(problem, t) > 0.0; }

ElasticShareSlopes elastic_share_slopes(const ContactProblem& problem, const Touching& t) {
  ElasticShareSlopes out;
  if (!(t.approach > 0.0) || elastic_share(problem, t) == 1.0) return out;
  const double rest = rest_speed(problem, t.pair), swing = swing_time(problem, t),
               over = kImpactSwings * swing + kImpactSteps * problem.duration;
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
  out.mass = by_fresh * t.age / (over * over) * kImpactSwings * 0.5 * swing / problem.mass_of(t.pair);
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
  if (pair.face != nullptr) {
    const FaceVectors<double> place(x, pair.point);
    double slope[12], rate = 0.0;
    face_gradient(place, pair.point, place.over(*pair.face), slope);
    for (int i = 0; i < 12; ++i) rate += slope[i] * v[i / 3][i % 3];
    return -rate;
  }
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
  const double whole = problem.tolerance(pair, t.stiffness / pair.share),
               tolerance = is_placed(problem, t) ? kStrikeTolerance * whole : whole;
  t.law = {problem.description().law, pair.radii(), tolerance, t.stiffness, t.yielded};
  t.energy = t.law.energy(t.proximity.distance);
  t.energy.value *= t.stiffness;
  t.energy.first *= t.stiffness;
  t.energy.second *= t.stiffness;
  t.pressing = {t.energy.first, t.energy.second, 0.0};
  t.strike = strike_of(problem, t);
  if (problem.pressing == Pressing::still) return;
  const double share = elastic_share(problem, t);
  if (share == 0.0 && !t.strike.happens) return;
  // Friction that is proportional to k E'(D0) requires the same force at the end of the previous step.
  const bool lags = problem.lags() && pair.friction > 0.0;
  if (problem.pressing >= Pressing::mean && !lags) {
    t.law.elastic = share;
    if (share < 1.0) t.law.elastic_by_way = elastic_share_slopes(problem, t).way;
  }
  if (t.law.elastic == 0.0 && !t.strike.happens) return;
  if (is_placed(problem, t)) t.law.yielded = -t.strike.apart;
  if (t.law.elastic > 0.0) t.before = start_distance(problem, pair);
  const bool begins = t.age == 0.0 && pair.rod_a != pair.rod_b;
  t.turn = begins ? turned(problem, t) : 0.0;
  if (t.turn > kMaxImpactTurn && touches_already(problem, pair)) t.turn *= kSlidingTurnShare;
  t.pressing = t.law.at(t.before, t.proximity.distance);
}

bool unresolved(const ContactProblem& problem, const Touching& t, double dt) {
  return t.lagged < 0 && t.turn * dt > kMaxImpactTurn * problem.duration;
}

}  // namespace withe
