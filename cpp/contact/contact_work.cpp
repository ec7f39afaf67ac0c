#include "contact/contact_work.hpp"

#include "contact/contact_friction.hpp"
#include "contact/contact_stiffness.hpp"
#include "contact/pressing.hpp"

namespace withe {
namespace {

/// Calls visit(k, unknown) for each unknown k of a contact that is one of the scene's.
template <class Visit>
void for_each_unknown(const ContactProblem& problem, const ContactPair& pair, const Visit& visit) {
  int dofs[kContactUnknowns];
  problem.surfaces->unknowns(pair, dofs);
  for (int k = 0; k < kContactUnknowns; ++k)
    if (dofs[k] >= 0) visit(k, dofs[k]);
}

/// Minus the force on the nodes beside an obstacle, and so that on it [N].
Vec3d force_on_nodes(const ContactPair& pair, const ContactLocal& local) {
  Vec3d sum{};
  for (int i = 0; i < (pair.curve() ? 9 : 6); i += 3)
    sum += Vec3d{local.gradient[i], local.gradient[i + 1], local.gradient[i + 2]};
  return sum;
}

double work_against(const ContactProblem& problem, const ContactPair& pair, const ContactLocal& local,
                    const VectorX& change) {
  double work = 0.0;
  for_each_unknown(problem, pair, [&](int k, int unknown) { work += local.gradient[k] * change(unknown); });
  return pair.key.b < 0 ? work - dot(problem.shift_of(pair), force_on_nodes(pair, local)) : work;
}

bool add_friction_alone(const ContactProblem& problem, const Touching& t, ContactLocal& out) {
  return add_friction(problem, t, {}, false, out);
}

}  // namespace

double pressing_gain(const ContactProblem& problem, const ContactSet& set, const VectorX& change) {
  double gain = set.pressing_energy() - problem.start_pressing;
  for (const Touching& t : set) {
    if (t.lagged >= 0) continue;
    if (t.struck()) {  // impulses balance its work
      gain -= t.energy.value;
      continue;
    }
    ContactLocal local{};
    add_pressing(problem, t, false, true, local);
    gain -= work_against(problem, t.pair, local, change);
  }
  return gain;
}

void friction_force(const ContactProblem& problem, const ContactSet& set, VectorX& out) {
  if (!problem.frictional()) return;
  out.setZero(problem.model().dof_count);
  for (const Touching& t : set) {
    ContactLocal local{};
    if (!add_friction_alone(problem, t, local)) continue;
    for_each_unknown(problem, t.pair, [&](int k, int unknown) { out(unknown) += local.gradient[k]; });
  }
}

void contact_force(const ContactProblem& problem, const ContactSet& set, VectorX& out) {
  out.setZero(problem.model().dof_count);
  ContactLocal local;
  for (const Touching& t : set) {
    contact_local(problem, t, {}, false, local);
    for_each_unknown(problem, t.pair, [&](int k, int unknown) { out(unknown) += local.gradient[k]; });
  }
}

double mean_friction_loss(const ContactProblem& problem, const ContactSet& set, const VectorX& change,
                          const VectorX& start, const VectorX& end) {
  if (!problem.frictional() || start.size() != end.size()) return friction_loss(problem, set, change);
  double loss = 0.5 * (start.dot(change) + end.dot(change));
  for (const Touching& t : set) {
    if (!t.pair.rubs()) continue;
    if (!problem.shift.empty() || !problem.turn.empty()) {
      ContactLocal local{};
      if (add_friction_alone(problem, t, local))
        loss += turning_work(problem, t) - dot(problem.shift_of(t.pair), force_on_nodes(t.pair, local));
    }
    if (problem.anchored()) loss -= anchor_work(problem, t, true);
  }
  return loss;
}

double friction_loss(const ContactProblem& problem, const ContactSet& set, const VectorX& change) {
  double loss = 0.0;
  for (const Touching& t : set) {
    ContactLocal local{};
    if (!add_friction_alone(problem, t, local)) continue;
    loss += work_against(problem, t.pair, local, change) + turning_work(problem, t);
    if (problem.anchored()) loss -= anchor_work(problem, t, false);
  }
  return loss;
}

double obstacle_work(const ContactProblem& problem, const ContactSet& set) {
  double work = 0.0;
  if (!problem.turn.empty())
    for (const Touching& t : set) work += turning_work(problem, t);
  if (problem.shift.empty()) return work;
  ContactLocal local;
  for (const Touching& t : set) {
    const Vec3d shift = problem.shift_of(t.pair);
    if (dot(shift, shift) == 0.0) continue;
    contact_local(problem, t, {}, false, local);
    work -= dot(shift, force_on_nodes(t.pair, local));
  }
  return work;
}

}  // namespace withe
