#include <algorithm>
#include <cmath>

#include "contact/contact.hpp"
#include "contact/friction_jacobian.hpp"

namespace withe {
namespace {

// On a way this short, over the slip that friction grows with, a tangent says enough.
constexpr double kShortWay = 0.1;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

bool Contact::eases() const {
  const FrictionLaw law = model_.description.contact.friction_law;
  return frictional() && (law == FrictionLaw::implicit || law == FrictionLaw::lagged);
}

/// K / (2 dt), over the slip tolerance [1/m].
double Contact::slip_rate() const { return 7.5 / (eased_ * model_.description.contact.slip_tolerance * duration_); }

double Contact::friction_slope(const Touching& t) const {
  const ContactPair& pair = t.pair;
  if (!(pair.friction > 0.0)) return 0.0;
  if (t.frozen >= 0) return pair.friction * frozen_[at(t.frozen)].pressing * slip_rate();
  if (freezes()) return 0.0;
  if (model_.description.contact.friction_law == FrictionLaw::anchored) return tangential_stiffness(pair, t.stiffness);
  return -pair.friction * t.pressing.first * slip_rate();
}

FrictionSetting Contact::setting(const Touching& t) const {
  const ContactDescription& contact = model_.description.contact;
  const ContactPair& pair = t.pair;
  FrictionSetting f;
  f.pair = &pair;
  if (pair.key.b < 0) f.obstacle = &bodies().obstacle(pair);
  f.points = t.proximity.points;
  f.pressing = t.law;
  f.before = t.before;
  f.slides = turns(pair) && t.law.elastic > 0.0;
  f.law = contact.friction_law;
  f.tangential_stiffness = tangential_stiffness(pair, t.stiffness);
  f.rate = slip_rate();
  f.stick = t.stick;
  f.spatial = !model_.planar();
  f.centreline = contact.centreline_friction;
  f.drift = shift_of(pair);
  f.turn = turn_of(pair);
  f.foreseen = foreseen(t);
  bodies().values(pair, state_->q, f.start);
  if (!f.spatial) return f;
  if (pair.curve()) {
    for (int b = 0; b < pair.piece.weights->edges; ++b) f.source[b] = state_->tangent[at(pair.piece.edge[b])];
    return f;
  }
  f.source[0] = state_->tangent[at(pair.key.a)];
  if (pair.key.b >= 0) f.source[1] = state_->tangent[at(pair.key.b)];
  return f;
}

void Contact::add_friction(const Touching& t, bool with_hessian, ContactLocal& out) const {
  const ContactPair& pair = t.pair;
  const FrictionSetting f = setting(t);
  double now[kContactUnknowns];
  bodies().values(pair, q1_, now);
  const SlippingSurfaces<double> surfaces = slipping_surfaces(f, now);
  add_friction_gradient(f, surfaces, out.gradient);
  if (with_hessian) add_friction_jacobian(f, surfaces, out.hessian);
}

/// Friction's force on the obstacle, the opposite of that on a, times the way of the surface.
double Contact::turning_work(const Touching& t) const {
  const ContactPair& pair = t.pair;
  const Vec3d turn = turn_of(pair);
  if (!(pair.friction > 0.0) || dot(turn, turn) == 0.0) return 0.0;
  if (t.frozen >= 0) return -dot(frozen_force(t).force, frozen_[at(t.frozen)].turned);
  if (freezes()) return 0.0;
  const FrictionSetting f = setting(t);
  double now[kContactUnknowns];
  bodies().values(pair, q1_, now);
  Vec3d x[4];
  bodies().end_points(pair, q1_, x);
  const SlippingSurfaces<double> c = slipping_surfaces(f, now);
  return -dot(c.friction.force, cross(turn, obstacle_arm(f, c, x)));
}

namespace {

/// Adds how edge `tail`, `tail + 1` turns and spins the surface on `arm`, to columns of J.
void add_turning(const Vec3d (&x)[4], int tail, int angle, const Vec3d& arm, bool spatial,
                 Vec3d (&column)[kContactUnknowns]) {
  const Vec3d e = x[tail + 1] - x[tail];
  const double inverse = 1.0 / std::sqrt(dot(e, e));
  const Vec3d tangent = inverse * e;
  const Vec3d axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int k = 0; k < 3; ++k) {
    const Vec3d turned = inverse * cross(cross(tangent, axes[k]), arm);
    column[3 * tail + 3 + k] += turned;
    column[3 * tail + k] -= turned;
  }
  if (spatial) column[angle] = cross(tangent, arm);
}

}  // namespace

/// J at the start.
void Contact::freeze_slip(const Touching& t, Frozen& frozen) const {
  const ContactPair& pair = t.pair;
  const bool centreline = model_.description.contact.centreline_friction, obstacle = pair.key.b < 0;
  double w[4];
  end_weights(t.proximity.points.s, t.proximity.points.t, w);
  for (int i = 0; i < 3 && pair.curve(); ++i) w[i] = pair.piece.weights->at(i, t.proximity.points.s);
  Vec3d x[4], column[kContactUnknowns] = {};
  bodies().end_points(pair, state_->q, x);
  const Vec3d axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int i = 0; i < (pair.curve() ? 9 : obstacle ? 6 : 12); ++i) column[i] = w[i / 3] * axes[i % 3];
  const int edges = centreline ? 0 : pair.curve() ? pair.piece.weights->edges : obstacle ? 1 : 2;
  for (int side = 0; side < edges; ++side) {
    const Vec3d arm = pair.curve() ? piece_arm(pair, side, t.proximity.points.s, t.proximity.normal)
                                   : (side == 0 ? 1.0 : -1.0) *
                                         contact_arm(pair, side, t.proximity.normal, t.proximity.points.between);
    add_turning(x, pair.curve() ? side : 2 * side, 12 + side, arm, !model_.planar(), column);
  }
  for (int i = 0; i < kContactUnknowns; ++i) {
    const Vec3d c = column[i] - dot(column[i], t.proximity.normal) * t.proximity.normal;
    frozen.slip[0][i] = c.x;
    frozen.slip[1][i] = c.y;
    frozen.slip[2][i] = c.z;
  }
}

