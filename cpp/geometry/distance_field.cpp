#include "geometry/distance_field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/check.hpp"

namespace withe {
namespace {

/// Weights of four coefficients at a share t of a cell, and their first two derivatives.
struct Weights {
  double value[4], slope[4], bend[4];

  explicit Weights(double t) {
    const double u = 1.0 - t;
    const double values[4] = {u * u * u / 6.0, (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
                              (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0, t * t * t / 6.0};
    const double slopes[4] = {-0.5 * u * u, (1.5 * t - 2.0) * t, (2.0 - 1.5 * u) * u, 0.5 * t * t};
    const double bends[4] = {u, 3.0 * t - 2.0, 3.0 * u - 2.0, t};
    std::copy_n(values, 4, value);
    std::copy_n(slopes, 4, slope);
    std::copy_n(bends, 4, bend);
  }
};

}  // namespace

DistanceField::DistanceField(std::vector<double> coefficients, const std::array<int, 3>& points, const Vec3d& origin,
                             const Vec3d& spacing)
    : coefficients_(std::move(coefficients)), points_(points), origin_(origin), spacing_(spacing) {
  std::size_t size = 1;
  for (int k = 0; k < 3; ++k) {
    require(points[static_cast<std::size_t>(k)] >= 2, "the grid of a field needs two points and more each way");
    require(spacing[k] > 0.0 && std::isfinite(spacing[k]) && std::isfinite(origin[k]),
            "spacing of the grid of a field must be positive");
    size *= static_cast<std::size_t>(points[static_cast<std::size_t>(k)] + 2);
  }
  require(coefficients_.size() == size, "a field needs one coefficient more on each side than its grid has points");
  require(std::all_of(coefficients_.begin(), coefficients_.end(), [](double c) { return std::isfinite(c); }),
          "distances of a field must be finite");
}

double DistanceField::channel() const { return std::numeric_limits<double>::infinity(); }

ShapeDistance DistanceField::distance(const Vec3d& x) const {
  std::size_t first[3];
  double beyond[3], share[3];
  for (int k = 0; k < 3; ++k) {
    const int cells = points_[static_cast<std::size_t>(k)] - 1;
    const double place = (x[k] - origin_[k]) / spacing_[k], inside = std::clamp(place, 0.0, static_cast<double>(cells));
    const int cell = std::min(static_cast<int>(inside), cells - 1);
    first[k] = static_cast<std::size_t>(cell);
    share[k] = inside - cell;
    beyond[k] = (place - inside) * spacing_[k];
  }
  const Weights by_x(share[0]), by_y(share[1]), by_z(share[2]);
  const auto row = static_cast<std::size_t>(points_[2] + 2), layer = row * static_cast<std::size_t>(points_[1] + 2);
  double value = 0.0, g[3] = {}, h[6] = {};  // h: xx, yy, zz, yz, xz, xy
  for (std::size_t i = 0; i < 4; ++i) {
    double a = 0.0, ay = 0.0, az = 0.0, ayy = 0.0, azz = 0.0, ayz = 0.0;
    for (std::size_t j = 0; j < 4; ++j) {
      const double* c = coefficients_.data() + (first[0] + i) * layer + (first[1] + j) * row + first[2];
      double b = 0.0, bz = 0.0, bzz = 0.0;
      for (std::size_t k = 0; k < 4; ++k) {
        b += by_z.value[k] * c[k];
        bz += by_z.slope[k] * c[k];
        bzz += by_z.bend[k] * c[k];
      }
      a += by_y.value[j] * b;
      ay += by_y.slope[j] * b;
      az += by_y.value[j] * bz;
      ayy += by_y.bend[j] * b;
      azz += by_y.value[j] * bzz;
      ayz += by_y.slope[j] * bz;
    }
    value += by_x.value[i] * a;
    g[0] += by_x.slope[i] * a;
    g[1] += by_x.value[i] * ay;
    g[2] += by_x.value[i] * az;
    h[0] += by_x.bend[i] * a;
    h[1] += by_x.value[i] * ayy;
    h[2] += by_x.value[i] * azz;
    h[3] += by_x.value[i] * ayz;
    h[4] += by_x.slope[i] * az;
    h[5] += by_x.slope[i] * ay;
  }
  const Vec3d step = spacing_;
  ShapeDistance out;
  out.normal = {g[0] / step.x, g[1] / step.y, g[2] / step.z};
  out.change.row[0] = {h[0] / (step.x * step.x), h[5] / (step.x * step.y), h[4] / (step.x * step.z)};
  out.change.row[1] = {out.change.row[0].y, h[1] / (step.y * step.y), h[3] / (step.y * step.z)};
  out.change.row[2] = {out.change.row[0].z, out.change.row[1].z, h[2] / (step.z * step.z)};
  out.distance = value;
  const Vec3d way{beyond[0], beyond[1], beyond[2]};
  if (dot(way, way) == 0.0) return out;
  // value + g . way at the nearest point of the grid, which moves with x along the border only
  out.distance += dot(out.normal, way);
  Mat3<double> change{};
  const Vec3d grown{dot(out.change.row[0], way), dot(out.change.row[1], way), dot(out.change.row[2], way)};
  const bool off[3] = {beyond[0] != 0.0, beyond[1] != 0.0, beyond[2] != 0.0};
  out.normal += {off[0] ? 0.0 : grown.x, off[1] ? 0.0 : grown.y, off[2] ? 0.0 : grown.z};
  // The third derivative is left out: this is far from rods.
  const auto keep = [&](int i, int j, double v) { return off[i] && off[j] ? 0.0 : v; };
  for (int i = 0; i < 3; ++i)
    change.row[i] = {keep(i, 0, out.change.row[i].x), keep(i, 1, out.change.row[i].y), keep(i, 2, out.change.row[i].z)};
  out.change = change;
  return out;
}

}  // namespace withe
