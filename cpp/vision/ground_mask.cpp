#include "vision/ground_mask.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "vision/bit_image.hpp"

namespace withe {

namespace {

using Basis = Eigen::Matrix<double, 6, 1>;
using Surface = Eigen::Matrix<double, 6, 3>;

/// Darkest shadow: the light that remains, relative to the ground beside it.
constexpr double kDarkestShadow = 0.26;
/// Added to a grey level before its logarithm, so that the noise of dark pixels weighs little [grey levels].
constexpr double kDarkLevel = 20.0;
/// Added to both levels whose ratio is compared with the darkest shadow [grey levels].
constexpr float kBlack = 2.0F;
/// Weak evidence of a pixel darker than a shadow: this share of the logarithm of the darkest shadow.
constexpr float kNearlyDark = 0.8F;
/// Least strong evidence: difference of chromaticity and of brightness, as logarithms.
constexpr double kLeastChromaticity = 0.14;
constexpr double kLeastBrightness = 0.28;
/// Strong evidence in standard deviations of the ground.
constexpr double kDeviations = 5.0;
/// Evidence in fixed point: strong evidence is 16. Weak evidence is 0.55 times the strong one.
constexpr int kStrong = 16;
constexpr int kWeak = 9;
/// An edge lies where the evidence is this share of the greatest evidence within kReach pixels.
constexpr double kEdge = 0.45;
constexpr int kReach = 4;
/// Greatest evidence that counts for the place of edges, in strong ones: blurred edges of bright cables are wide.
constexpr int kGreatest = 8;
/// A region needs so many strong pixels, and so many pixels in all.
constexpr int kStrongPixels = 12;
constexpr int kPixels = 60;
/// A dark region is a shadow if this share of it lies so near to certain pixels [px].
constexpr int kShadowReach = 16;
constexpr double kShadowShare = 0.5;
/// Pixels from one sample of the ground to the next.
constexpr int kStep = 6;
constexpr int kRounds = 8;  ///< of reweighted least squares

/// The picture smoothed by weights 1, 2, 1 in both directions, so that single noisy pixels do not count.
class Smoothed {
 public:
  explicit Smoothed(const ColorImage& image)
      : height_(image.height), width_(image.width), bytes_(3 * std::size_t(image.height) * std::size_t(image.width)) {
    const auto length = static_cast<std::size_t>(3) * static_cast<std::size_t>(width_);
    std::vector<std::uint16_t> column(length + 6);
    for (int y = 0; y < height_; ++y) {
      const std::uint8_t* above = image.at(0, std::max(y - 1, 0));
      const std::uint8_t* here = image.at(0, y);
      const std::uint8_t* below = image.at(0, std::min(y + 1, height_ - 1));
      for (std::size_t i = 0; i < length; ++i) {
        column[i + 3] = static_cast<std::uint16_t>(above[i] + 2 * here[i] + below[i]);
      }
      for (std::size_t c = 0; c < 3; ++c) {
        column[c] = column[c + 3];
        column[length + 3 + c] = column[length + c];
      }
      std::uint8_t* out = bytes_.data() + static_cast<std::size_t>(y) * length;
      for (std::size_t i = 0; i < length; ++i) {
        out[i] = static_cast<std::uint8_t>((column[i] + 2 * column[i + 3] + column[i + 6] + 8) >> 4);
      }
    }
  }

  int height() const { return height_; }
  int width() const { return width_; }
  const std::uint8_t* at(int x, int y) const {
    return bytes_.data() + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + std::size_t(x));
  }

 private:
  int height_;
  int width_;
  std::vector<std::uint8_t> bytes_;
};

std::array<float, 256> logarithms() {
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < 256; ++i) table[i] = static_cast<float>(std::log(static_cast<double>(i) + kDarkLevel));
  return table;
}

/// The logarithms of the ground as quadratic functions of the place in the picture, from -1 to 1 on both axes.
Basis basis(double u, double v) { return (Basis() << 1.0, u, v, u * u, u * v, v * v).finished(); }

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Median grey level of sampled pixels; 0 if there are none.
double median_level(const ColorImage& image) {
  std::vector<double> levels;
  for (int y = std::min(kStep / 2, image.height - 1); y < image.height; y += kStep) {
    for (int x = std::min(kStep / 2, image.width - 1); x < image.width; x += kStep) {
      const std::uint8_t* color = image.at(x, y);
      levels.push_back((color[0] + color[1] + color[2]) / 3.0);
    }
  }
  return levels.empty() ? 0.0 : median(std::move(levels));
}

