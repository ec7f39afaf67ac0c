#include "contact/contact_friction.hpp"

#include <algorithm>
#include <cmath>

#include "contact/friction_jacobian.hpp"
#include "contact/lagged_friction.hpp"
#include "contact/plane_contact.hpp"

namespace withe {
namespace {

// Elastic slip of an anchor at Coulomb's limit, over the distance tolerance.
constexpr double kAnchorSlip = 0.05;
// Displacement in an iteration, over the slip with which friction grows, up to which the tangent of the friction law
// needs no prediction.
constexpr double kMaxTangentSlip = 0.1;

double coefficient(const ContactPair& pair, FrictionKind kind) {
  return kind == FrictionKind::rolling ? pair.rolling : pair.friction;
}

const Vec3d& start_of_anchor(const Touching& t, FrictionKind kind) {
  return kind == FrictionKind::rolling ? t.roll : t.stick;
}

FrictionForce<double> friction_now(const ContactProblem& problem, const Touching& t, FrictionKind kind) {
  if (beside_plane(problem, t)) return plane_friction(problem, t, slip_rate(problem, 1.0));
  return slipping_surfaces(friction_setting(problem, t, kind, 1.0, nullptr), t.now).friction;
}

/// Calls see(kind) for friction of each kind that a contact has.
template <class See>
void each_kind(const Touching& t, const See& see) {
  for (const FrictionKind kind : kFrictionKinds)
    if (coefficient(t.pair, kind) > 0.0) see(kind);
}

}  // namespace

double slip_rate(const ContactProblem& problem, double regularisation) {
  return 7.5 / (regularisation * problem.parameters->slip_tolerance * problem.duration);
}

/// Lagged friction acts on contacts of the start, and does not resist rolling.
bool has_friction(const ContactProblem& problem, const Touching& t, FrictionKind kind) {
  if (kind == FrictionKind::rolling && problem.lags()) return false;
  return coefficient(t.pair, kind) > 0.0 && (t.lagged >= 0) == problem.lags();
}

bool rubs(const ContactProblem& problem, const Touching& t) {
  return has_friction(problem, t, FrictionKind::slipping) || has_friction(problem, t, FrictionKind::rolling);
}

bool regularises_friction(const Model& model) {
  const FrictionLaw law = model.description.contact.friction_law;
  return law == FrictionLaw::implicit || law == FrictionLaw::lagged;
}

double anchor_stiffness(const ContactPair& pair, FrictionKind kind, double stiffness) {
  const double pressing = stiffness * 2.0 * kDepth * pair.scale;
  return coefficient(pair, kind) * pressing / (kAnchorSlip * pair.tolerance);
}

FrictionSetting friction_setting(const ContactProblem& problem, const Touching& t, FrictionKind kind,
                                 double regularisation, const Vec3d* predicted) {
  const bool rolling = kind == FrictionKind::rolling;
  const ContactDescription& contact = problem.description();
  const Model& model = problem.model();
  const ContactPair& pair = t.pair;
  FrictionSetting f;
  f.pair = &pair;
  if (pair.key.b < 0) f.obstacle = &problem.bodies.obstacle(pair);
  f.friction = coefficient(pair, kind);
  f.rolling = rolling;
  f.isotropic = rolling || pair.isotropic();
  f.points = t.proximity.points;
  if (pair.curve()) f.curve = &t.proximity.curve;
  f.pressing = t.law;
  f.before = t.before;
  f.middle = pair.key.b >= 0 && problem.turns(pair);
  f.finite_turns = problem.finite_turns();
  f.law = contact.friction_law;
  f.tangential_stiffness = anchor_stiffness(pair, kind, t.stiffness);
  f.rate = slip_rate(problem, regularisation);
  f.stick = start_of_anchor(t, kind);
  f.spatial = !model.planar();
  f.centreline = contact.centreline_friction;
  if (!rolling) f.drift = problem.shift_of(pair);
  f.turn = problem.turn_of(pair);
  f.predicted = predicted;
  problem.bodies.values(pair, problem.start->q, f.start);
  if (!f.spatial) return f;
  if (pair.curve()) {
    for (int b = 0; b < pair.piece.weights->edges; ++b) f.source[b] = problem.start->tangent[at(pair.piece.edge[b])];
    return f;
  }
  f.source[0] = problem.start->tangent[at(pair.key.a)];
  if (pair.key.b >= 0) f.source[1] = problem.start->tangent[at(pair.key.b)];
  return f;
}

double friction_slope(const ContactProblem& problem, const Touching& t, const ContactLinearisation& linearisation) {
  const double mu = t.pair.friction;
  if (!t.pair.rubs()) return 0.0;
  const double rate = slip_rate(problem, linearisation.regularisation);
  if (t.lagged >= 0) return mu * problem.lagged_friction[at(t.lagged)].pressing * rate;
  if (problem.lags()) return 0.0;
  if (!problem.anchored()) return -(mu + t.pair.rolling) * t.pressing.first * rate;
  double slope = 0.0;
  for (const FrictionKind kind : kFrictionKinds) slope += anchor_stiffness(t.pair, kind, t.stiffness);
  return slope;
}

bool add_friction(const ContactProblem& problem, const Touching& t, const ContactLinearisation& linearisation,
                  bool with_hessian, ContactLocal& out) {
  if (!rubs(problem, t)) return false;
  if (beside_plane(problem, t)) {
    add_plane_contact(problem, t, PlaneForces::friction, linearisation, with_hessian, out);
    return true;
  }
  if (t.lagged >= 0) {
    const Vec3d* predicted = linearisation.friction.of(t.pair.key);
    add_lagged_friction(problem, t, slip_rate(problem, linearisation.regularisation), predicted, with_hessian, out);
    return true;
  }
  each_kind(t, [&](FrictionKind kind) {
    const Vec3d* predicted = with_hessian ? linearisation.predicted(kind).of(t.pair.key) : nullptr;
    const FrictionSetting f = friction_setting(problem, t, kind, linearisation.regularisation, predicted);
    const SlippingSurfaces<double> surfaces = slipping_surfaces(f, t.now);
    add_friction_gradient(f, surfaces, out.gradient);
    if (with_hessian && t.pair.face != nullptr)
      add_face_friction_jacobian(f, t.now, out.hessian);
    else if (with_hessian)
      add_friction_jacobian(f, surfaces, out.hessian);
  });
  return true;
}

double anchor_work(const ContactProblem& problem, const Touching& t, bool mean) {
  double work = 0.0;
  each_kind(t, [&](FrictionKind kind) {
    const FrictionForce<double> now = friction_now(problem, t, kind);
    const Vec3d& start = start_of_anchor(t, kind);
    const Vec3d way = now.stick - start;
    const Vec3d before = mean ? anchor_stiffness(t.pair, kind, t.stiffness) * start : now.force;
    work += 0.5 * dot(before + now.force, way);
  });
  return work;
}

double anchor_energy(const ContactProblem& problem, const Touching& t) {
  if (!problem.anchored() || !t.pair.rubs() || !problem.touch(t.pair, t.proximity.distance, t.yielded)) return 0.0;
  double stored = 0.0;
  each_kind(t, [&](FrictionKind kind) {
    const FrictionForce<double> anchor = friction_now(problem, t, kind);
    stored += 0.5 * dot(anchor.force, anchor.stick);
  });
  return stored;
}

double kept_anchor_energy(const ContactProblem& problem, const Touching& t) {
  if (!problem.anchored() || !t.pair.rubs()) return 0.0;
  const double rolled = 0.5 * anchor_stiffness(t.pair, FrictionKind::rolling, t.stiffness) * dot(t.roll, t.roll);
  const double stiffness = anchor_stiffness(t.pair, FrictionKind::slipping, t.stiffness);
  if (t.pair.isotropic()) return rolled + 0.5 * stiffness * dot(t.stick, t.stick);
  const FrictionSetting f = friction_setting(problem, t, FrictionKind::slipping, 1.0, nullptr);
  SlippingSurfaces<double> c = slipping_surfaces(f, t.now);
  c.friction.force = stiffness * t.stick;
  direct_friction(f, c);
  return rolled + 0.5 * dot(c.friction.force, t.stick);
}

/// Work of friction on the obstacle: the opposite of the force on a, times the displacement of the surface.
double turning_work(const ContactProblem& problem, const Touching& t) {
  const Vec3d turn = problem.turn_of(t.pair);
  if (!t.pair.rubs() || dot(turn, turn) == 0.0) return 0.0;
  if (t.lagged >= 0)
    return -dot(lagged_force(problem, t, slip_rate(problem, 1.0), nullptr).force,
                problem.lagged_friction[at(t.lagged)].turned);
  if (problem.lags()) return 0.0;
  Vec3d x[4];
  t.end_points(x);
  double work = 0.0;
  each_kind(t, [&](FrictionKind kind) {
    const FrictionSetting f = friction_setting(problem, t, kind, 1.0, nullptr);
    const SlippingSurfaces<double> c = slipping_surfaces(f, t.now);
    work -= dot(c.friction.force, cross(turn, obstacle_arm(f, c, x)));
  });
  return work;
}

void record_friction(const ContactProblem& problem, const Touching& t, ContactRecord& record) {
  if (!problem.frictional() || problem.lags()) return;
  each_kind(t, [&](FrictionKind kind) {
    const FrictionForce<double> f = friction_now(problem, t, kind);
    if (kind == FrictionKind::rolling) {
      record.roll = f.stick;
      return;
    }
    record.stick = f.stick;
    record.friction = -f.force;
    record.sticking = f.sticking;
  });
}

void record_lagged_friction(const ContactProblem& problem, const Touching& t, ContactRecord& record) {
  const LaggedForce f = lagged_force(problem, t, slip_rate(problem, 1.0), nullptr);
  record.friction = -f.force;
  record.sticking = f.sticking;
}

Slipping slipping(const ContactProblem& problem, const Touching& t, FrictionKind kind,
                  const ContactLinearisation& linearisation, const VectorX& change) {
  const double rate = slip_rate(problem, linearisation.regularisation);
  if (t.lagged >= 0) return lagged_slipping(problem, t, rate, change);
  if (beside_plane(problem, t)) return plane_slipping(problem, t, rate, change);
  const FrictionSetting f = friction_setting(problem, t, kind, linearisation.regularisation, nullptr);
  int dofs[kContactUnknowns];
  problem.surfaces->unknowns(t.pair, dofs);
  Dual<1> unknown[kContactUnknowns];
  for (int i = 0; i < kContactUnknowns; ++i) {
    unknown[i] = t.now[i];
    if (dofs[i] >= 0) unknown[i].slope[0] = change(dofs[i]);
  }
  const SlippingSurfaces<Dual<1>> surfaces = slipping_surfaces(f, unknown);
  const Vec3<Dual<1>> way = whole_way(f, surfaces), slip = way - dot(way, surfaces.normal) * surfaces.normal;
  Slipping out;
  out.limit = f.friction * surfaces.pressing.value;
  out.slip = {slip.x.value, slip.y.value, slip.z.value};
  out.change = {slip.x.slope[0], slip.y.slope[0], slip.z.slope[0]};
  out.law = force_law(f, surfaces.pressing.value, dot(out.slip, out.slip), surfaces.friction.sticking);
  return out;
}

bool slips_shortly(const ContactProblem& problem, const ContactLinearisation& linearisation, const VectorX& change) {
  return farthest(problem.model(), change) * slip_rate(problem, linearisation.regularisation) < kMaxTangentSlip;
}

}  // namespace withe
