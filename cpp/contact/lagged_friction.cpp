#include "contact/lagged_friction.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/finite_turn.hpp"

namespace withe {
namespace {

/// Adds how edge `tail`, `tail + 1` turns and spins the surface on `arm`, to columns of J.
void add_turning(const Vec3d (&x)[4], int tail, int angle, const Vec3d& arm, bool spatial,
                 Vec3d (&column)[kContactUnknowns]) {
  const Vec3d e = x[tail + 1] - x[tail];
  const double inverse = 1.0 / std::sqrt(dot(e, e));
  const Vec3d tangent = inverse * e;
  for (int k = 0; k < 3; ++k) {
    const Vec3d turned = inverse * cross(cross(tangent, kUnitVectors[k]), arm);
    column[3 * tail + 3 + k] += turned;
    column[3 * tail + k] -= turned;
  }
  if (spatial) column[angle] = cross(tangent, arm);
}

/// J at the start.
void set_slip(const ContactProblem& problem, const Touching& t, LaggedFriction& lagged) {
  const ContactPair& pair = t.pair;
  const ClosestPoints& points = t.proximity.points;
  const Vec3d& normal = t.proximity.normal;
  const bool centreline = problem.description().centreline_friction, obstacle = pair.key.b < 0;
  double w[4];
  end_weights(points.s, points.t, w);
  for (int i = 0; i < 3 && pair.curve(); ++i) w[i] = pair.piece.weights->at(i, points.s);
  Vec3d x[4], column[kContactUnknowns] = {};
  t.end_points(x);
  for (int i = 0; i < (pair.curve() ? 9 : obstacle ? 6 : 12); ++i) column[i] = w[i / 3] * kUnitVectors[i % 3];
  const int edges = centreline ? 0 : pair.curve() ? pair.piece.weights->edges : obstacle ? 1 : 2;
  const Vec3d whole = pair.face != nullptr ? FaceVectors<double>(x, pair.point).point : Vec3d{};
  for (int side = 0; side < edges; ++side) {
    const Vec3d arm =
        pair.curve() ? piece_arm(pair, side, points.s, normal)
                     : (side == 0 ? 1.0 : -1.0) * contact_arm(pair, side, obstacle ? normal : points.between, whole);
    add_turning(x, pair.curve() ? side : 2 * side, 12 + side, arm, !problem.model().planar(), column);
  }
  for (int i = 0; i < kContactUnknowns; ++i) {
    const Vec3d c = column[i] - dot(column[i], normal) * normal;
    lagged.slip[0][i] = c.x;
    lagged.slip[1][i] = c.y;
    lagged.slip[2][i] = c.z;
  }
}

/// The direction of slip at the start, and how much of friction there is at its speed, tanh(K u / 2) [Choi,
/// dissertation, (4.12), (4.13), with the weight (5.10) in place of (4.14)].
void set_direction(const ContactProblem& problem, const ContactPair& pair, LaggedFriction& lagged) {
  double velocity[kContactUnknowns];
  problem.bodies.values(pair, problem.start->v, velocity);
  Vec3d u = (-1.0 / problem.duration) * lagged.drift;
  for (int i = 0; i < kContactUnknowns; ++i) u += velocity[i] * lagged.column(i);
  const double speed = std::sqrt(dot(u, u));
  if (speed > 0.0) lagged.direction = (1.0 / speed) * u;
  lagged.pressing *= std::tanh(7.5 * speed / problem.parameters->slip_tolerance);
}

/// Ways of the unknowns since the start, and their slopes; angles as they do work, see `FrictionSetting::finite_turns`.
struct Ways {
  double way[kContactUnknowns], slope[kContactUnknowns];