/// Logarithms at sampled pixels, and the surface of the ground through them.
struct Ground {
  Surface surface = Surface::Zero();
  double chromaticity = 0.0;  ///< standard deviation of the ground
  double brightness = 0.0;    ///< standard deviation of the ground

  Ground(const Smoothed& image, const std::array<float, 256>& table) {
    std::vector<Basis> places;
    std::vector<Eigen::Vector3d> samples;
    for (int y = std::min(kStep / 2, image.height() - 1); y < image.height(); y += kStep) {
      for (int x = std::min(kStep / 2, image.width() - 1); x < image.width(); x += kStep) {
        places.push_back(basis(2.0 * x / image.width() - 1.0, 2.0 * y / image.height() - 1.0));
        const std::uint8_t* color = image.at(x, y);
        samples.emplace_back(table[color[0]], table[color[1]], table[color[2]]);
      }
    }
    std::vector<double> values(samples.size());
    for (int c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < samples.size(); ++i) values[i] = samples[i][c];
      surface(0, c) = median(values);
    }
    for (int round = 0; round < kRounds; ++round) fit(places, samples);

    std::vector<double> tones(samples.size());
    std::vector<double> hues(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Eigen::Vector3d ground = surface.transpose() * places[i];
      const Eigen::Vector3d apart = samples[i] - ground;
      tones[i] = apart.mean();
      hues[i] = std::sqrt(1.5) * (apart.array() - tones[i]).matrix().norm();
    }
    // Medians of a Rayleigh distribution and of absolute normal deviations.
    chromaticity = median(hues) / 1.18;
    const double middle = median(tones);
    for (double& tone : tones) tone = std::abs(tone - middle);
    brightness = 1.48 * median(tones);
  }

 private:
  /// One round of least squares with Tukey's biweight.
  void fit(const std::vector<Basis>& places, const std::vector<Eigen::Vector3d>& samples) {
    std::vector<double> errors(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      errors[i] = (samples[i] - surface.transpose() * places[i]).norm();
    }
    const double scale = 2.5 * std::max(1.2 * median(errors), 0.02);
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Surface right = Surface::Zero();
    double weights = 0.0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double share = 1.0 - errors[i] * errors[i] / (scale * scale);
      if (share <= 0.0) continue;
      const double weight = share * share;
      normal.noalias() += weight * places[i] * places[i].transpose();
      right.noalias() += weight * places[i] * samples[i].transpose();
      weights += weight;
    }
    normal.diagonal().tail(5).array() += 1e-5 * weights;  // a small picture may not determine the slopes
    if (weights > 0.0) surface = normal.ldlt().solve(right);
  }
};

/// Evidence that each pixel belongs to a cable, in fixed point.
struct Evidence {
  std::vector<std::uint8_t> certain;  ///< by colour, brightness, or darkness that no shadow has
  std::vector<std::uint8_t> dark;     ///< by darkness that a shadow may have
  BitImage black;                     ///< darker than any shadow
};

