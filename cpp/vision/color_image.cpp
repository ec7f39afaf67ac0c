#include "vision/color_image.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace withe {

namespace {

constexpr int kShift = 12;

/// round(2^12 * scale / i): divisions become multiplications.
constexpr std::array<int, 256> reciprocals(int scale) {
  std::array<int, 256> table{};
  const int dividend = (1 << kShift) * scale;
  for (int i = 1; i < 256; ++i) table[static_cast<std::size_t>(i)] = (2 * dividend + i) / (2 * i);  // rounded
  return table;
}
constexpr std::array<int, 256> kSaturation = reciprocals(255);
constexpr std::array<int, 256> kHue = reciprocals(30);

/// True if any of eight bytes is at least `level`, 1 <= level <= 128.
bool any_reaches(std::uint64_t bytes, int level) {
  constexpr std::uint64_t high = 0x8080808080808080ULL;
  const std::uint64_t add = 0x0101010101010101ULL * static_cast<std::uint64_t>(128 - level);
  return (((bytes & ~high) + add) | bytes) & high;
}

std::uint64_t load(const std::uint8_t* from) {
  std::uint64_t bytes = 0;
  std::memcpy(&bytes, from, 8);
  return bytes;
}

/// The median of each channel along the border.
std::array<int, 3> border_color(const ColorImage& image) {
  std::array<std::array<int, 256>, 3> histogram{};
  int count = 0;
  const auto add = [&](int x, int y) {
    const std::uint8_t* color = image.at(x, y);
    for (std::size_t c = 0; c < 3; ++c) ++histogram[c][color[c]];
    ++count;
  };
  for (int x = 0; x < image.width; ++x) {
    add(x, 0);
    add(x, image.height - 1);
  }
  for (int y = 0; y < image.height; ++y) {
    add(0, y);
    add(image.width - 1, y);
  }
  std::array<int, 3> median{};
  for (std::size_t c = 0; c < 3; ++c) {
    int sum = 0;
    int level = 0;
    while (level < 255 && 2 * (sum += histogram[c][static_cast<std::size_t>(level)]) < count) ++level;
    median[c] = level;
  }
  return median;
}

/// Classes this many standard deviations of the lower one apart are no parts of a background's noise.
constexpr double kApart = 4.0;

/// Highest level of the lower class by Otsu's rule on the square roots of the levels, so that dark cables are not
/// lost among bright ones, or 256 where the classes are too alike. Where few pixels are cables that rule would part a
/// background's noise: then the best of classes that are well apart counts.
int separate(const std::array<std::int64_t, 256>& histogram, int contrast) {
  std::array<double, 256> value{};
  double total = 0;
  double moment = 0;
  for (std::size_t i = 0; i < 256; ++i) {
    value[i] = std::sqrt(static_cast<double>(i));
    total += static_cast<double>(histogram[i]);
    moment += value[i] * static_cast<double>(histogram[i]);
  }
  double below = 0;
  double below_moment = 0;
  double below_square = 0;
  double best = -1;
  double best_apart = -1;
  int level = 256;
  int level_apart = 256;
  for (std::size_t i = 0; i < 255; ++i) {
    const auto count = static_cast<double>(histogram[i]);
    below += count;
    below_moment += value[i] * count;
    below_square += static_cast<double>(i) * count;
    if (below == 0 || below == total) continue;
    const double high = (moment - below_moment) / (total - below);
    const double low = below_moment / below;
    const double apart = high - low;
    const double between = below * (total - below) * apart * apart;
    const bool contrasts = high * high - low * low >= contrast;
    if (between > best) {
      best = between;
      level = contrasts ? static_cast<int>(i) : 256;
    }
    const double variance = std::max(below_square / below - low * low, 0.0);
    if (between > best_apart && contrasts && apart >= kApart * std::sqrt(variance)) {
      best_apart = between;
      level_apart = static_cast<int>(i);
    }
  }
  return level < 256 ? level : level_apart;
}

}  // namespace

