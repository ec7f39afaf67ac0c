#include "vision/strand_classes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace withe {

namespace {

/// Added to every channel, so that the noise of dark pixels is not amplified [grey levels].
constexpr double kDarkLevel = 8;
/// Chromaticities of two strands that differ by this are clearly different. Orange and yellow differ by 0.25; the
/// chromaticity along one strand varies by 0.05.
constexpr float kClearChromaticity = 0.17F;
/// Logarithms of brightness that differ by this are clearly different. The shaded flank of a strand has half of its
/// brightness, 0.7.
constexpr float kClearBrightness = 1.1F;

std::array<float, 256> logarithms() {
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < 256; ++i) table[i] = static_cast<float>(std::log(static_cast<double>(i) + kDarkLevel));
  return table;
}
const std::array<float, 256> kLogarithm = logarithms();

LogColor to_log_color(const Eigen::Vector3f& logarithms) {
  constexpr float root2 = 1.41421356F, root6 = 2.44948974F;
  LogColor color;
  color.chromaticity = {(logarithms[0] - logarithms[1]) / root2,
                        (logarithms[0] + logarithms[1] - 2 * logarithms[2]) / root6};
  color.brightness = logarithms.mean();
  return color;
}

Eigen::Vector3f log_pixel(const ColorImage& image, int x, int y) {
  const std::uint8_t* pixel = image.at(x, y);
  return {kLogarithm[pixel[0]], kLogarithm[pixel[1]], kLogarithm[pixel[2]]};
}

/// The half width that most of the skeleton has, by length.
double typical_half_width(const SkeletonGraph& graph) {
  std::vector<float> values;
  for (const SkeletonEdge& edge : graph.edges) {
    if (edge.removed) continue;
    for (std::size_t i = 0; i < edge.points.size(); i += 4) values.push_back(edge.points[i].half_width);
  }
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

float color_difference(const LogColor& a, const LogColor& b) {
  // Highlights and haze are white: they change the saturation, which is the length of the chromaticity.
  constexpr float of_saturation = 0.5F;
  const Eigen::Vector2f apart = a.chromaticity - b.chromaticity;
  const Eigen::Vector2f sum = a.chromaticity + b.chromaticity;
  const float length = sum.norm();
  const float saturation = length > 0 ? apart.dot(sum) / length : 0;
  const float squared = apart.squaredNorm() - (1 - of_saturation * of_saturation) * saturation * saturation;
  const float brightness = (a.brightness - b.brightness) / kClearBrightness;
  return std::sqrt(squared / (kClearChromaticity * kClearChromaticity) + brightness * brightness);
}

LogColor mean_color(const ColorImage& image, const SkeletonEdge& edge, int first, int last) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  int count = 0;
  for (int i = first; i <= last; ++i) {
    const SkeletonPoint& point = edge.points[at(i)];
    for (int y = std::max(point.y - 1, 0); y <= std::min(point.y + 1, image.height - 1); ++y) {
      for (int x = std::max(point.x - 1, 0); x <= std::min(point.x + 1, image.width - 1); ++x) {
        sum += log_pixel(image, x, y);
        ++count;
      }
    }
  }
  return to_log_color(sum / static_cast<float>(std::max(count, 1)));
}

LogColor branch_color(const ColorImage& image, const SkeletonGraph& graph, const Continuations& links, HalfEdge half) {
  const SkeletonEdge& edge = graph.edges[at(edge_of(half))];
  const Branch& branch = links.branches[at(half)];
  const int n = static_cast<int>(edge.points.size());
  if (n == 0) return {};
  const int from = std::min(branch.skip, n - 1);
  const int to = std::min(n - 1, from + static_cast<int>(8 * branch.half_width));
  return end_of(half) == 0 ? mean_color(image, edge, from, to) : mean_color(image, edge, n - 1 - to, n - 1 - from);
}