Evidence evidence(const Smoothed& image, const Ground& ground, const std::array<float, 256>& table, int contrast) {
  const std::size_t count = static_cast<std::size_t>(image.height()) * static_cast<std::size_t>(image.width());
  Evidence score{std::vector<std::uint8_t>(count), std::vector<std::uint8_t>(count),
                 BitImage(image.height(), image.width())};
  const auto fixed = [](float value) {
    return static_cast<std::uint8_t>(std::clamp(value * static_cast<float>(kStrong), 0.0F, 255.0F));
  };
  const auto by_hue = static_cast<float>(1.0 / std::max(kLeastChromaticity, kDeviations * ground.chromaticity));
  const auto by_tone = static_cast<float>(1.0 / std::max(kLeastBrightness, kDeviations * ground.brightness));
  const auto by_levels = 1.0F / static_cast<float>(std::max(contrast, 1));
  const auto shadow = static_cast<float>(std::log(kDarkestShadow));
  // Darker than the darkest shadow on the darkest grain of the ground.
  const auto black = static_cast<float>(1.0 + kDeviations * ground.brightness / std::abs(std::log(kDarkestShadow)));
  constexpr auto dark = static_cast<float>(kDarkLevel);
  const Surface& s = ground.surface;
  for (int y = 0; y < image.height(); ++y) {
    const double v = 2.0 * y / image.height() - 1.0;
    std::array<std::array<float, 3>, 3> along{};   // of each channel: constant, slope, half of the curvature
    std::array<std::array<float, 3>, 3> levels{};  // the same of the grey level of the ground, at three points
    for (int c = 0; c < 3; ++c) {
      const auto k = static_cast<std::size_t>(c);
      const double constant = s(0, c) + v * (s(2, c) + v * s(5, c));
      const double slope = s(1, c) + v * s(4, c);
      along[k] = {static_cast<float>(constant), static_cast<float>(slope), static_cast<float>(s(3, c))};
      const double left = std::exp(constant - slope + s(3, c));
      const double middle = std::exp(constant);
      const double right = std::exp(constant + slope + s(3, c));
      levels[k] = {static_cast<float>(middle), static_cast<float>(0.5 * (right - left)),
                   static_cast<float>(0.5 * (right + left) - middle)};
    }
    const std::uint8_t* color = image.at(0, y);
    const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width());
    for (int x = 0; x < image.width(); ++x, color += 3) {
      const float u = 2.0F * static_cast<float>(x) / static_cast<float>(image.width()) - 1.0F;
      std::array<float, 3> apart{};
      float difference = 0.0F;  // from the ground [grey levels]
      float here = 0.0F;
      float there = 0.0F;
      for (std::size_t c = 0; c < 3; ++c) {
        const float log = along[c][0] + u * (along[c][1] + u * along[c][2]);
        apart[c] = table[color[c]] - log;
        const float level = levels[c][0] + u * (levels[c][1] + u * levels[c][2]) - dark;
        difference = std::max(difference, std::abs(static_cast<float>(color[c]) - level));
        here += static_cast<float>(color[c]);
        there += level;
      }
      const float tone = (apart[0] + apart[1] + apart[2]) / 3.0F;
      const float hue =
          std::sqrt(1.5F * ((apart[0] - tone) * (apart[0] - tone) + (apart[1] - tone) * (apart[1] - tone) +
                            (apart[2] - tone) * (apart[2] - tone)));
      float found = std::max(hue * by_hue, tone * by_tone);
      if (tone < 0.5F * shadow) {  // perhaps darker than a shadow: compare levels without kDarkLevel
        const float darker = std::log((here / 3.0F + kBlack) / (std::max(there, 0.0F) / 3.0F + kBlack)) / shadow;
        if (darker > kNearlyDark) found = std::max(found, darker);
        if (darker > black && difference > static_cast<float>(contrast)) score.black.set(x, y);
      }
      const float limit = difference * by_levels;
      score.certain[first + static_cast<std::size_t>(x)] = fixed(std::min(found, limit));
      score.dark[first + static_cast<std::size_t>(x)] = fixed(std::min(-tone * by_tone, limit));
    }
  }
  return score;
}

/// Greatest evidence within kReach pixels on both axes.
std::vector<std::uint8_t> greatest_nearby(const std::vector<std::uint8_t>& score, int height, int width) {
  const auto length = static_cast<std::size_t>(width);
  std::vector<std::uint8_t> rows(score.size());
  std::vector<std::uint8_t> result(score.size());
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* in = score.data() + static_cast<std::size_t>(y) * length;
    std::uint8_t* out = rows.data() + static_cast<std::size_t>(y) * length;
    std::copy_n(in, length, out);
    for (int shift = 1; shift <= std::min(kReach, width - 1); ++shift) {
      const auto k = static_cast<std::size_t>(shift);
      for (std::size_t x = k; x < length; ++x) out[x] = std::max(out[x], in[x - k]);
      for (std::size_t x = 0; x + k < length; ++x) out[x] = std::max(out[x], in[x + k]);
    }
  }
  for (int y = 0; y < height; ++y) {
    std::uint8_t* out = result.data() + static_cast<std::size_t>(y) * length;
    for (int other = std::max(y - kReach, 0); other <= std::min(y + kReach, height - 1); ++other) {
      const std::uint8_t* in = rows.data() + static_cast<std::size_t>(other) * length;
      for (std::size_t x = 0; x < length; ++x) out[x] = std::max(out[x], in[x]);
    }
  }
  return result;
}

/// Adds the pixels of one image to another one.
void unite(BitImage& image, const BitImage& more) {
  for (int y = 0; y < image.height(); ++y) {
    for (int w = 0; w < image.words(); ++w) image.row(y)[w] |= more.row(y)[w];
  }
}

