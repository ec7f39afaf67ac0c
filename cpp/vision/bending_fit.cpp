#include "vision/bending_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace withe {

namespace {

/// Solves a symmetric positive definite system of half bandwidth 2 in place; columns of `band` are the diagonal and
/// the two below it.
void solve_band(std::vector<std::array<double, 3>>& band, MatrixX2& x) {
  const std::ptrdiff_t n = x.rows();
  // L D L^T, row by row
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const std::array<double, 3> a = band[static_cast<std::size_t>(i)];
    double l2 = 0;
    double l1 = 0;
    double d = a[0];
    if (i >= 2) l2 = band[static_cast<std::size_t>(i - 2)][2] / band[static_cast<std::size_t>(i - 2)][0];
    if (i >= 1) {
      double below = band[static_cast<std::size_t>(i - 1)][1];
      if (i >= 2) below -= l2 * band[static_cast<std::size_t>(i - 2)][0] * band[static_cast<std::size_t>(i - 2)][1];
      l1 = below / band[static_cast<std::size_t>(i - 1)][0];
      band[static_cast<std::size_t>(i - 1)][1] = l1;  // now a factor, no longer an entry
    }
    if (i >= 1) d -= l1 * l1 * band[static_cast<std::size_t>(i - 1)][0];
    if (i >= 2) d -= l2 * l2 * band[static_cast<std::size_t>(i - 2)][0];
    band[static_cast<std::size_t>(i)][0] = d;
    if (i >= 2) band[static_cast<std::size_t>(i - 2)][2] = l2;
    if (i >= 1) x.row(i) -= l1 * x.row(i - 1);
    if (i >= 2) x.row(i) -= l2 * x.row(i - 2);
  }
  for (std::ptrdiff_t i = 0; i < n; ++i) x.row(i) /= band[static_cast<std::size_t>(i)][0];
  for (std::ptrdiff_t i = n - 2; i >= 0; --i) {
    x.row(i) -= band[static_cast<std::size_t>(i)][1] * x.row(i + 1);
    if (i + 2 < n) x.row(i) -= band[static_cast<std::size_t>(i)][2] * x.row(i + 2);
  }
}

MatrixX2 fit_open(const std::vector<FitSample>& samples, std::ptrdiff_t nodes, double spacing, double offset,
                  double stiffness_length) {
  std::vector<std::array<double, 3>> band(static_cast<std::size_t>(nodes), {1e-12, 0, 0});
  MatrixX2 x = MatrixX2::Zero(nodes, 2);
  for (const FitSample& sample : samples) {
    const double place = std::clamp((sample.station - offset) / spacing, 0.0, static_cast<double>(nodes - 1));
    const auto i = std::min(static_cast<std::ptrdiff_t>(place), nodes - 2);
    const double b = place - static_cast<double>(i);
    const double a = 1 - b;
    auto& here = band[static_cast<std::size_t>(i)];
    here[0] += sample.weight * a * a;
    here[1] += sample.weight * a * b;
    band[static_cast<std::size_t>(i + 1)][0] += sample.weight * b * b;
    x.row(i) += sample.weight * a * sample.point.transpose();
    x.row(i + 1) += sample.weight * b * sample.point.transpose();
  }
  const double stiffness = std::pow(stiffness_length, 4) / (spacing * spacing * spacing);
  for (std::ptrdiff_t i = 1; i + 1 < nodes; ++i) {
    auto& before = band[static_cast<std::size_t>(i - 1)];
    auto& here = band[static_cast<std::size_t>(i)];
    before[0] += stiffness;
    here[0] += 4 * stiffness;
    band[static_cast<std::size_t>(i + 1)][0] += stiffness;
    before[1] -= 2 * stiffness;
    here[1] -= 2 * stiffness;
    before[2] += stiffness;
  }
  solve_band(band, x);
  return x;
}

}  // namespace

MatrixX2 fit_least_bending(const std::vector<FitSample>& samples, double length, double spacing,
                           double stiffness_length, bool closed) {
  const auto intervals = std::max<std::ptrdiff_t>(std::lround(length / spacing), closed ? 3 : 1);
  const double h = length / static_cast<double>(intervals);
  if (!closed) return fit_open(samples, intervals + 1, h, 0, stiffness_length);

  // A closed line is an open one that overlaps itself by several stiffness lengths; the middle is kept.
  const auto overlap = std::min<std::ptrdiff_t>(intervals, std::lround(12 * stiffness_length / h) + 12);
  std::vector<FitSample> around;
  around.reserve(2 * samples.size());
  const double reach = static_cast<double>(overlap) * h;
  for (const FitSample& sample : samples) {
    around.push_back(sample);
    if (sample.station > length - reach) around.push_back({sample.point, sample.station - length, sample.weight});
    if (sample.station < reach) around.push_back({sample.point, sample.station + length, sample.weight});
  }
  const MatrixX2 line = fit_open(around, intervals + 1 + 2 * overlap, h, -reach, stiffness_length);
  return line.middleRows(overlap, intervals);
}

MatrixX2 resample(const MatrixX2& line, double spacing, bool closed, std::vector<double>* rows) {
  const std::ptrdiff_t n = line.rows();
  const std::ptrdiff_t segments = closed ? n : n - 1;
  std::vector<double> arc(static_cast<std::size_t>(segments) + 1, 0.0);
  for (std::ptrdiff_t i = 0; i < segments; ++i) {
    arc[static_cast<std::size_t>(i) + 1] =
        arc[static_cast<std::size_t>(i)] + (line.row((i + 1) % n) - line.row(i)).norm();
  }
  const double length = arc.back();
  const auto intervals = std::max<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(std::ceil(length / spacing)), 1);
  const std::ptrdiff_t count = closed ? intervals : intervals + 1;
  MatrixX2 result(count, 2);
  if (rows != nullptr) rows->resize(static_cast<std::size_t>(count));
  std::ptrdiff_t segment = 0;
  for (std::ptrdiff_t k = 0; k < count; ++k) {
    const double s = length * static_cast<double>(k) / static_cast<double>(intervals);
    while (segment + 1 < segments && arc[static_cast<std::size_t>(segment) + 1] < s) ++segment;
    const double step = arc[static_cast<std::size_t>(segment) + 1] - arc[static_cast<std::size_t>(segment)];
    const double t = step > 0 ? (s - arc[static_cast<std::size_t>(segment)]) / step : 0.0;
    result.row(k) = (1 - t) * line.row(segment) + t * line.row((segment + 1) % n);
    if (rows != nullptr) (*rows)[static_cast<std::size_t>(k)] = static_cast<double>(segment) + t;
  }
  return result;
}

}  // namespace withe
