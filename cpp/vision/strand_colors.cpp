#include "vision/strand_colors.hpp"

#include <array>
#include <cmath>

namespace withe {

namespace {

constexpr int kLanes = 24;

using Lanes = std::array<Eigen::Vector3f, kLanes>;

/// Mean colours along the lanes from the left flank to the right one, over some pixels of a line.
Lanes mean_lanes(const ColorImage& image, const SkeletonLine& line, int first, int last, double width) {
  Lanes lanes;
  lanes.fill(Eigen::Vector3f::Zero());
  const int step = std::max(1, (last - first) / 12);
  int count = 0;
  for (int i = first; i <= last; i += step, ++count) {
    const Vector2 center = line.position(i);
    const Vector2 normal = line.normal(i);
    for (int k = 0; k < kLanes; ++k) {
      const double aside = (0.5 - (k + 0.5) / kLanes) * width;
      lanes[static_cast<std::size_t>(k)] += image.sample(center + aside * normal);
    }
  }
  for (Eigen::Vector3f& color : lanes) color /= static_cast<float>(std::max(count, 1));
  return lanes;
}

Eigen::Vector3f mean(const Lanes& lanes, int first, int last) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int k = first; k < last; ++k) sum += lanes[static_cast<std::size_t>(k)];
  return sum / static_cast<float>(std::max(last - first, 1));
}

/// Colour without its grey.
Eigen::Vector3f without_grey(const Eigen::Vector3f& color) { return color.array() - color.mean(); }

/// Part of the weaker colour's hue that differs from the other one, brighter or darker [grey levels].
float hue_difference(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  Eigen::Vector3f weak = without_grey(a), strong = without_grey(b);
  if (weak.squaredNorm() > strong.squaredNorm()) std::swap(weak, strong);
  const float length = strong.squaredNorm();
  if (length < 1) return 0;
  return (weak - std::max(0.0F, weak.dot(strong) / length) * strong).norm();
}

/// The lane before which the colours change most, between two others; -1 where the hues do not differ.
int find_border(const Lanes& lanes, int first, int last) {
  constexpr int narrowest = 5;  // lanes
  constexpr float clear = 25;   // [grey levels]
  int best = -1;
  float most = 0;
  for (int k = first + narrowest; k + narrowest <= last; ++k) {
    const Eigen::Vector3f apart = without_grey(mean(lanes, first, k)) - without_grey(mean(lanes, k, last));
    const float between = apart.squaredNorm() * static_cast<float>(k - first) * static_cast<float>(last - k) /
                          static_cast<float>(last - first);
    if (between > most) {
      most = between;
      best = k;
    }
  }
  // Colours at the flanks and at the border itself are mixed with the colours beside them.
  if (best < 0 || hue_difference(mean(lanes, first + 1, best - 1), mean(lanes, best + 1, last - 1)) < clear) return -1;
  return best;
}

void split_lanes(const Lanes& lanes, int first, int last, std::vector<int>& borders) {
  const int border = find_border(lanes, first, last);
  if (border < 0) return;
  split_lanes(lanes, first, border, borders);
  borders.push_back(border);
  split_lanes(lanes, border, last, borders);
}

}  // namespace

std::vector<double> hue_borders(const ColorImage& image, const SkeletonLine& line, const WidthRun& run) {
  const Lanes all = mean_lanes(image, line, run.first, run.last, run.width);
  std::vector<int> borders;
  split_lanes(all, 0, kLanes, borders);
  constexpr int pieces = 4;
  std::vector<double> fractions;
  for (std::size_t b = 0; b < borders.size(); ++b) {
    const int before = b > 0 ? borders[b - 1] : 0;
    const int behind = b + 1 < borders.size() ? borders[b + 1] : kLanes;
    const Eigen::Vector3f apart =
        without_grey(mean(all, before, borders[b])) - without_grey(mean(all, borders[b], behind));
    bool everywhere = true;
    for (int p = 0; p < pieces; ++p) {
      const Lanes piece = mean_lanes(image, line, run.first + p * run.length() / pieces,
                                     run.first + (p + 1) * run.length() / pieces - 1, run.width);
      const Eigen::Vector3f here =
          without_grey(mean(piece, before, borders[b])) - without_grey(mean(piece, borders[b], behind));
      everywhere = everywhere && here.dot(apart) > 0.5F * apart.squaredNorm();
    }
    if (everywhere) fractions.push_back(static_cast<double>(borders[b]) / kLanes);
  }
  return fractions;
}

std::optional<double> shading_misfit(const ColorImage& image, const SkeletonLine& line, const WidthRun& run,
                                     int count) {
  const Lanes lanes = mean_lanes(image, line, run.first, run.last, run.width);
  const auto period = static_cast<int>(std::lround(static_cast<double>(kLanes) / count));
  constexpr float flat = 5;  // [grey levels]
  float total = 0, apart = 0;
  int pairs = 0;
  const float middle = mean(lanes, 1, kLanes - 1).mean();
  for (int k = 1; k + 1 < kLanes; ++k) {
    const float here = lanes[static_cast<std::size_t>(k)].mean();
    total += (here - middle) * (here - middle);
    if (k + period + 1 >= kLanes) continue;
    const float there = lanes[static_cast<std::size_t>(k + period)].mean();
    apart += 0.5F * (here - there) * (here - there);
    ++pairs;
  }
  total /= kLanes - 2;
  if (total < flat * flat || pairs == 0) return std::nullopt;
  return apart / (total * static_cast<float>(pairs));
}

}  // namespace withe
