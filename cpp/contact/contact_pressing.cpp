#include <algorithm>
#include <cmath>
#include <numbers>

#include "contact/contact.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

namespace {

// An impact is over after so many swings of its contact and steps, and forgotten after twice as many.
constexpr double kSwings = 12.0, kSteps = 4.0;

/// From 0 to 1 where x does, without a corner.
double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

// Of surfaces that near each other so slowly that they rest, if they do not fall on; over the speed of rest.
constexpr double kLeastApproach = 1e-9;
// Surfaces that part faster than this, over the speed at which they will have parted, give back no more than
// restitution says: slower ones have a four-hundredth of the energy that is to be left. That speed is so much of that
// of approach, at least.
constexpr double kParting = 0.05, kLeastParting = 0.1;
// What an impact gives back is known within this many swings.
constexpr double kResolvedSwings = 4.0;

/// Steps in a swing by which what an impact gives back, e of the speed, is known to a hundredth: in the one in which it
/// turns round nothing of the speed is lost, which is the more the less is to be left.
double steps_in_swing(double restitution) { return std::clamp(10.0 / std::max(restitution, 1e-3), 12.0, 40.0); }

}  // namespace

double Contact::mass_of(const ContactPair& pair) const {
  if (pair.curve() && pair.piece.weights->edges == 2)
    return 0.5 * (edge_mass_(pair.piece.edge[0]) + edge_mass_(pair.piece.edge[1]));
  return pair.key.b < 0 ? edge_mass_(pair.key.a) : std::min(edge_mass_(pair.key.a), edge_mass_(pair.key.b));
}

/// Surfaces that meet more slowly rest on each other: as fast as a fall from the depth of contact ends, or as slip that
/// counts as none.
double Contact::rest_speed(const ContactPair& pair) const {
  return std::max(std::sqrt(gravity_ * kDepth * pair.small_radius()), model_.description.contact.slip_tolerance);
}

/// Half a period of an edge on its contact: as long as an impact lasts at least.
double Contact::swing_time(const ContactPair& pair, const Touching& t) const {
  return std::numbers::pi * std::sqrt(0.5 * mass_of(pair) * pair.share / t.stiffness);
}

/// 1 for surfaces that have just met, 0 for those that rest on each other.
double Contact::impact_share(const ContactPair& pair, const Touching& t) const {
  if (!(t.approach > 0.0)) return 0.0;
  const double over = kSwings * swing_time(pair, t) + kSteps * duration_;
  return smooth_step(t.approach / rest_speed(pair) - 1.0) * smooth_step(2.0 - t.age / over);
}

/// Whether surfaces meet in this step.
bool Contact::met(const ContactPair& pair) const {
  return !starting_ && !std::binary_search(unrecorded_.begin(), unrecorded_.end(), pair.key);
}

/// Whether no more than the tail of the contact law presses the surfaces.
bool Contact::apart(const Touching& t) const { return t.proximity.distance + t.yielded >= t.pair.radii(); }

/// Notes which surfaces near each other anew as the step begins, of those that touch by then.
void Contact::renew_impacts() {
  for (Touching& t : touching_) {
    const ContactPair& pair = t.pair;
    ContactRecord record;
    if (const ContactRecord* known = find_record(state_->contacts, pair.key)) {
      if (known->approach == 0.0) continue;  // they rest until they have left each other
      record = *known;
    } else {
      record.key = pair.key;
      record.stiffness = t.stiffness / pair.share;
    }
    if (!renew_impact(t, record)) continue;
    set_force(t, &record);
    renewed_.push_back(record);
  }
  std::sort(renewed_.begin(), renewed_.end(),
            [](const ContactRecord& a, const ContactRecord& b) { return a.key < b.key; });
}

