/// Whether steps are short enough for what moves.
///
/// A mode of frequency w goes on by an angle 2 p in each midpoint step, tan p = w dt / 2: its velocity, A cos(2 p k) at
/// the ends of steps, changes within them by 2 A sin p as it swings, and by its energy it has
///   |v1 - v0|^2 / (2 |v0|^2 + 2 |v1|^2) = sin^2 p = (w dt / 2)^2 / (1 + (w dt / 2)^2),
/// both summed over steps. Modes are orthogonal in mass, so that of all that moves, with squares weighed by mass, it is
/// the mean of sin^2 p over the energy in motion: 0 where steps are short, 1 where they only see modes turn back and
/// forth. Stiff modes that carry no energy count for nothing, and it exceeds 1/5 only where some of the energy swings
/// with w dt > 1.
///
/// Under backward Euler amplitudes fall by (1 + (w dt)^2)^(-1/2) a step, too fast for a mean over phases. There
/// a1 - a0 = -w^2 dt v1 in every mode and at every phase, so that -dt v1 . (a1 - a0) / |v1|^2 is the mean of (w dt)^2;
/// it only counts where velocities change much, |v1 - v0|^2 > |v1|^2 / 2, for stiff modes make much of rounding.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/text.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

/// Steps of which the first ones are looked at, one after the other: where motion turns back it is slow for a few, and
/// from rest the first is all change. A run of 40 is looked at twice: what falls from rest does not vibrate at first.
constexpr int kPeriod = 24, kLooked = 16;
/// sin^2 p at w dt = 1.
constexpr double kResolved = 0.2;
/// |v1 - v0|^2 / |v1|^2 of backward Euler, see above.
constexpr double kChanging = 0.5;
/// Of a component's length, below which motion is a trembling that nobody sees.
constexpr double kSeen = 1e-5;
/// w dt of the step that would do; and the part of the time in which bending goes over an edge.
constexpr double kEnough = 0.5;
/// Over the step that an impact would bear, the one that is said: later ones may be faster.
constexpr double kMargin = 0.8;
/// Of a component's kinetic and elastic energy, what an impact turns round in a step so that its bounce is seen.
constexpr double kMuch = 0.1;

}  // namespace

/// Takes in a step of dt before it counts, whose end the state is. Surfaces that touch have times of their own, which
/// steps need not resolve, so that components that do are not looked at.
void World::Implementation::watch_step(double dt, const Equations& system) {
  const Integrator integrator = options.integrator;
  if (options.tolerance || integrator == Integrator::statics || integrator == Integrator::verlet) return;
  const double of_part = integrator == Integrator::fourth_order ? kFourthOrderParts.back() * dt : dt;
  if (!warnings.has_reported(Warning::impact) && integrator != Integrator::backward_euler)
    warnings.report(Warning::impact, unresolved_impact(of_part, system));
  const std::int64_t place = steps_taken % kPeriod;
  if (warnings.has_reported(Warning::steps) || place >= kLooked) return;
  sum_motion(of_part, place == 0, system);
  if (const Contact* contact = system.contact())
    for (const Touching& t : contact->contacts()) {
      forget_component(model.component_of_edge(t.pair.key.a));
      if (t.pair.key.b >= 0) forget_component(model.component_of_edge(t.pair.key.b));
    }
  if (place + 1 < kLooked) return;
  VectorX& greatest = step_watch.greatest;
  greatest = greatest.cwiseMax(step_watch.motion);
  for (int c = 0; c < model.component_count && !warnings.has_reported(Warning::steps); ++c)
    warnings.report(Warning::steps, unresolved_in_time(of_part, c));
}

