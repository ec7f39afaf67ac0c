// Derivatives of accelerations by which error control estimates the errors of steps.

#include <cmath>

#include <gtest/gtest.h>

#include "integrators/predictor.hpp"

namespace withe {
namespace {

/// Amplitudes of the first and third derivative that are found of an acceleration cos(w t), whose means over steps of
/// length 1 are given, with a filter of a cutoff frequency.
std::array<double, 2> amplitudes(const Predictor::Butterworth& filter, double w, double cut) {
  Predictor predictor;
  predictor.resize(1);
  VectorX acceleration(1), first, third;
  std::array<double, 2> most{};
  const int settling = static_cast<int>(40.0 / std::min(w, cut)), period = static_cast<int>(2.0 * M_PI / w) + 1;
  for (int k = 0; k < settling + period; ++k) {
    acceleration(0) = (std::sin(w * (k + 1)) - std::sin(w * k)) / w;
    predictor.differentiate(filter, cut, 1.0, acceleration, first, &third);
    if (k < settling) continue;
    most[0] = std::max(most[0], std::abs(first(0)));
    most[1] = std::max(most[1], std::abs(third(0)));
  }
  return most;
}

double gain(double x, int order) { return 1.0 / std::sqrt(1.0 + std::pow(x, 2 * order)); }

TEST(Predictor, DerivativesAreExactBelowTheCutoffAndFallByThePowerOfTheirOrderAboveIt) {
  const double cut = 0.05;
  for (double x : {0.2, 0.5, 1.0, 2.0, 5.0}) {
    const double w = x * cut;
    EXPECT_NEAR(amplitudes(Predictor::kThird, w, cut)[0] / (w * gain(x, 3)), 1.0, 0.05) << x;
    EXPECT_NEAR(amplitudes(Predictor::kFifth, w, cut)[1] / (w * w * w * gain(x, 5)), 1.0, 0.1) << x;
  }
}

TEST(Predictor, ConstantAccelerationsHaveNoDerivatives) {
  Predictor predictor;
  predictor.resize(1);
  const VectorX acceleration = VectorX::Constant(1, 3.0);
  VectorX first, third;
  for (double dt : {1.0, 0.1, 7.0}) {
    predictor.differentiate(Predictor::kFifth, 1.5, dt, acceleration, first, &third);
    EXPECT_EQ(first(0), 0.0);
    EXPECT_EQ(third(0), 0.0);
  }
}

}  // namespace
}  // namespace withe