/// Surfaces that a scene begins with within the tolerance of contact fall onto each other if they store less than what
/// moves and weight will give, and rest if not. Later they may part and meet again within it, and those that press may
/// be hit by more than the impact that is not yet over. The speed at which they near each other is then that of another
/// impact, which is on its way in while its age is 0: for it contact is as stiff as if it only began, without a change
/// of energy.
bool Contact::renew_impact(Touching& t, ContactRecord& record) const {
  const ContactPair& pair = t.pair;
  double speed = approach_speed(pair);
  if (record.approach == 0.0) {
    const double given = 0.5 * speed * speed + gravity_ * std::max(t.proximity.distance - pair.radii(), 0.0);
    if (!(t.energy.value < pair.share * mass_of(pair) * given)) return false;
    speed = std::max(speed, kLeastApproach * rest_speed(pair));
  } else {
    const bool again = apart(t) && t.age > 0.0 && speed > 0.0;
    if (!again && speed <= t.approach) return false;
  }
  t.approach = record.approach = speed;
  record.age = 0.0;
  const double ratio = impact_stiffness(pair) / record.stiffness;
  if (!apart(t) || !(ratio > 1.0)) return true;
  record.yielded = yielded_at(t, ratio, Keep::energy);
  record.stiffness *= ratio;
  record.stick = (1.0 / std::sqrt(ratio)) * record.stick;
  return true;
}

double Contact::first_approach(const ContactPair& pair) const {
  if (pressing_ == Pressing::still || !met(pair)) return 0.0;
  return std::max(approach_speed(pair), kLeastApproach * rest_speed(pair));
}

/// At which surfaces near each other as the step begins.
double Contact::approach_speed(const ContactPair& pair) const {
  Vec3d x[4], v[4];
  bodies().end_points(pair, state_->v, v);
  const Vec3d shift = shift_of(pair), moved = (1.0 / duration_) * shift;
  if (pair.curve()) {
    const CurveSlopes slopes = curve_slopes(pair.piece, distance_at_start(pair, x));
    double rate = 0.0;
    for (int i = 0; i < 3 * pair.piece.weights->nodes; ++i) rate += slopes.distance[i] * (v[i / 3] - moved)[i % 3];
    return std::max(0.0, -rate);
  }
  bodies().end_points(pair, state_->q, x);
  if (pair.key.b < 0) {
    x[2] -= shift;
    x[3] -= shift;
    v[2] = v[3] = moved;
  }
  const ClosestPoints c = closest_points(x[0], x[1], x[2], x[3], pair.weight_a, pair.weight_b);
  double w[4];
  end_weights(c.s, c.t, w);
  Vec3d rate{};
  for (int i = 0; i < 4; ++i) rate += w[i] * v[i];
  return std::max(0.0, -dot(c.between, rate) / std::sqrt(std::max(dot(c.between, c.between), 1e-300)));
}

/// Distance as the step begins, an obstacle that moves being where it was.
double Contact::start_distance(const ContactPair& pair) const {
  Vec3d x[4];
  if (pair.curve()) return distance_at_start(pair, x).distance;
  bodies().end_points(pair, state_->q, x);
  const Vec3d shift = shift_of(pair);
  x[2] -= shift;
  x[3] -= shift;
  return std::sqrt(closest_points(x[0], x[1], x[2], x[3], pair.weight_a, pair.weight_b).square);
}

/// The same of the points that are the closest at its end, D0 of `add_mean_pressing`.
double Contact::distance_before(const ContactPair& pair, const Touching& t) const {
  double w[4];
  end_weights(t.proximity.points.s, t.proximity.points.t, w);
  Vec3d start[4], d0{};
  bodies().end_points(pair, state_->q, start);
  const Vec3d shift = shift_of(pair), &d1 = t.proximity.points.between;
  start[2] -= shift;
  start[3] -= shift;
  for (int i = 0; i < 4; ++i) d0 += w[i] * start[i];
  return std::sqrt(std::max(dot(d0, d0) + t.proximity.distance * t.proximity.distance - dot(d1, d1), 0.0));
}

