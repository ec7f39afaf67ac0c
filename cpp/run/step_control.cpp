#include "run/step_control.hpp"

#include <algorithm>
#include <cmath>

namespace withe {
namespace {

// Easy parts before longer ones are tried, at most.
constexpr int kMaxPatience = 64;
// Halvings with which error control begins where there is nothing to estimate errors from.
constexpr int kFirstHalvings = 8;
// Share of the tolerance that is kept for events; share of the duration over which parts are averaged.
constexpr double kEventShare = 0.2, kAveraging = 1.0 / 64.0;
// Share of the allowed error that a longer part may be expected to have.
constexpr double kSafety = 0.8;
// Errors below this share of the allowed one are mostly rounding.
constexpr double kRoundingShare = 0.01;
// Part of the greatest error rate that a step forgets: an oscillation has no error twice a period.
constexpr double kForgetting = 1.0 / 256.0;

/// Power of a step's length that its error goes with.
double local_order(Integrator integrator) {
  switch (integrator) {
    case Integrator::backward_euler:
      return 2.0;
    case Integrator::fourth_order:
      return 5.0;
    default:
      return 3.0;
  }
}

}  // namespace

StepControl::StepControl(const Options& options)
    : adaptive_(options.adaptive),
      explicit_(options.integrator == Integrator::verlet),
      max_halvings_(options.max_halvings),
      order_(local_order(options.integrator)),
      tolerance_(options.tolerance),
      duration_(options.duration.value_or(1.0)) {}

double StepControl::parts_at(int level) const { return std::exp2(static_cast<double>(level) / levels_per_halving()); }

Division StepControl::divided(const Division& division, int level) const {
  const double from = division.reached();
  return {from, std::max(1L, static_cast<long>(std::ceil((1.0 - from) * parts_at(level) - 1e-9))), 0};
}

StepProgress StepControl::begin(StepLengths lengths, bool has_history) const {
  if (!adaptive_ && !tolerance_) lengths.level = 0;
  if (tolerance_ && !has_history)
    lengths.level = std::max(lengths.level, levels_per_halving() * std::min(max_halvings_, kFirstHalvings));
  return {lengths, divided({}, lengths.level)};
}

bool StepControl::may_subdivide(const StepLengths& lengths) const {
  return (adaptive_ || tolerance_) && !explicit_ && lengths.level < deepest_level();
}

StepProgress StepControl::subdivide(StepProgress now, Verdict why) const {
  StepLengths& lengths = now.lengths;
  const long left = now.division.parts - now.division.done;
  const int deeper = why == Verdict::inaccurate ? (levels_per_halving() + 1) / 2 : levels_per_halving();
  lengths.level = std::min(lengths.level + deeper, deepest_level());
  Division shorter = divided(now.division, lengths.level);
  while (shorter.parts <= left && may_subdivide(lengths)) shorter = divided(now.division, ++lengths.level);
  if (why == Verdict::gained_energy && lengths.grown) lengths.patience = std::min(2 * lengths.patience, kMaxPatience);
  lengths.grown = false;
  lengths.easy_steps = 0;
  return {lengths, shorter};
}

StepProgress StepControl::advance(StepProgress now, Verdict verdict, double dt) const {
  ++now.division.done;
  const int before = now.lengths.level;
  if (verdict == Verdict::easy)
    now = grown(now, dt);
  else
    now.lengths.easy_steps = 0;
  if (now.lengths.level < before && !now.division.finished()) now.division = divided(now.division, now.lengths.level);
  return now;
}

/// Parts grow back after `patience` easy ones; where they then gain energy at once, after twice as many the next time.
StepProgress StepControl::grown(StepProgress now, double dt) const {
  StepLengths& lengths = now.lengths;
  if (lengths.level == 0 && !lengths.grown) return now;
  ++lengths.easy_steps;
  if (lengths.grown && lengths.easy_steps >= kMinPatience) {
    lengths.patience = std::max(lengths.patience / 2, kMinPatience);
    lengths.grown = false;
  }
  if (lengths.level == 0 || lengths.easy_steps < lengths.patience) return now;
  lengths.easy_steps = 0;
  lengths.grown = true;
  int up = levels_per_halving();
  while (up > 1 && !may_grow(lengths, dt, parts_at(up))) --up;
  lengths.level = std::max(0, lengths.level - up);
  return now;
}

double StepControl::allowed_error(double dt) const {
  if (!tolerance_) return INFINITY;
  return (1.0 - kEventShare) * *tolerance_ * dt / duration_;
}

bool StepControl::bears(const StepLengths& lengths, double error, double dt) const {
  const double allowed = allowed_error(dt);
  return !(error > allowed) || (error <= allowed_error(lengths.mean_step) &&
                                error - allowed <= lengths.event_reserve * kEventShare * *tolerance_);
}

StepControl::Accepted StepControl::accept(StepLengths lengths, double error, double dt, bool near_limit) const {
  const double allowed = allowed_error(dt);
  if (tolerance_) {
    const double excess = std::max(error - allowed, 0.0);
    lengths.event_reserve =
        std::min(1.0, lengths.event_reserve - excess / (kEventShare * *tolerance_) + dt / duration_);
    lengths.mean_step -= (dt - lengths.mean_step) * std::expm1(-dt / (kAveraging * duration_));
  }
  if (near_limit || error > allowed) return {lengths, Verdict::hard};
  if (!tolerance_) return {lengths, Verdict::easy};
  const double rate = error > kRoundingShare * allowed ? error / std::pow(dt, order_) : 0.0;
  lengths.error_rate = std::max(rate, lengths.error_rate * (1.0 - kForgetting));
  return {lengths, may_grow(lengths, dt, parts_at(1)) ? Verdict::easy : Verdict::hard};
}

/// True if a part of dt `times` longer would be accurate enough, the allowed error growing with it.
bool StepControl::may_grow(const StepLengths& lengths, double dt, double times) const {
  if (!tolerance_) return true;
  return lengths.error_rate * std::pow(times * dt, order_) < kSafety * times * allowed_error(dt);
}

}  // namespace withe
