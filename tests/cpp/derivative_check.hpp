#pragma once
/// The one derivative check. It compares the claimed derivative J of f at x with central differences (f(x + h e_i) -
/// f(x - h e_i)) / 2h over three decades of the increment h. The difference must fall at second order in h until
/// rounding stops it. Its smallest value must be below 1e-7 of the greatest entry of J. A wrong term of any
/// size shows as a difference that stops falling.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "common/types.hpp"

namespace withe::testing {

using MatrixX = Eigen::MatrixXd;
using Function = std::function<VectorX(const VectorX&)>;

inline MatrixX central_difference(const Function& f, const VectorX& x, double increment) {
  MatrixX out;
  VectorX moved = x;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    moved(i) = x(i) + increment;
    const VectorX up = f(moved);
    const double above = moved(i);
    moved(i) = x(i) - increment;
    const VectorX down = f(moved);
    if (out.size() == 0) out.resize(up.size(), x.size());
    out.col(i) = (up - down) / (above - moved(i));
    moved(i) = x(i);
  }
  return out;
}

/// `largest`: first and largest increment, in the units of x.
inline ::testing::AssertionResult derivative_matches(const Function& f, const VectorX& x, const MatrixX& claimed,
                                                     double largest = 1e-2) {
  constexpr int kPoints = 7;  // two a decade, three decades
  constexpr double kTolerance = 1e-7;
  const double scale = claimed.cwiseAbs().maxCoeff();
  if (!claimed.allFinite()) return ::testing::AssertionFailure() << "the claimed derivative is not finite";
  const double size = std::max(f(x).cwiseAbs().maxCoeff(), scale * std::max(1.0, x.cwiseAbs().maxCoeff()));
  if (size == 0.0) return ::testing::AssertionFailure() << "nothing to compare: function and derivative are zero";
  std::vector<double> difference, floor;
  double best = INFINITY;
  std::string table;
  for (int k = 0; k < kPoints; ++k) {
    const double h = largest * std::pow(10.0, -0.5 * k);
    const MatrixX estimate = central_difference(f, x, h);
    if (!estimate.allFinite()) return ::testing::AssertionFailure() << "differences are not finite at h = " << h;
    difference.push_back((estimate - claimed).cwiseAbs().maxCoeff());
    floor.push_back(3e-15 * size / h);
    best = std::min(best, difference.back() / std::max(scale, 1e-300));
    table += " h=" + std::to_string(h) + ": " + ::testing::PrintToString(difference.back() / scale);
  }
  if (!(best < kTolerance)) return ::testing::AssertionFailure() << "best relative difference " << best << ";" << table;
  // A step of h by sqrt(10) must bring a fall by ten; six leaves room for the next order at the largest h.
  for (int k = 0; k + 1 < kPoints; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (difference[i + 1] > difference[i] / 6.0 + 30.0 * floor[i + 1])
      return ::testing::AssertionFailure() << "the difference does not fall at second order:" << table;
  }
  return ::testing::AssertionSuccess();
}

/// The same for a scalar function and its gradient.
inline ::testing::AssertionResult gradient_matches(const std::function<double(const VectorX&)>& f, const VectorX& x,
                                                   const VectorX& gradient, double largest = 1e-2) {
  const Function wrapped = [&](const VectorX& at) { return VectorX::Constant(1, f(at)); };
  return derivative_matches(wrapped, x, gradient.transpose(), largest);
}

}  // namespace withe::testing