/// Sets what a contact remembers, its energy at q1 and its force.
void Contact::set_force(Touching& t, const ContactRecord* record) const {
  const ContactPair& pair = t.pair;
  t.stiffness = pair.share * (record ? record->stiffness : first_stiffness(pair));
  t.yielded = record ? record->yielded : 0.0;
  t.approach = record ? record->approach : first_approach(pair);
  t.age = record ? record->age : 0.0;
  if (record) t.stick = record->stick;
  t.law = {model_.description.contact.law, pair.radii(), pair.tolerance, t.stiffness, t.yielded};
  t.energy = t.law.energy(t.proximity.distance);
  t.energy.value *= t.stiffness;
  t.energy.first *= t.stiffness;
  t.energy.second *= t.stiffness;
  t.pressing = {t.energy.first, t.energy.second, 0.0};
  const double share = pressing_ == Pressing::still ? 0.0 : impact_share(pair, t);
  if (share == 0.0) return;
  // Friction that goes with the force k E'(D0) asks for the same force at the end of the step before.
  const bool lags = freezes() && pair.friction > 0.0;
  if (pressing_ >= Pressing::mean && !lags) t.law.elastic = share;
  t.law.restitution = std::sqrt(1.0 - share * (1.0 - pair.restitution * pair.restitution));
  t.law.parting = kParting * std::max(t.law.restitution, kLeastParting) * t.approach * duration_;
  if (t.law.elastic == 0.0 && !(t.law.restitution < 1.0)) return;
  t.before = turns(pair) ? distance_before(pair, t) : start_distance(pair);
  t.pressing = t.law.at(t.before, t.proximity.distance);
}

/// Adds what touches at the start of the step only, and gives back there what it took; `first`: of `touching_` behind
/// what is there for friction alone.
void Contact::add_leaving(std::size_t first) {
  const std::size_t count = touching_.size();
  for (const Touching& start : leaving_) {
    const auto from = touching_.begin() + static_cast<std::ptrdiff_t>(first);  // adding to them moves them
    const auto end = touching_.begin() + static_cast<std::ptrdiff_t>(count);
    const auto found = std::lower_bound(from, end, start.pair.key, [](const Touching& t, const ContactKey& key) {
      return comes_before(t.pair.key, key);
    });
    if (found != end && found->pair.key == start.pair.key) continue;
    Touching t{start.pair, bodies().proximity(start.pair, q1_, true)};
    set_force(t, record_of(t.pair.key));
    touching_.push_back(t);
  }
}

bool Contact::unresolved(double dt) const {
  return std::any_of(touching_.begin(), touching_.end(), [&](const Touching& t) {
    const ContactPair& pair = t.pair;
    if (t.frozen >= 0 || !(t.law.restitution < 1.0)) return false;
    const double swing = swing_time(pair, t);
    return t.age < kResolvedSwings * swing && steps_in_swing(pair.restitution) * dt > swing;
  });
}

/// Whether surfaces press along the mean direction of the step. Curves have a mean of their own; and in a midpoint
/// step only rods do, which thereby keep their angular momentum, unless friction is to stay symmetric.
bool Contact::turns(const ContactPair& pair) const {
  if (pair.curve()) return false;
  if (pressing_ == Pressing::mean_direction) return true;
  return pressing_ == Pressing::mean && pair.key.b >= 0 && (!frictional() || unsymmetric());
}

CurveDistance<double> Contact::distance_at_start(const ContactPair& pair, Vec3d (&x)[4]) const {
  bodies().end_points(pair, state_->q, x);
  return curve_distance(pair.piece, bodies().obstacle(pair), x, shift_of(pair));
}

/// What surfaces that press do.
void Contact::press(const Touching& t, bool with_hessian, ContactLocal& out) const {
  if (t.pair.curve()) {
    add_curve_pressing(t, with_hessian, out);
    return;
  }
  if (!turns(t.pair)) {
    add_pressing(t, with_hessian, out);
    return;
  }
  add_mean_pressing(t, with_hessian && geometric_, out);
  if (!with_hessian || geometric_) return;
  ContactLocal straight{};
  add_pressing(t, true, straight);
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) out.hessian[i][j] += straight.hessian[i][j];
}