/// Adds the regions of weak pixels with enough strong pixels in them, except where `is_wanted` refuses a region.
template <class IsWanted>
void add_regions(const std::vector<std::uint8_t>& score, const BitImage& black, BitImage& mask,
                 const IsWanted& is_wanted) {
  const std::vector<std::uint8_t> nearby = greatest_nearby(score, mask.height(), mask.width());
  std::vector<std::uint8_t> weak(score.size());
  for (std::size_t i = 0; i < score.size(); ++i) {
    const int most = std::min<int>(nearby[i], kGreatest * kStrong);
    weak[i] = score[i] > kWeak && score[i] > kEdge * most;
  }
  const auto is_strong = [&](Pixel pixel) {
    return score[static_cast<std::size_t>(pixel.y) * static_cast<std::size_t>(mask.width()) +
                 static_cast<std::size_t>(pixel.x)] > kStrong;
  };
  BitImage regions = pack(weak.data(), mask.height(), mask.width(), mask.width());
  // A blurred edge lies between the cable and the ground: black pixels beside a brighter cable are no edge of it.
  unite(regions, black);
  for_each_region(regions, [&](const std::vector<Pixel>& region) {
    const auto strong = std::count_if(region.begin(), region.end(), is_strong);
    if (strong < kStrongPixels || region.size() < kPixels || !is_wanted(region)) return;
    for (const Pixel pixel : region) mask.set(pixel.x, pixel.y);
  });
}

/// Adds dark lines that are no shadows: a shadow lies beside what casts it.
void add_dark_lines(const std::vector<std::uint8_t>& dark, BitImage& mask) {
  BitImage beside = mask;
  for (int i = 0; i < kShadowReach; ++i) beside = dilate(beside);
  add_regions(dark, BitImage(mask.height(), mask.width()), mask, [&beside](const std::vector<Pixel>& region) {
    const auto near = std::count_if(region.begin(), region.end(), [&](Pixel p) { return beside.at(p.x, p.y); });
    return static_cast<double>(near) < kShadowShare * static_cast<double>(region.size());
  });
}

/// Width of most lines of a mask [px]. Erosion by one pixel takes two from the width w of a line, so k erosions leave
/// the share 1 - 2 k / w of its pixels. The largest k times the pixels left lies at k = w / 4, where thinner lines are
/// gone; there the share that one more erosion takes gives w.
double line_width(const BitImage& mask) {
  double greatest = 0.0;
  double width = 1.0;
  BitImage inner = mask;
  auto left = static_cast<double>(mask.count());
  for (int depth = 0; left > 0.0; ++depth) {
    inner = erode(inner);
    const auto next = static_cast<double>(inner.count());
    if (next == left) return width;  // everything is set
    if (depth * left > greatest) {
      greatest = depth * left;
      width = 2.0 * depth + 2.0 / (1.0 - next / left);
    }
    left = next;
  }
  return width;
}

/// Closes gaps of two pixels, and removes lines thinner than kThin times the cables by opening. A square of this side
/// fits into a line in any direction, because kThin is less than 1 / sqrt(2).
constexpr double kThin = 0.65;

/// Regions shorter than this are grain or seams, not cables [widths of most lines].
constexpr double kShortest = 4.0;

BitImage without_thin_lines(BitImage mask) {
  mask = erode(dilate(mask));
  const double width = line_width(mask);
  const int radius = std::max(1, static_cast<int>(0.5 * (kThin * width - 1.0)));
  for (int i = 0; i < radius; ++i) mask = erode(mask);
  for (int i = 0; i < radius; ++i) mask = dilate(mask);
  return without_specks(mask, static_cast<std::size_t>(kShortest * width * width));
}

}  // namespace

bool has_dark_ground(const ColorImage& image, int contrast) {
  return (1.0 - kDarkestShadow) * median_level(image) < contrast;
}

void ground_mask(const ColorImage& image, int contrast, std::uint8_t* mask) {
  if (image.height <= 0 || image.width <= 0) return;
  if (has_dark_ground(image, contrast)) {
    foreground_mask(image, contrast, mask);
    return;
  }
  const Smoothed smoothed(image);
  const std::array<float, 256> table = logarithms();
  const Ground ground(smoothed, table);
  const Evidence found = evidence(smoothed, ground, table, contrast);
  BitImage cables(image.height, image.width);
  add_regions(found.certain, found.black, cables, [](const std::vector<Pixel>&) { return true; });
  add_dark_lines(found.dark, cables);
  if (cables.count() > 0) cables = without_thin_lines(std::move(cables));
  unpack(cables, mask);
}

}  // namespace withe