bool contradicts_colors(const ColorImage& image, const SkeletonGraph& graph, const Continuations& links) {
  std::vector<LogColor> colors(links.branches.size());
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const SkeletonEdge& edge = graph.edges[e];
    if (edge.removed || links.inside[e] || edge.points.empty()) continue;
    for (const int end : {0, 1}) {
      const auto half = static_cast<HalfEdge>(2 * e) + end;
      if (edge.nodes[0] >= 0) colors[at(half)] = branch_color(image, graph, links, half);
    }
    const int n = static_cast<int>(edge.points.size());
    const int window = std::max(6, static_cast<int>(2 * edge.half_width));
    const int margin = edge.nodes[0] < 0 ? 0 : std::min(n / 4, static_cast<int>(edge.half_width));
    if (n < 2 * window) continue;
    LogColor before = mean_color(image, edge, margin, margin + window - 1);
    for (int i = margin + window; i + window + margin <= n; i += window) {
      const LogColor here = mean_color(image, edge, i, i + window - 1);
      if (color_difference(before, here) > 1) return true;
      before = here;
    }
  }
  const auto differ = [&](HalfEdge a, HalfEdge b) { return color_difference(colors[at(a)], colors[at(b)]) > 1; };
  for (std::size_t h = 0; h < links.partner.size(); ++h) {
    const HalfEdge other = links.partner[h];
    if (other > static_cast<HalfEdge>(h) && differ(static_cast<HalfEdge>(h), other)) return true;
  }
  for (const Zone& zone : links.zones) {
    bool left_over = false;
    for (const HalfEdge half : zone.branches) left_over = left_over || links.partner[at(half)] < 0;
    if (!left_over) continue;
    for (const HalfEdge a : zone.branches) {
      for (const HalfEdge b : zone.branches) {
        if (a < b && differ(a, b)) return true;
      }
    }
  }
  return false;
}

StrandClasses::StrandClasses(const ColorImage& image, const SkeletonGraph& graph, const BitImage& mask)
    : height_(mask.height()), width_(mask.width()) {
  find_colors(image, graph);
  // Narrower regions are blended borders or shaded flanks, not strands: half of a width.
  if (count() > 1) classify(image, mask, std::clamp(static_cast<int>(0.5 * typical_half_width(graph)), 1, 4));
}

void StrandClasses::find_colors(const ColorImage& image, const SkeletonGraph& graph) {
  constexpr int window = 6;
  std::vector<LogColor> samples;
  for (const SkeletonEdge& edge : graph.edges) {
    if (edge.removed || edge.half_width < 1.5) continue;
    const int n = static_cast<int>(edge.points.size());
    for (int i = 0; i + window <= n; i += window) samples.push_back(mean_color(image, edge, i, i + window - 1));
  }
  constexpr std::size_t most_samples = 600, most_colors = 12;
  if (samples.size() > most_samples) {
    std::vector<LogColor> fewer;
    for (std::size_t i = 0; i < most_samples; ++i) fewer.push_back(samples[i * samples.size() / most_samples]);
    samples = std::move(fewer);
  }
  constexpr int fewest = 4;                      // windows: two and a half widths
  constexpr float near = 0.5F, assigned = 0.8F;  // [clear differences]
  while (colors_.size() < most_colors) {
    int most = 0;
    std::size_t best = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      int close = 0;
      for (const LogColor& other : samples) close += color_difference(samples[i], other) < near ? 1 : 0;
      if (close > most) {
        most = close;
        best = i;
      }
    }
    if (most < fewest) return;
    LogColor sum;
    for (const LogColor& other : samples) {
      if (color_difference(samples[best], other) >= near) continue;
      sum.chromaticity += other.chromaticity / static_cast<float>(most);
      sum.brightness += other.brightness / static_cast<float>(most);
    }
    const auto clear = [&](const LogColor& other) { return color_difference(sum, other) > 1; };
    if (std::all_of(colors_.begin(), colors_.end(), clear)) colors_.push_back(sum);
    std::erase_if(samples, [&](const LogColor& other) { return color_difference(sum, other) < assigned; });
  }
}