/// Along the gradient of D at the end of the step.
void Contact::add_pressing(const Touching& t, bool with_hessian, ContactLocal& out) const {
  const ContactPair& pair = t.pair;
  double w[4], g[12];
  end_weights(t.proximity.points.s, t.proximity.points.t, w);
  // dD = sum w_i (between / D) . dx_i: |between| differs from D by the weights of closest_points.
  const Vec3d direction = (1.0 / t.proximity.distance) * t.proximity.points.between;
  const double n[3] = {direction.x, direction.y, direction.z};
  for (int i = 0; i < 12; ++i) {
    g[i] = w[i / 3] * n[i % 3];
    out.gradient[i] += t.pressing.first * g[i];
  }
  if (!with_hessian) return;
  Vec3d x[4];
  bodies().end_points(pair, q1_, x);
  double H[12][12];
  half_square_hessian(t.proximity.points, x[1] - x[0], x[3] - x[2], pair.weight_a, pair.weight_b, H);
  const double turn = geometric_ ? t.pressing.first / t.proximity.distance : 0.0;
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) out.hessian[i][j] += turn * H[i][j] + (t.pressing.by_end - turn) * g[i] * g[j];
}

/// Of a smooth curve, along the gradient of D at the end of the step; or, where its force is that of the whole step and
/// the matrix need not be symmetric, along the gradients at the start and the end in those shares b and 1 - b with
/// which it does the work f (D1 - D0): where a ring rolls, the points that touch at the end came down onto the surface
/// within the step, and their force alone would slow it.
void Contact::add_curve_pressing(const Touching& t, bool with_hessian, ContactLocal& out) const {
  const ContactPair& pair = t.pair;
  const Obstacle& o = bodies().obstacle(pair);
  Vec3d x[4];
  bodies().end_points(pair, q1_, x);
  const CurveDistance<double> end = curve_distance(pair.piece, o, x);
  const CurveSlopes slopes = curve_slopes(pair.piece, end);
  double along[9], hessian[9][9] = {};
  std::copy(slopes.distance, slopes.distance + 9, along);
  if (with_hessian && geometric_) add_curve_hessian(pair.piece, o, end, slopes, 1.0, 9, &hessian[0][0]);
  if (pressing_ == Pressing::mean_direction || (pressing_ == Pressing::mean && unsymmetric()))
    add_start_direction(pair, x, end.distance, along, hessian);
  for (int i = 0; i < 9; ++i) {
    out.gradient[i] += t.pressing.first * along[i];
    for (int j = 0; j < 9 && with_hessian; ++j)
      out.hessian[i][j] += t.pressing.first * hessian[i][j] + t.pressing.by_end * along[i] * slopes.distance[j];
  }
}

/// From the gradient of D at the end of the step, and its derivative, to the mean of `add_curve_pressing`,
///   m = (1 - b) g1 + b g0,   b = (D1 - D0 - p1) / (p0 - p1),   p = g . (x1 - x0).
void Contact::add_start_direction(const ContactPair& pair, const Vec3d (&x1)[4], double distance, double (&along)[9],
                                  double (&hessian)[9][9]) const {
  Vec3d x0[4];
  const CurveDistance<double> start = distance_at_start(pair, x0);
  const CurveSlopes first = curve_slopes(pair.piece, start);
  const Vec3d shift = shift_of(pair);
  double way[9] = {}, turned[9], p0 = 0.0, p1 = 0.0, size = 0.0;
  for (int i = 0; i < 3 * pair.piece.weights->nodes; ++i) way[i] = (x1[i / 3] - x0[i / 3] - shift)[i % 3];
  for (int i = 0; i < 9; ++i) {
    turned[i] = first.distance[i] - along[i];
    p0 += first.distance[i] * way[i];
    p1 += along[i] * way[i];
    size += std::abs(way[i]);
  }
  // Where gradients differ by no more than rounding, any shares will do.
  const bool same = std::abs(p0 - p1) <= 1e-12 * size;
  const double share = same ? 0.5 : (distance - start.distance - p1) / (p0 - p1), b = std::clamp(share, 0.0, 1.0);
  const bool fixed = same || share != b || !geometric_;
  for (int j = 0; j < 9; ++j) {
    double bent = 0.0;
    for (int i = 0; i < 9; ++i) bent += way[i] * hessian[i][j];
    const double change = fixed ? 0.0 : -(bent + b * (turned[j] - bent)) / (p0 - p1);
    for (int i = 0; i < 9; ++i) hessian[i][j] = (1.0 - b) * hessian[i][j] + turned[i] * change;
  }
  for (int i = 0; i < 9; ++i) along[i] += b * turned[i];
}

