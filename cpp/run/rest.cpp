#include "run/rest.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "geometry/rotation.hpp"
#include "run/hold.hpp"

namespace withe {
namespace {

// Number of attempts to find an equilibrium with stiffer contact.
constexpr int kMaxStiffenings = 8;
// Over what forces wanted of stiffness, what they may want where stiffer contact relieves surfaces.
constexpr double kMaxRelievedRatio = 0.9;
// A frame may turn by so much from the present state to the next on a path [rad]: rotations do not tell more than half
// a turn from less.
constexpr double kMaxTurnOnPath = 2.5;

/// Rotation vector of the turn of a support from one place to another that is left beside its roll.
Vector3 swing_between(const SupportMotion& from, const SupportMotion& to) {
  return rotation_log(to.rotation * rotation_exp(-to.roll) * from.rotation.transpose());
}

/// True if a hand that yields moves.
bool hands_move(const Model& model, const std::vector<SupportMotion>& from, const std::vector<SupportMotion>& to) {
  for (std::size_t s = 0; s < to.size(); ++s)
    if (model.supports[s].active && model.supports[s].yields() &&
        (from[s].position != to[s].position || from[s].rotation != to[s].rotation || to[s].roll != Vector3::Zero() ||
         from[s].fed != to[s].fed))
      return true;
  return false;
}

}  // namespace

void find_poses_between(const std::vector<SupportMotion>& from, const std::vector<SupportMotion>& to, double fraction,
                        std::vector<SupportPose>& out) {
  out.resize(to.size());
  for (std::size_t s = 0; s < to.size(); ++s) {
    out[s].position = from[s].position + fraction * (to[s].position - from[s].position);
    out[s].fed = from[s].fed + fraction * (to[s].fed - from[s].fed);
    out[s].rotation =
        rotation_exp(fraction * swing_between(from[s], to[s])) * from[s].rotation * rotation_exp(fraction * to[s].roll);
  }
}

void put(const std::vector<SupportPose>& poses, std::vector<SupportMotion>& motions) {
  for (std::size_t s = 0; s < motions.size(); ++s) motions[s].put(poses[s]);
}

void stop(SupportMotion& motion, double time) {
  motion.from_position = motion.to_position = motion.position;
  motion.from_rotation = motion.to_rotation = motion.rotation;
  motion.roll.setZero();
  motion.shift = motion.turn = {time, time};
  motion.fed_before = motion.fed;
  motion.feeds_since = time;
}

Boundary boundary_between(const Model& model, const Moving& now, Equations& system,
                          const std::vector<SupportMotion>& from, const std::vector<SupportMotion>& to,
                          Prescribed& out) {
  Boundary boundary{.prescribed = out};
  boundary.hold = [&model, &now, &system, &from, &to, poses = std::vector<SupportPose>{}, there = HeldTarget{}](
                      double present, double factor, VectorX& q) mutable {
    find_poses_between(from, to, factor, poses);
    hold(model, now, poses, there);
    for (std::size_t s = 0; s < to.size(); ++s) {
      const double turn = to[s].roll.norm() + swing_between(from[s], to[s]).norm();
      if (to[s].roll != Vector3::Zero() && std::abs(factor - present) * turn > kMaxTurnOnPath) there.reachable = false;
    }
    system.assembler().add_held_change(q, there.q, 1.0, q);
    return there.reachable;
  };
  if (hands_move(model, from, to))
    boundary.move = [&from, &to, &out](double factor) { find_poses_between(from, to, factor, out.supports); };
  return boundary;
}

bool drifts(const Model& model, const Parameters& parameters, const State& state, Equations& system,
            const Prescribed& given, StepData& e) {
  if (system.contact() || model.description.custom_implicit) return false;
  for (const Support& s : model.supports)
    if (s.active) return false;
  system.begin(state, parameters, StepRule::statics, 0.0, given);
  system.evaluate(state.q, true, nullptr, e);
  if (!e.residual.allFinite()) return false;
  constexpr double kMaxImbalance = 1e-6,
                   kMaxNeutralStiffness = 1e-12;  // over all forces there are; over the greatest stiffness
  VectorX along(model.dof_count), pull(model.dof_count);
  for (int axis = 0; axis < model.dimension; ++axis) {
    along.setZero();
    for (int dof : model.node_dof) along[dof + axis] = 1.0;
    const double force = along.dot(e.residual), scale = along.dot(e.magnitude);
    if (std::abs(force) <= kMaxImbalance * scale) continue;
    const auto size = static_cast<std::size_t>(model.dof_count);
    system.assembler().solver().multiply({along.data(), size}, {pull.data(), size});
    if (pull.cwiseAbs().maxCoeff() <= kMaxNeutralStiffness * system.assembler().greatest_diagonal()) return true;
  }
  return false;
}

bool even_contact(const Parameters& parameters, Equations& system, const Prescribed& given, bool arrived,
                  State& state) {
  if (!system.contact()) return true;
  system.begin(state, parameters, StepRule::statics, 0.0, given);
  system.contact()->update(state.q);
  system.contact()->accept_at_rest(state, arrived);
  return system.contact()->presses_alike();
}

void settle_contact(Equations& system, const Parameters& parameters, const Prescribed& given,
                    const std::function<StaticResult()>& find, State& state, StaticResult& r) {
  Contact& contact = *system.contact();
  const auto again = [&] {
    const StaticResult before = r;
    r = find();
    r.branch_changed = r.branch_changed || before.branch_changed;
    r.newton.iterations += before.newton.iterations;
  };
  int tries = 0;
  for (; r.converged && tries < kMaxStiffenings; ++tries) {
    if (contact.contacts().depth() > kMaxDepth) {
      contact.stiffen(state, true);  // contacts of a given stiffness; all others follow their forces
      even_contact(parameters, system, given, false, state);
    } else if (contact.presses_alike()) {
      break;
    }
    again();
  }
  for (; r.converged && tries < kMaxStiffenings; ++tries) {
    const State reached = state;
    const StaticResult found = r;
    const double wanted = contact.wanted_ratio();
    if (even_contact(parameters, system, given, true, state)) return;
    again();
    if (r.converged && (wanted == 1.0 || contact.wanted_ratio() < kMaxRelievedRatio * wanted)) continue;
    state = reached;
    r = found;
    return;
  }
}

std::string no_equilibrium(const Model& model, const StaticResult& result) {
  const bool held =
      std::any_of(model.supports.begin(), model.supports.end(), [](const Support& s) { return s.active; });
  const SceneDescription& description = model.description;
  const bool lies = !description.contact.obstacles.empty(), pulled = description.custom_implicit;
  return std::string("no static equilibrium was found") +
         (!held && lies     ? ", and only contact holds the scene, with friction that may be too low: clamp "
                              "or pin a node"
          : !held && pulled ? ", and only custom forces hold the scene: clamp or pin a node, unless the "
                              "custom forces are meant to hold the scene"
          : !held           ? ", and no support holds the scene: clamp or pin a node"
          : result.restless ? ": the scene does not come to rest; loads without a potential, such as moments "
                              "and follower forces, may drive the scene for ever"
                            : "");
}

}  // namespace withe
