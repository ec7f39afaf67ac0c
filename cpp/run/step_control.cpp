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
// Share of the allowed error that an estimate may reach. Errors of drawn vibrations of rods are up to 1.4 times their
// estimates. Modes near the cutoff of the filter count for less than their error, and long fourth-order steps have
// errors beyond the leading term.
constexpr double kEstimateShare = 0.7;
// Share of the allowed error that a longer part may be expected to have.
constexpr double kSafety = 0.8;
// Errors below this share of the allowed one are mostly rounding.
constexpr double kRoundingShare = 0.01;
// Part of the greatest error rate that a step forgets: an oscillation has no error twice a period.
constexpr double kForgetting = 1.0 / 256.0;
// Cost of a fourth-order step over that of a step of second order: five parts, each with some 1.2 times the iterations.
constexpr double kComposedCost = 6.0;
// Ratio of costs from which the order changes. Estimates of both orders vary by about as much within a period.
constexpr double kMinGain = 1.25;

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

StepControl::StepControl(const Options& options, bool may_compose)
    : adaptive_(options.adaptive),
      explicit_(options.integrator == Integrator::verlet),
      may_compose_(may_compose),
      max_halvings_(options.max_halvings),
      order_(local_order(options.integrator)),
      tolerance_(options.tolerance),
      duration_(options.duration.value_or(1.0)) {}

double StepControl::parts_at(int level) const { return std::exp2(static_cast<double>(level) / levels_per_halving()); }

int StepControl::levels_between(double ratio) const {
  return static_cast<int>(std::ceil(levels_per_halving() * std::log2(ratio)));
}

Division StepControl::divided(const Division& division, int level) const {
  const double from = division.reached();
  return {from, std::max(1L, static_cast<long>(std::ceil((1.0 - from) * parts_at(level) - 1e-9))), 0};
}

StepProgress StepControl::begin(StepLengths lengths, bool has_history) const {
  if (!adaptive_ && !tolerance_) lengths.level = 0;
  if (lengths.composed && !may_compose_) {
    lengths.composed = false;
    lengths.level = std::min(deepest_level(), lengths.level + levels_between(kComposedCost));
  }
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
  const bool was_composed = now.lengths.composed;
  const int before = now.lengths.level;
  if (verdict == Verdict::easy)
    now = grown(now, dt);
  else
    now.lengths.easy_steps = 0;
  if (may_compose_) now.lengths = choose_order(now.lengths, dt / now.division.share());
  const bool shorter = now.lengths.composed != was_composed && now.lengths.level > before;
  if ((now.lengths.level < before || shorter) && !now.division.finished())
    now.division = divided(now.division, now.lengths.level);
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
  return kEstimateShare * (1.0 - kEventShare) * *tolerance_ * dt / duration_;
}

bool StepControl::bears(const StepLengths& lengths, double error, double dt) const {
  const double allowed = allowed_error(dt);
  return !(error > allowed) || (error <= allowed_error(lengths.mean_step) &&
                                error - allowed <= lengths.event_reserve * kEventShare * *tolerance_);
}

StepControl::Accepted StepControl::accept(StepLengths lengths, const StepErrors& errors, double dt,
                                          bool near_limit) const {
  const double error = errors.own, allowed = allowed_error(dt);
  if (tolerance_) {
    const double excess = std::max(error - allowed, 0.0);
    lengths.event_reserve =
        std::min(1.0, lengths.event_reserve - excess / (kEventShare * *tolerance_) + dt / duration_);
    lengths.mean_step -= (dt - lengths.mean_step) * std::expm1(-dt / (kAveraging * duration_));
  }
  if (near_limit || error > allowed) return {lengths, Verdict::hard};
  if (!tolerance_) return {lengths, Verdict::easy};
  const auto note = [&](bool composed, double found, double least) {
    double& rate = lengths.error_rates[composed];
    rate = std::max(found > least ? found / std::pow(dt, order(composed)) : 0.0, rate * (1.0 - kForgetting));
  };
  note(lengths.composed, error, kRoundingShare * allowed);
  if (errors.other) note(!lengths.composed, *errors.other, 0.0);
  return {lengths, may_grow(lengths, dt, parts_at(1)) ? Verdict::easy : Verdict::hard};
}

/// True if a part of dt `times` longer would be accurate enough, the allowed error growing with it.
bool StepControl::may_grow(const StepLengths& lengths, double dt, double times) const {
  if (!tolerance_) return true;
  return lengths.error_rates[lengths.composed] * std::pow(times * dt, order(lengths.composed)) <
         kSafety * times * allowed_error(dt);
}

double StepControl::longest_step(const StepLengths& lengths, bool composed, double most) const {
  const double rate = lengths.error_rates[composed];
  return rate > 0.0 ? std::min(most, std::pow(kSafety * allowed_error(1.0) / rate, 1.0 / (order(composed) - 1.0)))
                    : most;
}

StepLengths StepControl::choose_order(StepLengths lengths, double whole) const {
  const bool other = !lengths.composed;
  const double now = longest_step(lengths, lengths.composed, whole), then = longest_step(lengths, other, whole),
               gain = then / now * (other ? 1.0 / kComposedCost : kComposedCost);
  if (lengths.error_rates[other] == 0.0 || gain < kMinGain) return lengths;
  lengths.composed = other;
  lengths.level = std::clamp(levels_between(whole / then), 0, deepest_level());
  lengths.easy_steps = 0;
  lengths.grown = false;
  return lengths;
}

}  // namespace withe