/// Friction with J of the start, where frames have not turned yet, for all that touches there.
void Contact::freeze() {
  frozen_.clear();
  for (const Touching& t : touching_) {
    const ContactPair& pair = t.pair;
    const double pressing = -t.energy.first;
    if (!(pair.friction > 0.0) || !(pressing > 0.0)) continue;
    Frozen frozen{};
    frozen.pressing = pressing;
    freeze_slip(t, frozen);
    const Vec3d turn = turn_of(pair);
    if (dot(turn, turn) > 0.0) {
      Vec3d x[4];
      bodies().end_points(pair, state_->q, x);
      frozen.turned = cross(
          turn, pair.curve() ? piece_obstacle_arm(pair, bodies().obstacle(pair), x, t.proximity.points.s)
                             : x[2] + t.proximity.points.t * (x[3] - x[2]) + pair.radius_b * t.proximity.normal - x[2]);
    }
    const Vec3d shift = shift_of(pair) + frozen.turned;
    frozen.drift = shift - dot(shift, t.proximity.normal) * t.proximity.normal;
    if (model_.description.contact.friction_law == FrictionLaw::semi_explicit) set_direction(pair, frozen);
    lagged_.push_back(t);
    lagged_.back().frozen = static_cast<int>(frozen_.size());
    lagged_.back().energy = ContactEnergy{};
    frozen_.push_back(frozen);
  }
}

/// How far the surfaces have slipped, with J of the start.
Vec3d Contact::frozen_slip(const Touching& t) const {
  const ContactPair& pair = t.pair;
  const Frozen& frozen = frozen_[at(t.frozen)];
  double now[kContactUnknowns], before[kContactUnknowns];
  bodies().values(pair, q1_, now);
  bodies().values(pair, state_->q, before);
  Vec3d slip = -frozen.drift;
  for (int i = 0; i < kContactUnknowns; ++i)
    slip += (now[i] - before[i]) * Vec3d{frozen.slip[0][i], frozen.slip[1][i], frozen.slip[2][i]};
  return slip;
}

Contact::Slipping Contact::frozen_slipping(const Touching& t, const VectorX& change) const {
  const ContactPair& pair = t.pair;
  const Frozen& frozen = frozen_[at(t.frozen)];
  Slipping out;
  out.limit = pair.friction * frozen.pressing;
  out.slip = frozen_slip(t);
  int dofs[kContactUnknowns];
  surfaces_.unknowns(pair, dofs);
  for (int i = 0; i < kContactUnknowns; ++i)
    if (dofs[i] >= 0) out.change += change(dofs[i]) * Vec3d{frozen.slip[0][i], frozen.slip[1][i], frozen.slip[2][i]};
  out.law = tanh_law(pair.friction, frozen.pressing, dot(out.slip, out.slip), slip_rate());
  return out;
}

Contact::Slipping Contact::slipping(const Touching& t, const VectorX& change) const {
  const ContactPair& pair = t.pair;
  const FrictionSetting f = setting(t);
  int dofs[kContactUnknowns];
  surfaces_.unknowns(pair, dofs);
  double now[kContactUnknowns];
  bodies().values(pair, q1_, now);
  Dual<1> unknown[kContactUnknowns];
  for (int i = 0; i < kContactUnknowns; ++i) {
    unknown[i] = now[i];
    if (dofs[i] >= 0) unknown[i].slope[0] = change(dofs[i]);
  }
  const SlippingSurfaces<Dual<1>> surfaces = slipping_surfaces(f, unknown);
  const Vec3<Dual<1>> way = whole_way(f, surfaces), slip = way - dot(way, surfaces.normal) * surfaces.normal;
  Slipping out;
  out.limit = pair.friction * surfaces.pressing.value;
  out.slip = {slip.x.value, slip.y.value, slip.z.value};
  out.change = {slip.x.slope[0], slip.y.slope[0], slip.z.slope[0]};
  out.law = force_law(f, surfaces.pressing.value, dot(out.slip, out.slip), surfaces.friction.sticking);
  return out;
}

