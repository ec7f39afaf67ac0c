#include "run/step_watch.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/text.hpp"
#include "run/places.hpp"

namespace withe {
namespace {

/// Steps in a period, and steps at its start that are summed. A sum over several steps is needed because a motion that
/// turns back is slow for a few steps, and the first step from rest is all change. A run of 40 steps is judged twice: a
/// body that falls from rest does not vibrate at first.
constexpr int kPeriod = 24, kWatchedSteps = 16;
/// sin^2 p at w dt = 1.
constexpr double kMaxResolved = 0.2;
/// |v1 - v0|^2 / |v1|^2 of backward Euler, see above.
constexpr double kMinChange = 0.5;
/// Amplitude below which motion is not visible, as a share of the component's length.
constexpr double kMinVisibleMove = 1e-5;
/// w dt of the step that is recommended, and its share of the time in which bending passes an edge.
constexpr double kRecommendedTurn = 0.5;
/// Recommended step over the longest step that resolves an impact: later impacts may be faster.
constexpr double kImpactMargin = 0.8;
/// Work of an impact in a step whose rebound is visible, over the component's kinetic and elastic energy.
constexpr double kMinImpactShare = 0.1;

/// Time in which bending spreads over the length h of an edge, h^2 sqrt(m / B) [s]; 0 of a rigid body.
double bending_time(const Model& model, const Parameters& parameters, int edge) {
  if (model.is_surface(edge)) return 0.0;
  const double length = model.edge_length(edge);
  return length * length * std::sqrt(parameters.edge_density(edge) / parameters.edge_bend.row(edge).minCoeff());
}

/// Adds a step to the sums over steps; `dt` is the length of its longest part. The first step of a period resets the
/// sums.
void sum_motion(const SolvedStep& step, double dt, StepWatch& watch) {
  auto& [change, motion, greatest, pull, moved, before] = watch;
  const auto& [model, options, parameters, state, system, whole, number] = step;
  const bool first = number % kPeriod == 0;
  if (first || change.size() != model.component_count)
    for (VectorX* sum : {&change, &motion, &pull, &moved}) sum->setZero(model.component_count);
  if (greatest.size() != change.size()) greatest.setZero(change.size());
  const bool euler = options.integrator == Integrator::backward_euler,
             follows = euler && !first && before.size() == state.v.size();
  const VectorX& mass = system.mass().rows;
  for (Eigen::Index i = 0; i < state.v.size(); ++i) {
    const int component = model.dof_component[at(static_cast<int>(i))];
    const double after = state.v(i), within = dt * state.acceleration(i), own = mass(i) * after * after;
    change(component) += mass(i) * within * within;
    if (!euler) {
      motion(component) += 2.0 * (mass(i) * (after - within) * (after - within) + own);
      continue;
    }
    motion(component) += own;
    if (!follows || std::isnan(before(i))) continue;
    pull(component) -= dt * mass(i) * after * (state.acceleration(i) - before(i));
    moved(component) += own;
  }
  if (euler) before = state.acceleration;
}

/// Leaves a component out of this period.
void forget_component(const Model& model, int component, StepWatch& watch) {
  auto& [change, motion, greatest, pull, moved, before] = watch;
  if (motion(component) == 0.0) return;
  change(component) = motion(component) = pull(component) = moved(component) = 0.0;
  for (Eigen::Index i = 0; i < before.size(); ++i)
    if (model.dof_component[at(static_cast<int>(i))] == component) before(i) = NAN;
}

/// Warning that steps are too long for a component; empty where they are not.
std::string unresolved_in_time(const SolvedStep& step, double dt, int component, const StepWatch& watch) {
  const auto& [model, options, parameters, state, system, whole, number] = step;
  const bool euler = options.integrator == Integrator::backward_euler;
  const double change = watch.change(component), motion = watch.motion(component);
  const double greatest = watch.greatest(component);
  // The greatest sum so far: little is left of a motion that is over.
  const double ratio = greatest > 0.0 ? change / greatest : 0.0;
  if (!(ratio > (euler ? kMinChange : kMaxResolved))) return "";
  // (w dt)^2
  const double square =
      euler ? watch.pull(component) / watch.moved(component) : 4.0 * ratio / std::max(1.0 - ratio, 1e-12);
  if (!(square > 1.0)) return "";
  double mass = 0.0, length = 0.0;
  for (int edge = 0; edge < model.edge_count; ++edge)
    if (model.component_of_edge(edge) == component) length += model.edge_length(edge);
  for (int node = 0; node < model.node_count; ++node)
    if (model.component_of_node(node) == component) mass += parameters.node_mass(node);
  const double frequency = std::sqrt(square) / dt;
  const double speed = std::sqrt((euler ? change + motion : 0.25 * motion) / (kWatchedSteps * mass));
  if (speed / frequency < kMinVisibleMove * length) return "";
  const std::string motion_words = "motion of about " + text(speed / frequency, 2) + " m at " +
                                   text(frequency / (2.0 * std::numbers::pi), 3) + " Hz (time " + text(state.time, 6) +
                                   " s)";
  return "time_step of " + text(dt) + " s is too long: " +
         (euler ? "backward Euler damps a " + motion_words + " to half within " +
                      text(dt * 2.0 * std::numbers::ln2 / std::log1p(square)) + " s"
                : "frequency and phase of a " + motion_words + " are not accurate") +
         ". Use time_step <= " + text(kRecommendedTurn / frequency, 2) + " s";
}

/// Warning of an impact that takes up much of a component's motion and is shorter than a step. Bending then needs less
/// time from one node to the next, and surfaces less time to come through the tolerance of contact. Nodes that strike
/// one after the other, and send waves to each other meanwhile, all rebound together in such a step. Empty where there
/// is no such impact.
std::string unresolved_impact(const SolvedStep& step, double dt, EnergyScratch& scratch) {
  const auto& [model, options, parameters, state, system, whole, number] = step;
  const Contact* contact = system.contact();
  if (!contact) return "";
  VectorX struck;
  double longest = 0.0;  // for an impact [s]
  int edge = -1;
  for (const Touching& t : contact->contacts()) {
    if (!(t.approach > 0.0) || t.pair.restitution < 1.0) continue;
    const double bending = std::max(bending_time(model, parameters, t.pair.key.a),
                                    t.pair.key.b < 0 ? 0.0 : bending_time(model, parameters, t.pair.key.b));
    const double most = std::max(kRecommendedTurn * bending, t.pair.tolerance / t.approach);
    if (dt <= most) continue;
    if (struck.size() == 0) struck.setZero(model.component_count);
    const double work = -0.5 * t.pressing.first * dt * t.approach;
    struck(model.component_of_edge(t.pair.key.a)) += work;
    if (t.pair.key.b >= 0) struck(model.component_of_edge(t.pair.key.b)) += work;
    if (edge >= 0 && most >= longest) continue;
    longest = most;
    edge = t.pair.key.a;
  }
  if (edge < 0) return "";
  VectorX kinetic = VectorX::Zero(struck.size());
  const VectorX start = state.v - dt * state.acceleration;
  for (Eigen::Index i = 0; i < start.size(); ++i)
    kinetic(model.dof_component[at(static_cast<int>(i))]) += 0.5 * system.mass().rows(i) * start(i) * start(i);
  // A force that does more work than the motion has energy presses: it is no impact.
  const auto much = [&](const VectorX& energy) {
    return (struck.array() > kMinImpactShare * energy.array() && struck.array() <= kinetic.sum()).any();
  };
  if (!much(kinetic)) return "";
  find_component_energies(model, parameters, state, scratch);
  if (!much(kinetic + scratch.components.elastic)) return "";
  return "impact" + place_of_node(model, model.edge_tail[at(edge)]).words + " (time " + text(state.time, 6) +
         " s): the time_step of " + text(dt) +
         " s is longer than the impact, so the rebound height is not reliable. Use time_step <= " +
         text(kImpactMargin * longest, 2) + " s, set restitution=, or use integrator='backward_euler' to damp impacts";
}

}  // namespace

void watch_step(const SolvedStep& step, StepWatch& watch, Warnings& warnings, EnergyScratch& scratch) {
  const Model& model = step.model;
  const Integrator integrator = step.options.integrator;
  if (step.options.tolerance || integrator == Integrator::statics || integrator == Integrator::verlet) return;
  const double dt = integrator == Integrator::fourth_order ? kFourthOrderParts.back() * step.dt : step.dt;
  if (!warnings.has_reported(Warning::impact) && integrator != Integrator::backward_euler)
    warnings.report(Warning::impact, unresolved_impact(step, dt, scratch));
  const std::int64_t place = step.number % kPeriod;
  if (warnings.has_reported(Warning::steps) || place >= kWatchedSteps) return;
  sum_motion(step, dt, watch);
  if (const Contact* contact = step.system.contact())
    for (const Touching& t : contact->contacts()) {
      forget_component(model, model.component_of_edge(t.pair.key.a), watch);
      if (t.pair.key.b >= 0) forget_component(model, model.component_of_edge(t.pair.key.b), watch);
    }
  if (place + 1 < kWatchedSteps) return;
  watch.greatest = watch.greatest.cwiseMax(watch.motion);
  for (int c = 0; c < model.component_count && !warnings.has_reported(Warning::steps); ++c)
    warnings.report(Warning::steps, unresolved_in_time(step, dt, c, watch));
}

std::vector<std::string> step_notes(const Model& model, const Options& options, const Parameters& parameters) {
  const bool euler = options.integrator == Integrator::backward_euler;
  if (options.tolerance || options.integrator == Integrator::statics || options.integrator == Integrator::verlet)
    return {};
  double slowest = INFINITY;
  std::size_t which = 0;
  for (std::size_t r = 0; r + 1 < model.rod_first_edge.size(); ++r) {
    const int first = model.rod_first_edge[r], count = model.rod_first_edge[r + 1] - first;
    const double length = model.edge_length.segment(first, count).sum();
    const double bend = parameters.edge_bend.middleRows(first, count).minCoeff();
    const double mass = parameters.edge_density.segment(first, count).mean();
    const double unit = std::sqrt(bend / mass) / (length * length);
    if (!(unit > 0.0) || unit >= slowest) continue;
    slowest = unit;
    which = r;
  }
  if (!std::isfinite(slowest)) return {};
  const double dt = options.time_step, first = 1.8751040687 * 1.8751040687 * slowest, angle = first * dt;
  const int resolved =
      angle > 1.0 ? 0 : std::max(1, static_cast<int>(std::lround(std::sqrt(1.0 / (slowest * dt)) / std::numbers::pi)));
  const double per_period = 1.0 - std::pow(1.0 + angle * angle, -std::numbers::pi / std::atan(angle));
  std::vector<std::string> notes;
  const std::string modes = resolved == 0   ? "no bending mode"
                            : resolved == 1 ? "one bending mode"
                                            : std::to_string(resolved) + " bending modes";
  notes.push_back("time_step of " + text(dt) + " s resolves vibrations below " + text(0.5 / (std::numbers::pi * dt)) +
                  " Hz; rod '" + model.description.rods[which].name + "', clamped and alone, has " + modes +
                  " there; the first is at " + text(first / (2.0 * std::numbers::pi)) + " Hz");
  if (euler)
    notes.push_back("backward Euler damps the first of these modes by " + text(100.0 * per_period, 2) + " % a period");
  return notes;
}

}  // namespace withe
