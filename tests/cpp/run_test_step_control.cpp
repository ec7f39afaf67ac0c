#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "run/step_control.hpp"

namespace withe {
namespace {

Options options_of(std::optional<double> tolerance = {}) {
  Options options;
  options.tolerance = tolerance;
  options.duration = 1.0;
  return options;
}

/// Takes one time step of length 1 in which `verdict_of(from, length)` judges each part. Returns the lengths of the
/// parts that were accepted.
template <class Judge>
std::vector<double> take(const StepControl& control, StepLengths& lengths, const Judge& verdict_of) {
  std::vector<double> accepted;
  StepProgress now = control.begin(lengths, true);
  while (!now.division.finished()) {
    const double share = now.division.share();
    const Verdict verdict = verdict_of(now.division.reached(), share);
    if (accepts(verdict)) {
      accepted.push_back(share);
      now = control.advance(now, verdict, share);
    } else {
      EXPECT_TRUE(control.may_subdivide(now.lengths));
      now = control.subdivide(now, verdict);
    }
  }
  lengths = now.lengths;
  return accepted;
}

double sum(const std::vector<double>& parts) {
  double total = 0.0;
  for (double part : parts) total += part;
  return total;
}

TEST(StepControl, TakesAWholeTimeStepWhereEveryPartIsEasy) {
  const StepControl control(options_of());
  StepLengths lengths;
  for (int k = 0; k < 10; ++k)
    EXPECT_EQ(take(control, lengths, [](double, double) { return Verdict::easy; }), std::vector<double>{1.0});
  EXPECT_EQ(lengths.level, 0);
}

TEST(StepControl, PartsCoverTheTimeStepWhereverPartsAreRejected) {
  for (const std::optional<double> tolerance : {std::optional<double>{}, std::optional<double>{1e-3}})
    for (const Verdict why : {Verdict::failed, Verdict::inaccurate, Verdict::gained_energy})
      for (double place : {0.0, 0.3, 0.9}) {
        const StepControl control(options_of(tolerance));
        StepLengths lengths;
        const auto parts = take(control, lengths, [&](double from, double length) {
          const bool over_place = from <= place && place < from + length;
          return over_place && length > 1.0 / 50.0 ? why : Verdict::easy;
        });
        EXPECT_NEAR(sum(parts), 1.0, 1e-12);
        EXPECT_GT(lengths.level, 0);
      }
}

TEST(StepControl, PartsGrowBackOnceTheyAreEasyAndStayShortWhileTheyAreHard) {
  const StepControl control(options_of());
  StepLengths lengths;
  lengths.level = 3;
  StepLengths hard = lengths;
  for (int k = 0; k < 4; ++k) take(control, hard, [](double, double) { return Verdict::hard; });
  EXPECT_EQ(hard.level, 3);
  for (int k = 0; k < 4; ++k) take(control, lengths, [](double, double) { return Verdict::easy; });
  EXPECT_EQ(lengths.level, 0);
}

TEST(StepControl, WaitsLongerEachTimeThatGrowthGainsEnergyAtOnce) {
  const StepControl control(options_of());
  StepLengths lengths;
  lengths.level = 1;
  std::vector<int> waits;
  int halves = 0;
  while (waits.size() < 4)
    take(control, lengths, [&](double, double length) {
      if (length < 0.75) {
        ++halves;
        return Verdict::easy;
      }
      waits.push_back(std::exchange(halves, 0));
      return Verdict::gained_energy;
    });
  for (std::size_t k = 1; k < waits.size(); ++k) EXPECT_GE(waits[k], 2 * waits[k - 1] - 2) << k;
}

TEST(StepControl, EndsAtTheDeepestLevel) {
  Options options = options_of();
  options.max_halvings = 3;
  const StepControl control(options);
  StepProgress now = control.begin({}, true);
  int times = 0;
  for (; control.may_subdivide(now.lengths); ++times) now = control.subdivide(now, Verdict::failed);
  EXPECT_EQ(times, 3);
  EXPECT_EQ(now.division.parts, 8);
  options.integrator = Integrator::verlet;
  EXPECT_FALSE(StepControl(options).may_subdivide({}));
  options.integrator = Integrator::energy_momentum;
  options.adaptive = false;
  EXPECT_FALSE(StepControl(options).may_subdivide({}));
  EXPECT_EQ(StepControl(options).begin({.level = 2}, true).lengths.level, 0);
}

TEST(StepControl, KeepsTheSumOfErrorsBelowTheTolerance) {
  // A part of dt errs by C dt^3, C changing by a hundred along the way.
  const double tolerance = 1e-4;
  const StepControl control(options_of(tolerance));
  StepLengths lengths = control.begin({}, false).lengths;
  double errors = 0.0;
  const int time_steps = 20;
  int parts = 0;
  for (int k = 0; k < time_steps; ++k) {
    StepProgress now = control.begin(lengths, k > 0);
    while (!now.division.finished()) {
      const double dt = now.division.share() / time_steps, time = (k + now.division.reached()) / time_steps;
      const double error = 1e2 * std::pow(10.0, std::sin(20.0 * time)) * dt * dt * dt;
      if (!control.bears(now.lengths, error, dt)) {
        now = control.subdivide(now, Verdict::inaccurate);
        continue;
      }
      errors += error;
      ++parts;
      const auto [after, verdict] = control.accept(now.lengths, {error, {}}, dt, false);
      now.lengths = after;
      now = control.advance(now, verdict, dt);
    }
    lengths = now.lengths;
  }
  EXPECT_LE(errors, 1.2 * tolerance);
  EXPECT_GT(errors, 0.02 * tolerance);
  EXPECT_LT(parts, 20000);
}

TEST(StepControl, AnEventMayErrByMoreUntilItsReserveIsSpent) {
  const StepControl control(options_of(1e-3));
  StepLengths lengths;
  lengths.mean_step = 0.01;
  const double dt = 1e-4, error = 0.99 * control.allowed_error(lengths.mean_step);
  EXPECT_GT(error, control.allowed_error(dt));
  int events = 0;
  for (; control.bears(lengths, error, dt) && events < 1000; ++events) {
    const auto [after, verdict] = control.accept(lengths, {error, {}}, dt, false);
    EXPECT_EQ(verdict, Verdict::hard);
    lengths = after;
    lengths.mean_step = 0.01;
  }
  EXPECT_GT(events, 2);
  EXPECT_LT(events, 1000);
}

/// Steps of time steps of length 1 over a duration of 100, whose errors are those of one mode of a frequency: dt^3 / 12
/// and 9.3e-4 dt^5 times its derivatives. Returns the number of parts of either order in the second half.
std::array<int, 2> parts_of_mode(double frequency, double tolerance) {
  Options options = options_of(tolerance);
  options.duration = 100.0;
  options.max_halvings = 20;
  const StepControl control(options, true);
  StepLengths lengths = control.begin({}, false).lengths;
  std::array<int, 2> parts{};
  for (int k = 0; k < 100; ++k) {
    StepProgress now = control.begin(lengths, k > 0);
    while (!now.division.finished()) {
      const double dt = now.division.share();
      const double second = std::pow(frequency * dt, 3) / 12.0, fourth = 9.3e-4 * std::pow(frequency * dt, 5);
      const bool composed = now.lengths.composed;
      const StepErrors errors{composed ? fourth : second, composed ? second : fourth};
      if (!control.bears(now.lengths, errors.own, dt)) {
        now = control.subdivide(now, Verdict::inaccurate);
        continue;
      }
      if (k >= 50) ++parts[composed];
      const auto [after, verdict] = control.accept(now.lengths, errors, dt, false);
      now.lengths = after;
      now = control.advance(now, verdict, dt);
    }
    lengths = now.lengths;
  }
  return parts;
}

TEST(StepControl, TakesTheOrderThatCostsLess) {
  const auto tight = parts_of_mode(1.0, 1e-5), loose = parts_of_mode(1.0, 10.0);
  EXPECT_EQ(tight[0], 0);
  EXPECT_GT(tight[1], 50);
  EXPECT_EQ(loose[1], 0);
}

TEST(StepControl, FourthOrderStepsTakeAsManyPartsAsTheirErrorAllows) {
  // Sixteen times the tolerance allows twice the length.
  const int coarse = parts_of_mode(10.0, 1e-2)[1], fine = parts_of_mode(10.0, 1e-2 / 16.0)[1];
  EXPECT_NEAR(static_cast<double>(fine) / coarse, 2.0, 0.4);
}

TEST(StepControl, ReturnsToSecondOrderInShorterPartsWhereFourthIsNotAllowed) {
  const StepControl free(options_of(1e-3), true), bound(options_of(1e-3), false);
  const StepLengths composed{.level = 4, .composed = true};
  EXPECT_TRUE(free.begin(composed, true).lengths.composed);
  const StepLengths after = bound.begin(composed, true).lengths;
  EXPECT_FALSE(after.composed);
  EXPECT_GT(after.level, composed.level + 4);
}

}  // namespace
}  // namespace withe