void Contact::foresee_friction(const VectorX& change) {
  if (!frictional() || model_.description.contact.friction_law == FrictionLaw::semi_explicit) return;
  if (eases() && farthest(model_, change) * slip_rate() < kShortWay) {
    forget_foreseen();
    return;
  }
  foreseen_.renew([&](const auto& add) {
    for (const Touching& t : touching_) {
      const bool frozen = t.frozen >= 0;
      if (frozen != freezes() || !(t.pair.friction > 0.0)) continue;
      const Slipping s = frozen ? frozen_slipping(t, change) : slipping(t, change);
      if (s.limit > 0.0) add(t.pair.key, s.law.foresee(s.slip, s.change, foreseen(t), s.limit));
    }
  });
}

/// The direction of slip at the start, and how much of friction there is at its speed, tanh(K u / 2) [Choi,
/// dissertation, (4.12), (4.13), with the weight (5.10) in place of (4.14)].
void Contact::set_direction(const ContactPair& pair, Frozen& frozen) const {
  double velocity[kContactUnknowns];
  bodies().values(pair, state_->v, velocity);
  Vec3d u = (-1.0 / duration_) * frozen.drift;
  for (int i = 0; i < kContactUnknowns; ++i)
    u += velocity[i] * Vec3d{frozen.slip[0][i], frozen.slip[1][i], frozen.slip[2][i]};
  const double speed = std::sqrt(dot(u, u));
  if (speed > 0.0) frozen.direction = (1.0 / speed) * u;
  frozen.pressing *= std::tanh(7.5 * speed / model_.description.contact.slip_tolerance);
}

/// Lagged: mu N tanh(K |S| / (2 dt)) along the slip S of the step. Semi-explicit: mu N gamma tanh(K s / (2 dt)) along
/// the direction at the start, s = S . direction where that is positive: constant while surfaces slip on, and nothing
/// where they would slip back, so that it never pushes them.
Contact::FrozenForce Contact::frozen_force(const Touching& t) const {
  const ContactPair& pair = t.pair;
  const Frozen& frozen = frozen_[at(t.frozen)];
  const ContactDescription& contact = model_.description.contact;
  const double rate = slip_rate(), limit = pair.friction * frozen.pressing;
  const Vec3d slip = frozen_slip(t);
  FrozenForce out{};
  if (contact.friction_law == FrictionLaw::semi_explicit) {
    const Vec3d& d = frozen.direction;
    const double along = std::max(dot(slip, d), 0.0), share = std::tanh(rate * along);
    const double slope = along > 0.0 ? limit * rate * (1.0 - share * share) : 0.0;
    const double n[3] = {d.x, d.y, d.z};
    out.force = (limit * share) * d;
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l) out.slope[k][l] = slope * n[k] * n[l];
    out.sticking = rate * along < 7.5;
    return out;
  }
  const double square = dot(slip, slip);
  const ForceLaw g = tanh_law(pair.friction, frozen.pressing, square, rate);
  const Vec3d reckoned = g.reckoned(slip, foreseen(t), limit);
  out.force = g.factor * slip;
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l)
      out.slope[k][l] = (k == l ? g.factor : 0.0) + g.by_square * (slip[k] * reckoned[l] + reckoned[k] * slip[l]);
  out.sticking = rate * std::sqrt(square) < 7.5;
  return out;
}

/// Friction of the step, for the records of contacts that still press at its end.
void Contact::record_frozen(std::vector<ContactRecord>& records) const {
  for (const Touching& t : touching_) {
    if (t.frozen < 0) continue;
    ContactRecord* record = find_record(records, t.pair.key);
    if (record == nullptr) continue;
    const FrozenForce f = frozen_force(t);
    record->friction = -f.force;
    record->sticking = f.sticking;
  }
}

void Contact::add_frozen_friction(const Touching& t, bool with_hessian, ContactLocal& out) const {
  const Frozen& frozen = frozen_[at(t.frozen)];
  const FrozenForce f = frozen_force(t);
  const double force[3] = {f.force.x, f.force.y, f.force.z};
  for (int i = 0; i < kContactUnknowns; ++i)
    for (int k = 0; k < 3; ++k) out.gradient[i] += frozen.slip[k][i] * force[k];
  if (!with_hessian) return;
  double back[3][kContactUnknowns];  // derivative of the force by the unknowns
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < kContactUnknowns; ++i) {
      back[k][i] = 0.0;
      for (int l = 0; l < 3; ++l) back[k][i] += f.slope[k][l] * frozen.slip[l][i];
    }
  for (int i = 0; i < kContactUnknowns; ++i)
    for (int j = 0; j < kContactUnknowns; ++j)
      for (int k = 0; k < 3; ++k) out.hessian[i][j] += frozen.slip[k][i] * back[k][j];
}

}  // namespace withe