  Ways(const ContactProblem& problem, const Touching& t) {
    problem.bodies.values(t.pair, problem.start->q, way);
    for (int i = 0; i < kContactUnknowns; ++i) {
      Dual<1> now = Dual<1>::unknown(t.now[i] - way[i], 0);
      if (i >= 12 && problem.finite_turns()) now = finite_turn(now);
      way[i] = now.value;
      slope[i] = now.slope[0];
    }
  }
};

/// Slip of the surfaces, with J of the start.
Vec3d lagged_slip(const ContactProblem& problem, const Touching& t) {
  const LaggedFriction& lagged = problem.lagged_friction[at(t.lagged)];
  const Ways ways(problem, t);
  Vec3d slip = -lagged.drift;
  for (int i = 0; i < kContactUnknowns; ++i) slip += ways.way[i] * lagged.column(i);
  return slip;
}

}  // namespace

LaggedFriction lag_friction(const ContactProblem& problem, const Touching& t) {
  LaggedFriction lagged{};
  lagged.pressing = -t.energy.first;
  set_slip(problem, t, lagged);
  const Vec3d turn = problem.turn_of(t.pair), &normal = t.proximity.normal;
  if (dot(turn, turn) > 0.0) {
    const ContactPair& pair = t.pair;
    const ClosestPoints& points = t.proximity.points;
    Vec3d x[4];
    t.end_points(x);
    lagged.turned = cross(turn, pair.curve() ? piece_obstacle_arm(pair, problem.bodies.obstacle(pair), x, points.s)
                                             : x[2] + points.t * (x[3] - x[2]) + pair.radius_b * normal - x[2]);
  }
  const Vec3d shift = problem.shift_of(t.pair) + lagged.turned;
  lagged.drift = shift - dot(shift, normal) * normal;
  if (problem.description().friction_law == FrictionLaw::semi_explicit) set_direction(problem, t.pair, lagged);
  return lagged;
}

Slipping lagged_slipping(const ContactProblem& problem, const Touching& t, double rate, const VectorX& change) {
  const LaggedFriction& lagged = problem.lagged_friction[at(t.lagged)];
  Slipping out;
  out.limit = t.pair.friction * lagged.pressing;
  out.slip = lagged_slip(problem, t);
  int dofs[kContactUnknowns];
  problem.surfaces->unknowns(t.pair, dofs);
  const Ways ways(problem, t);
  for (int i = 0; i < kContactUnknowns; ++i)
    if (dofs[i] >= 0) out.change += (ways.slope[i] * change(dofs[i])) * lagged.column(i);
  out.law = tanh_law(t.pair.friction, lagged.pressing, dot(out.slip, out.slip), rate);
  return out;
}

/// Lagged friction is mu N tanh(K |S| / (2 dt)) along the slip S of the step. Semi-explicit friction is mu N gamma
/// tanh(K s / (2 dt)) along the direction at the start. Here s = S . direction if that is positive, else 0.
/// The force is then constant while surfaces keep slipping, and vanishes if they slip back, so it never drives them.
LaggedForce lagged_force(const ContactProblem& problem, const Touching& t, double rate, const Vec3d* predicted) {
  const LaggedFriction& lagged = problem.lagged_friction[at(t.lagged)];
  const double limit = t.pair.friction * lagged.pressing;
  const Vec3d slip = lagged_slip(problem, t);
  LaggedForce out{};
  if (problem.description().friction_law == FrictionLaw::semi_explicit) {
    const Vec3d& d = lagged.direction;
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
  const ForceLaw g = tanh_law(t.pair.friction, lagged.pressing, square, rate);
  const Vec3d dual = g.dual_slip(slip, predicted, limit);
  out.force = g.factor * slip;
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l)
      out.slope[k][l] = (k == l ? g.factor : 0.0) + g.by_square * (slip[k] * dual[l] + dual[k] * slip[l]);
  out.sticking = rate * std::sqrt(square) < 7.5;
  return out;
}

void add_lagged_friction(const ContactProblem& problem, const Touching& t, double rate, const Vec3d* predicted,
                         bool with_hessian, ContactLocal& out) {
  const LaggedFriction& lagged = problem.lagged_friction[at(t.lagged)];
  const LaggedForce f = lagged_force(problem, t, rate, predicted);
  const double force[3] = {f.force.x, f.force.y, f.force.z};
  for (int i = 0; i < kContactUnknowns; ++i)
    for (int k = 0; k < 3; ++k) out.gradient[i] += lagged.slip[k][i] * force[k];
  if (!with_hessian) return;
  const Ways ways(problem, t);
  double back[3][kContactUnknowns];  // derivative of the force by the unknowns
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < kContactUnknowns; ++i) {
      back[k][i] = 0.0;
      for (int l = 0; l < 3; ++l) back[k][i] += ways.slope[i] * f.slope[k][l] * lagged.slip[l][i];
    }
  for (int i = 0; i < kContactUnknowns; ++i)
    for (int j = 0; j < kContactUnknowns; ++j)
      for (int k = 0; k < 3; ++k) out.hessian[i][j] += lagged.slip[k][i] * back[k][j];
}

}  // namespace withe