/// Adds a step of dt to the sums over steps. The first step of a period resets the sums.
void World::Implementation::sum_motion(double dt, bool first, const Equations& system) {
  auto& [change, motion, greatest, pull, moved, before] = step_watch;
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

void World::Implementation::forget_component(int component) {
  auto& [change, motion, greatest, pull, moved, before] = step_watch;
  if (motion(component) == 0.0) return;
  change(component) = motion(component) = pull(component) = moved(component) = 0.0;
  for (Eigen::Index i = 0; i < before.size(); ++i)
    if (model.dof_component[at(static_cast<int>(i))] == component) before(i) = NAN;
}

/// Says so where steps of dt are too long for a component; nothing elsewhere.
std::string World::Implementation::unresolved_in_time(double dt, int component) const {
  const bool euler = options.integrator == Integrator::backward_euler;
  const double change = step_watch.change(component), motion = step_watch.motion(component);
  const double greatest = step_watch.greatest(component);
  // What is left of a motion that is over is a share of that.
  const double ratio = greatest > 0.0 ? change / greatest : 0.0;
  if (!(ratio > (euler ? kChanging : kResolved))) return "";
  // (w dt)^2
  const double square =
      euler ? step_watch.pull(component) / step_watch.moved(component) : 4.0 * ratio / std::max(1.0 - ratio, 1e-12);
  if (!(square > 1.0)) return "";
  double mass = 0.0, length = 0.0;
  for (int edge = 0; edge < model.edge_count; ++edge)
    if (model.component_of_edge(edge) == component) length += model.edge_length(edge);
  for (int node = 0; node < model.node_count; ++node)
    if (model.component_of_node(node) == component) mass += parameters.node_mass(node);
  const double frequency = std::sqrt(square) / dt;
  const double speed = std::sqrt((euler ? change + motion : 0.25 * motion) / (kLooked * mass));
  if (speed / frequency < kSeen * length) return "";
  const std::string motion_words = "motion of about " + text(speed / frequency, 2) + " m at " +
                                   text(frequency / (2.0 * std::numbers::pi), 3) + " Hz (time " + text(state.time, 6) +
                                   " s)";
  return "time_step of " + text(dt) + " s is too long: " +
         (euler ? "backward Euler damps a " + motion_words + " to half within " +
                      text(dt * 2.0 * std::numbers::ln2 / std::log1p(square)) + " s"
                : "frequency and phase of a " + motion_words + " are not accurate") +
         ". Use time_step <= " + text(kEnough / frequency, 2) + " s";
}

/// Says so where an impact takes up much of a component's motion, and a step of dt is longer than bending takes to go
/// from a node to the next, and than surfaces take to come through the tolerance of contact: nodes that strike one
/// after the other, and send waves to each other meanwhile, are all sent off together in such steps.
std::string World::Implementation::unresolved_impact(double dt, const Equations& system) {
  const Contact* contact = system.contact();
  if (!contact) return "";
  VectorX struck;
  double longest = 0.0;  // for an impact [s]
  int edge = -1;
  for (const Touching& t : contact->contacts()) {
    if (!(t.approach > 0.0) || t.pair.restitution < 1.0) continue;
    const double bending = std::max(bending_time(t.pair.key.a), t.pair.key.b < 0 ? 0.0 : bending_time(t.pair.key.b));
    const double most = std::max(kEnough * bending, t.pair.tolerance / t.approach);
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
  // What works harder than motion can is pressed by something else.
  const auto much = [&](const VectorX& energy) {
    return (struck.array() > kMuch * energy.array() && struck.array() <= kinetic.sum()).any();
  };
  if (!much(kinetic)) return "";
  find_component_energies(state, energy_scratch.components);
  if (!much(kinetic + energy_scratch.components.elastic)) return "";
  return "impact" + place_of_node(model.edge_tail[at(edge)]).words + " (time " + text(state.time, 6) +
         " s): the time_step of " + text(dt) +
         " s is longer than the impact, so the rebound height is not reliable. Use time_step <= " +
         text(kMargin * longest, 2) + " s, set restitution=, or use integrator='backward_euler' to damp impacts";
}

/// In which bending spreads over the length of an edge, h^2 sqrt(m / B) [s].
double World::Implementation::bending_time(int edge) const {
  const double length = model.edge_length(edge);
  return length * length * std::sqrt(parameters.edge_density(edge) / parameters.edge_bend.row(edge).minCoeff());
}

/// Which vibrations steps resolve: of each rod alone, clamped at one end and free of stress, w = b^2 sqrt(B / m) / L^2,
/// b = 1.875, and about (n - 1/2) pi of the nth [Euler and Bernoulli]. The slowest rod is said.
void World::Implementation::add_step_notes() {
  const bool euler = options.integrator == Integrator::backward_euler;
  if (options.tolerance || options.integrator == Integrator::statics || options.integrator == Integrator::verlet)
    return;
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
  if (!std::isfinite(slowest)) return;
  const double dt = options.time_step, first = 1.8751040687 * 1.8751040687 * slowest, angle = first * dt;
  const int resolved =
      angle > 1.0 ? 0 : std::max(1, static_cast<int>(std::lround(std::sqrt(1.0 / (slowest * dt)) / std::numbers::pi)));
  const double per_period = 1.0 - std::pow(1.0 + angle * angle, -std::numbers::pi / std::atan(angle));
  plan.notes.push_back("time_step of " + text(dt) + " s resolves less than " + text(0.5 / (std::numbers::pi * dt)) +
                       " Hz: of rod '" + description.rods[which].name + "' alone, clamped and unstressed, " +
                       std::to_string(resolved) + " mode(s) of bending, from " +
                       text(first / (2.0 * std::numbers::pi)) + " Hz on");
  if (euler)
    plan.notes.push_back("backward Euler damps the first of these modes by " + text(100.0 * per_period, 2) +
                         " % a period");
}

}  // namespace withe
