#include "vision/crossing_order.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace withe {

namespace {

/// A strand near a crossing, measured from it in rows of its cable.
class Strand {
 public:
  Strand(const Tracing& tracing, CableRow at)
      : cable_(tracing.cables[static_cast<std::size_t>(at.cable)]), origin_(at.row) {
    const Vector2 way = point(3) - point(-3);
    tangent_ = way.norm() > 0 ? Vector2(way.normalized()) : Vector2(1, 0);
    spacing_ = std::max(0.25, (point(1) - point(-1)).norm() / 2);
    half_width_ = std::max(0.5 * cable_.widths[wrap(0)], 0.75);
  }

  bool exists(int row) const {
    return cable_.closed || (origin_ + row >= 0 && origin_ + row < cable_.centreline.rows());
  }
  bool hidden(int row) const { return cable_.hidden[wrap(row)] != 0; }
  Vector2 point(int row) const { return cable_.centreline.row(static_cast<Eigen::Index>(wrap(row))).transpose(); }
  Vector2 normal(int row) const {
    const Vector2 way = point(row + 1) - point(row - 1);
    const Vector2 along = way.norm() > 0 ? Vector2(way.normalized()) : tangent_;
    return {-along.y(), along.x()};
  }
  const Vector2& tangent() const { return tangent_; }
  double half_width() const { return half_width_; }
  double spacing() const { return spacing_; }

  /// Distance of a point from the centreline, among the rows around the crossing.
  double distance(const Vector2& to, int rows) const {
    double nearest = 1e18;
    for (int row = -rows; row <= rows; ++row) nearest = std::min(nearest, (point(row) - to).squaredNorm());
    return std::sqrt(nearest);
  }

 private:
  std::size_t wrap(int row) const {
    const int n = static_cast<int>(cable_.centreline.rows());
    const int at = origin_ + row;
    return static_cast<std::size_t>(cable_.closed ? (at % n + n) % n : std::clamp(at, 0, n - 1));
  }

  const Cable& cable_;
  int origin_;
  Vector2 tangent_;
  double spacing_ = 1;
  double half_width_ = 1;
};

constexpr int kLanes = 9;  // across a strand

using Profile = std::array<Eigen::Vector3f, kLanes>;

double lane(int k) { return 0.9 * (2.0 * k / (kLanes - 1) - 1); }

/// Mean colours across a strand over the rows from `first` in steps of `step`; none where the strand ends.
std::optional<Profile> profile(const ColorImage& image, const Strand& strand, int first, int step, int count) {
  Profile sum;
  sum.fill(Eigen::Vector3f::Zero());
  int used = 0;
  for (int i = 0; i < count; ++i) {
    const int row = first + i * step;
    if (!strand.exists(row)) break;
    const Vector2 center = strand.point(row);
    const Vector2 normal = strand.normal(row);
    for (int k = 0; k < kLanes; ++k) {
      sum[static_cast<std::size_t>(k)] += image.sample(center + lane(k) * strand.half_width() * normal);
    }
    ++used;
  }
  if (used == 0) return std::nullopt;
  for (Eigen::Vector3f& color : sum) color /= static_cast<float>(used);
  return sum;
}

/// Mean squared difference between the picture in the crossing and the profiles of one strand outside it.
double misfit(const ColorImage& image, const Strand& strand, const Strand& other) {
  const double cosine = std::abs(strand.tangent().dot(other.tangent()));
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  const double reach = (other.half_width() + strand.half_width() * cosine) / std::max(sine, 0.15) + 1;
  const int rows = static_cast<int>(std::ceil(reach / strand.spacing()));
  const int other_rows = static_cast<int>(std::ceil(1.5 * reach / other.spacing()));
  const int samples = std::max(3, static_cast<int>(strand.half_width() / strand.spacing()));
  const std::optional<Profile> before = profile(image, strand, -rows - 1, -1, samples);
  const std::optional<Profile> behind = profile(image, strand, rows + 1, 1, samples);
  if (!before && !behind) return 0;
  const Profile& from = before ? *before : *behind;
  const Profile& to = behind ? *behind : *before;
  double sum = 0;
  int count = 0;
  for (int row = -rows; row <= rows; ++row) {
    if (!strand.exists(row)) continue;
    const Vector2 center = strand.point(row);
    const Vector2 normal = strand.normal(row);
    const auto t = static_cast<float>(0.5 + 0.5 * row / (rows + 1));
    for (int k = 0; k < kLanes; ++k) {
      const Vector2 place = center + lane(k) * strand.half_width() * normal;
      if (other.distance(place, other_rows) > 0.9 * other.half_width()) continue;
      const auto lane_index = static_cast<std::size_t>(k);
      const Eigen::Vector3f expected = (1 - t) * from[lane_index] + t * to[lane_index];
      sum += static_cast<double>((image.sample(place) - expected).squaredNorm());
      ++count;
    }
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace

void decide_order(const ColorImage& image, Tracing& tracing) {
  for (Crossing& crossing : tracing.crossings) {
    const Strand first(tracing, crossing.over);
    const Strand second(tracing, crossing.under);
    const double a = misfit(image, first, second);
    const double b = misfit(image, second, first);
    if (b < a) std::swap(crossing.over, crossing.under);
    crossing.confidence = a + b > 0 ? std::abs(a - b) / (a + b) : 0;
  }
}

}  // namespace withe
