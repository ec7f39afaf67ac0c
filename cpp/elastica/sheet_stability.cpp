#include "elastica/sheet_stability.hpp"

#include <array>
#include <cmath>
#include <cstddef>

namespace withe {

namespace {

constexpr std::size_t kElements = 96;  // a multiple of the segments

/// theta at the ends of the elements, by cubics through angles and curvatures at the cuts.
std::array<double, kElements + 1> sampled_angles(const SheetShape& shape, const SheetProblem::Path& path) {
  constexpr std::size_t kSegments = SheetProblem::kSegments, kEach = kElements / kSegments;
  const double length = path.values[2], h = length / kSegments;
  const auto curvature = [&](std::size_t k) {
    const double s = h * static_cast<double>(k);
    return 0.5 * path.nodes[k][1] / shape.width.width_at(length - s);
  };
  std::array<double, kElements + 1> angles{};
  for (std::size_t k = 0; k < kSegments; ++k) {
    const double a = path.nodes[k][0], b = path.nodes[k + 1][0];
    const double from = h * curvature(k), to = h * curvature(k + 1);
    for (std::size_t i = 0; i <= kEach; ++i) {
      const double u = static_cast<double>(i) / kEach, v = 1 - u;
      angles[k * kEach + i] = a * v * v * (1 + 2 * u) + b * u * u * (1 + 2 * v) + from * u * v * v - to * u * u * v;
    }
  }
  return angles;
}

}  // namespace

bool sheet_is_stable(const SheetShape& shape, const SheetProblem::Path& path) {
  const auto angles = sampled_angles(shape, path);
  const double length = path.values[2], h = length / static_cast<double>(kElements);
  const double lifted = shape.width.weight_at(length);
  const auto stiffness = [&](double s) { return 2.0 * shape.width.width_at(length - s) / h; };
  // L D L^T of the tridiagonal matrix, applied to both constraints on the way; of D only its inertia is needed.
  int negative = 0;
  double pivot = 0, by_x = 0, by_z = 0, xx = 0, xz = 0, zz = 0;
  for (std::size_t i = 1; i < kElements; ++i) {
    const double s = h * static_cast<double>(i), before = stiffness(s - 0.5 * h);
    const double sine = std::sin(angles[i]), cosine = std::cos(angles[i]);
    const double weight = shape.width.even() ? s : lifted - shape.width.weight_at(length - s);
    const double diagonal =
        before + stiffness(s + 0.5 * h) - h * ((path.values[0] - weight) * sine + path.values[1] * cosine);
    const double factor = i == 1 ? 0.0 : before / pivot;
    pivot = i == 1 ? diagonal : diagonal - before * factor;
    by_x = h * sine + factor * by_x;
    by_z = h * cosine + factor * by_z;
    negative += pivot < 0;
    xx += by_x * by_x / pivot;
    xz += by_x * by_z / pivot;
    zz += by_z * by_z / pivot;
  }
  // Minus the matrix (xx, xz; xz, zz) has one negative eigenvalue for each positive one of it.
  const double determinant = xx * zz - xz * xz;
  if (determinant < 0) return negative + 1 == 2;
  return negative + (xx + zz > 0 ? 2 : 0) == 2;
}

}  // namespace withe