Eigen::Vector3f ColorImage::sample(const Vector2& point) const {
  const double px = std::clamp(point.x(), 0.0, width - 1.0);
  const double py = std::clamp(point.y(), 0.0, height - 1.0);
  const int x = std::min(static_cast<int>(px), std::max(width - 2, 0));
  const int y = std::min(static_cast<int>(py), std::max(height - 2, 0));
  const auto fx = static_cast<float>(px - x);
  const auto fy = static_cast<float>(py - y);
  const std::uint8_t* a = at(x, y);
  const std::uint8_t* b = at(std::min(x + 1, width - 1), y);
  const std::uint8_t* c = at(x, std::min(y + 1, height - 1));
  const std::uint8_t* d = at(std::min(x + 1, width - 1), std::min(y + 1, height - 1));
  Eigen::Vector3f result;
  for (int k = 0; k < 3; ++k) {
    const float upper = static_cast<float>(a[k]) * (1 - fx) + static_cast<float>(b[k]) * fx;
    const float lower = static_cast<float>(c[k]) * (1 - fx) + static_cast<float>(d[k]) * fx;
    result[k] = upper * (1 - fy) + lower * fy;
  }
  return result;
}

std::array<int, 3> to_hsv(int red, int green, int blue) {
  const int value = std::max({red, green, blue});
  const int range = value - std::min({red, green, blue});
  constexpr int half = 1 << (kShift - 1);
  const int saturation = (range * kSaturation[static_cast<std::size_t>(value)] + half) >> kShift;
  int hue = 0;
  if (value == red) {
    hue = green - blue;
  } else if (value == green) {
    hue = blue - red + 2 * range;
  } else {
    hue = red - green + 4 * range;
  }
  hue = (hue * kHue[static_cast<std::size_t>(range)] + half) >> kShift;
  return {hue < 0 ? hue + 180 : hue, saturation, value};
}

void hsv_mask(const ColorImage& image, const std::vector<HsvRange>& ranges, std::uint8_t* mask) {
  int darkest = 255;
  for (const HsvRange& range : ranges) darkest = std::min(darkest, range.low[2]);
  const bool skip = darkest >= 1;
  const int level = std::clamp(darkest, 1, 128);
  const auto decide = [&](const std::uint8_t* color) -> std::uint8_t {
    if (std::max({color[0], color[1], color[2]}) < darkest) return 0;
    const std::array<int, 3> hsv = to_hsv(color[0], color[1], color[2]);
    for (const HsvRange& range : ranges) {
      bool inside = true;
      for (std::size_t c = 0; c < 3; ++c) inside = inside && hsv[c] >= range.low[c] && hsv[c] <= range.high[c];
      if (inside) return 1;
    }
    return 0;
  };
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.at(0, y);
    std::uint8_t* out = mask + static_cast<std::ptrdiff_t>(y) * image.width;
    int x = 0;
    for (; x + 8 <= image.width; x += 8) {
      const std::uint8_t* eight = row + 3 * x;
      if (skip && !any_reaches(load(eight), level) && !any_reaches(load(eight + 8), level) &&
          !any_reaches(load(eight + 16), level)) {
        std::memset(out + x, 0, 8);
        continue;
      }
      for (int k = 0; k < 8; ++k) out[x + k] = decide(eight + 3 * k);
    }
    for (; x < image.width; ++x) out[x] = decide(row + 3 * x);
  }
}

void foreground_mask(const ColorImage& image, int contrast, std::uint8_t* mask) {
  const std::array<int, 3> ground = border_color(image);
  std::array<std::array<std::int64_t, 256>, 4>
      histograms{};  // four, so that equal neighbours do not wait for each other
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.at(0, y);
    std::uint8_t* out = mask + static_cast<std::ptrdiff_t>(y) * image.width;
    for (int x = 0; x < image.width; ++x) {
      const int red = std::abs(row[3 * x] - ground[0]);
      const int green = std::abs(row[3 * x + 1] - ground[1]);
      const int blue = std::abs(row[3 * x + 2] - ground[2]);
      out[x] = static_cast<std::uint8_t>(std::max(red, std::max(green, blue)));
    }
    for (int x = 0; x < image.width; ++x) ++histograms[static_cast<std::size_t>(x & 3)][out[x]];
  }
  for (std::size_t i = 0; i < 256; ++i) histograms[0][i] += histograms[1][i] + histograms[2][i] + histograms[3][i];
  const int level = separate(histograms[0], contrast);
  const std::size_t count = static_cast<std::size_t>(image.height) * static_cast<std::size_t>(image.width);
  if (level > 255) {
    std::memset(mask, 0, count);
    return;
  }
  const auto threshold = static_cast<std::uint8_t>(level);
  for (std::size_t i = 0; i < count; ++i) mask[i] = mask[i] > threshold;
}

}  // namespace withe