void StrandClasses::classify(const ColorImage& image, const BitImage& mask, int opening) {
  const PixelIndex index(mask);
  const std::vector<Pixel>& pixels = index.pixels();
  const auto classes = static_cast<std::size_t>(count());
  std::vector<float> differences(pixels.size() * classes);
  std::vector<BitImage> nearest(classes, BitImage(height_, width_));
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    const auto [x, y] = pixels[p];
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    int used = 0;
    for (int v = y - 1; v <= y + 1; ++v) {
      for (int u = x - 1; u <= x + 1; ++u) {
        if (!mask.at(u, v)) continue;
        sum += log_pixel(image, u, v);
        ++used;
      }
    }
    const LogColor color = to_log_color(sum / static_cast<float>(used));
    float* row = &differences[p * classes];
    for (std::size_t k = 0; k < classes; ++k) row[k] = color_difference(color, colors_[k]);
    nearest[static_cast<std::size_t>(std::min_element(row, row + classes) - row)].set(x, y);
  }
  classes_.assign(static_cast<std::size_t>(height_) * static_cast<std::size_t>(width_), -1);
  const auto place = [&](Pixel p) {
    return static_cast<std::size_t>(p.y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(p.x);
  };
  for (std::size_t k = 0; k < classes; ++k) {
    BitImage core = nearest[k];
    for (int round = 0; round < opening; ++round) core = erode(core);
    for (int round = 0; round < opening; ++round) core = dilate(core);
    const auto least = static_cast<std::size_t>((2 * opening + 1) * (2 * opening + 2));
    core = without_specks(core, least);
    const PixelIndex of_core(core);
    for (const Pixel p : of_core.pixels()) {
      if (nearest[k].at(p.x, p.y)) classes_[place(p)] = static_cast<std::int8_t>(k);
    }
  }
  // The other pixels go to the most similar of the classes around them, from the cores outwards.
  std::vector<std::size_t> open;
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    if (classes_[place(pixels[p])] < 0) open.push_back(p);
  }
  while (!open.empty()) {
    std::vector<std::pair<std::size_t, std::int8_t>> found;
    std::vector<std::size_t> rest;
    for (const std::size_t p : open) {
      const auto [x, y] = pixels[p];
      float least = std::numeric_limits<float>::infinity();
      int best = -1;
      for (int v = y - 1; v <= y + 1; ++v) {
        for (int u = x - 1; u <= x + 1; ++u) {
          const int k = at(u, v);
          if (k < 0 || differences[p * classes + static_cast<std::size_t>(k)] >= least) continue;
          least = differences[p * classes + static_cast<std::size_t>(k)];
          best = k;
        }
      }
      if (best >= 0) {
        found.emplace_back(p, static_cast<std::int8_t>(best));
      } else {
        rest.push_back(p);
      }
    }
    if (found.empty()) break;
    for (const auto& [p, k] : found) classes_[place(pixels[p])] = k;
    open = std::move(rest);
  }
}

BitImage StrandClasses::region_of(const Vector2& point) const {
  BitImage region(height_, width_);
  const int own = at(static_cast<int>(std::lround(point.x())), static_cast<int>(std::lround(point.y())));
  if (own < 0) return region;
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      if (at(x, y) == own) region.set(x, y);
    }
  }
  return region;
}

bool StrandClasses::cut(BitImage& mask) const {
  if (count() < 2) return false;
  bool removed = false;
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const int own = at(x, y);
      if (own < 0) continue;
      bool border = false;
      for (int v = y - 1; v <= y + 1; ++v) {
        for (int u = x - 1; u <= x + 1; ++u) border = border || at(u, v) > own;
      }
      if (!border) continue;
      mask.clear(x, y);
      removed = true;
    }
  }
  return removed;
}

}  // namespace withe