/// Where `turns` says so, the force f (see pressing_law.hpp) pushes along the mean of the way d1 between the
/// closest points at the end and the way d0 between those same points of both rods at the start,
///   f w_i (d0 + d1) / (D0 + D1),   D0 = sqrt(|d0|^2 + D1^2 - |d1|^2),
/// whose work over the step is f (D1 - D0). As no points were closer at the start than the closest, and E is convex,
/// that is never more than what the contact gave: pressing gains no energy, however far surfaces slide. And the force
/// points along the way between the points in the middle of the step: it turns nothing there.
void Contact::add_mean_pressing(const Touching& t, bool with_hessian, ContactLocal& out) const {
  const ContactPair& pair = t.pair;
  double w[4];
  end_weights(t.proximity.points.s, t.proximity.points.t, w);
  Vec3d x[4], start[4];
  bodies().end_points(pair, q1_, x);
  bodies().end_points(pair, state_->q, start);
  const Vec3d shift = shift_of(pair), &d1 = t.proximity.points.between;
  start[2] -= shift;
  start[3] -= shift;
  Vec3d d0{};
  for (int i = 0; i < 4; ++i) d0 += w[i] * start[i];
  const double before =
      std::sqrt(std::max(dot(d0, d0) + t.proximity.distance * t.proximity.distance - dot(d1, d1), 0.0));
  const double sum = before + t.proximity.distance, force = t.pressing.first / sum;
  const Vec3d mean = d0 + d1;
  for (int i = 0; i < 12; ++i) out.gradient[i] += force * w[i / 3] * mean[i % 3];
  if (!with_hessian) return;
  const Vec3d u = x[1] - x[0], v = x[3] - x[2], u0 = start[1] - start[0], v0 = start[3] - start[2];
  const double ws[4] = {-1, 1, 0, 0}, wt[4] = {0, 0, 1, -1};
  double K[2][2];
  parameter_inverse(t.proximity.points.s_free, t.proximity.points.t_free, u, v, pair.weight_a, pair.weight_b, K);
  for (int j = 0; j < 12; ++j) {
    const int n = j / 3, k = j % 3;
    const double by_s = ws[n] * d1[k] + w[n] * u[k], by_t = wt[n] * d1[k] - w[n] * v[k];
    const double ds = -K[0][0] * by_s - K[0][1] * by_t, dt = -K[1][0] * by_s - K[1][1] * by_t;
    const Vec3d moved0 = ds * u0 - dt * v0, moved1 = ds * u - dt * v;
    const double spread =
        pair.weight_a * (t.proximity.points.s - 0.5) * ds + pair.weight_b * (t.proximity.points.t - 0.5) * dt;
    const double distance = w[n] * d1[k] / t.proximity.distance;
    const double earlier = (dot(d0, moved0) + spread) / before;
    const double change =
        (t.pressing.by_end * distance + t.pressing.by_start * earlier - force * (distance + earlier)) / sum;
    for (int i = 0; i < 12; ++i) {
      const double share = ws[i / 3] * ds + wt[i / 3] * dt;
      const double turned = moved0[i % 3] + moved1[i % 3] + (i % 3 == k ? w[n] : 0.0);
      out.hessian[i][j] += (w[i / 3] * change + force * share) * mean[i % 3] + force * w[i / 3] * turned;
    }
  }
}

}  // namespace withe
