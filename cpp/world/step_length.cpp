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
/// Of the scene's length, below which motion is a trembling that nobody sees.
constexpr double kSeen = 1e-5;
/// w dt of the step that would do.
constexpr double kEnough = 0.5;

}  // namespace

/// Takes in a step of dt before it counts, whose end the state is. Surfaces that touch have times of their own, which
/// steps need not resolve.
void World::Implementation::watch_step(double dt, const Equations& system) {
  const Integrator integrator = options.integrator;
  if (step_warning || options.tolerance || integrator == Integrator::statics || integrator == Integrator::verlet)
    return;
  const std::int64_t place = steps_taken % kPeriod;
  if (place >= kLooked) return;
  auto& [change, motion, greatest, pull, moved, before] = step_watch;
  if (place == 0) change = motion = pull = moved = 0.0;
  if (const Contact* contact = system.contact(); contact && contact->count() > 0) {
    change = motion = pull = moved = 0.0;
    before.resize(0);
    return;
  }
  if (integrator == Integrator::fourth_order) dt *= kFourthOrderParts.back();
  const auto mass = system.mass().rows.array();
  const auto after = state.v.array();
  const auto within = dt * state.acceleration.array();
  change += (mass * within.square()).sum();
  if (integrator == Integrator::backward_euler) {
    const double square = (mass * after.square()).sum();
    motion += square;
    if (place > 0 && before.size() == state.v.size()) {
      pull -= dt * (mass * after * (state.acceleration - before).array()).sum();
      moved += square;
    }
    before = state.acceleration;
  } else {
    motion += 2.0 * (mass * ((after - within).square() + after.square())).sum();
  }
  if (place + 1 < kLooked) return;
  greatest = std::max(greatest, motion);
  if (std::string found = unresolved_in_time(dt); !found.empty()) step_warning = std::move(found);
}

/// Says so where steps of dt are too long; nothing elsewhere.
std::string World::Implementation::unresolved_in_time(double dt) const {
  const auto& [change, motion, greatest, pull, moved, before] = step_watch;
  const bool euler = options.integrator == Integrator::backward_euler;
  // What is left of a motion that is over is a share of that.
  const double ratio = greatest > 0.0 ? change / greatest : 0.0;
  if (!(ratio > (euler ? kChanging : kResolved))) return "";
  const double square = euler ? pull / moved : 4.0 * ratio / std::max(1.0 - ratio, 1e-12);  // (w dt)^2
  if (!(square > 1.0)) return "";
  const double frequency = std::sqrt(square) / dt, mass = parameters.node_mass.sum();
  const double speed = std::sqrt((euler ? change + motion : 0.25 * motion) / (kLooked * mass));
  if (speed / frequency < kSeen * model.length_scale) return "";
  const std::string decay =
      euler ? "backward Euler damps it to half within " + text(dt * 2.0 * std::numbers::ln2 / std::log1p(square)) + " s"
            : std::string("frequencies and phases of that mean nothing");
  return "steps of " + text(dt) + " s are too long for what moves, by about " + text(speed / frequency, 2) + " m at " +
         text(frequency / (2.0 * std::numbers::pi), 3) + " Hz (time " + text(state.time, 6) + " s): " + decay +
         "; a time_step of " + text(kEnough / frequency, 2) + " s would do";
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
  plan.notes.push_back("steps of " + text(dt) + " s resolve less than " + text(0.5 / (std::numbers::pi * dt)) +
                       " Hz: of rod '" + description.rods[which].name + "' alone, clamped and unstressed, " +
                       std::to_string(resolved) + " mode(s) of bending, from " +
                       text(first / (2.0 * std::numbers::pi)) + " Hz on");
  if (euler)
    plan.notes.push_back("backward Euler damps the first of these by " + text(100.0 * per_period, 2) + " % a period");
}

}  // namespace withe
