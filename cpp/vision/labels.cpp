#include "vision/labels.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>

namespace withe {

namespace {

class Painter {
 public:
  Painter(const BitImage& mask, std::int32_t* labels)
      : mask_(mask),
        labels_(labels),
        nearest_(std::make_unique_for_overwrite<float[]>(static_cast<std::size_t>(mask.height()) *
                                                         static_cast<std::size_t>(mask.width()))) {}

  /// Gives the pixels of the mask near a segment to a label where no other centreline is nearer.
  void paint_nearest(const Vector2& a, const Vector2& b, double half_width, std::int32_t label) {
    const double reach = 1.15 * half_width + 1.5;
    const auto scale = static_cast<float>(1 / (half_width * half_width));
    each_pixel(a, b, reach, [&](std::size_t pixel, float squared) {
      const float distance = squared * scale;
      if (labels_[pixel] != 0 && nearest_[pixel] <= distance) return;
      labels_[pixel] = label;
      nearest_[pixel] = distance;
    });
  }

  /// Gives all pixels of the mask within a distance of a segment to a label.
  void paint_over(const Vector2& a, const Vector2& b, double half_width, std::int32_t label) {
    const auto limit = static_cast<float>(half_width * half_width);
    each_pixel(a, b, half_width, [&](std::size_t pixel, float squared) {
      if (squared > limit) return;
      labels_[pixel] = label;
      nearest_[pixel] = -1;
    });
  }

  /// Gives the remaining pixels of the mask the label of their neighbours, ring by ring.
  void fill_rest() {
    const int width = mask_.width();
    std::vector<int> ring;
    std::vector<int> next;
    const auto each_open = [&](int pixel, auto&& action) {
      const int x = pixel % width;
      const int y = pixel / width;
      if (x > 0 && open(x - 1, y)) action(pixel - 1);
      if (x + 1 < width && open(x + 1, y)) action(pixel + 1);
      if (y > 0 && open(x, y - 1)) action(pixel - width);
      if (y + 1 < mask_.height() && open(x, y + 1)) action(pixel + width);
    };
    for (int y = 0; y < mask_.height(); ++y) {
      const std::uint64_t* row = mask_.row(y);
      for (int w = 0; w < mask_.words(); ++w) {
        for (std::uint64_t rest = row[w]; rest != 0; rest &= rest - 1) {
          const int pixel = y * width + 64 * w + std::countr_zero(rest);
          if (labels_[pixel] == 0) unlabelled_.push_back(pixel);
        }
      }
    }
    for (const int pixel : unlabelled_) {
      const int x = pixel % width;
      const int y = pixel / width;
      const std::int32_t label = label_beside(x, y);
      if (label != 0) ring.push_back(pixel);
    }
    std::vector<std::int32_t> colours;
    while (!ring.empty()) {
      colours.clear();
      for (const int pixel : ring) colours.push_back(label_beside(pixel % width, pixel / width));
      for (std::size_t i = 0; i < ring.size(); ++i) labels_[ring[i]] = colours[i];
      next.clear();
      for (const int pixel : ring) {
        each_open(pixel, [&](int other) { next.push_back(other); });
      }
      std::sort(next.begin(), next.end());
      next.erase(std::unique(next.begin(), next.end()), next.end());
      ring.swap(next);
    }
  }

 private:
  bool open(int x, int y) const { return mask_.at(x, y) && labels_[y * mask_.width() + x] == 0; }

  std::int32_t label_beside(int x, int y) const {
    const int width = mask_.width();
    const std::int32_t* here = labels_ + static_cast<std::ptrdiff_t>(y) * width + x;
    if (x > 0 && here[-1] != 0) return here[-1];
    if (x + 1 < width && here[1] != 0) return here[1];
    if (y > 0 && here[-width] != 0) return here[-width];
    if (y + 1 < mask_.height() && here[width] != 0) return here[width];
    return 0;
  }

  /// Calls action(pixel, squared distance to the segment) for the pixels of the mask in a box around it.
  template <class Action>
  void each_pixel(const Vector2& a, const Vector2& b, double reach, Action&& action) {
    const int left = std::max(0, static_cast<int>(std::ceil(std::min(a.x(), b.x()) - reach)));
    const int right = std::min(mask_.width() - 1, static_cast<int>(std::floor(std::max(a.x(), b.x()) + reach)));
    const int top = std::max(0, static_cast<int>(std::ceil(std::min(a.y(), b.y()) - reach)));
    const int bottom = std::min(mask_.height() - 1, static_cast<int>(std::floor(std::max(a.y(), b.y()) + reach)));
    const auto dx = static_cast<float>(b.x() - a.x());
    const auto dy = static_cast<float>(b.y() - a.y());
    const float inverse = 1 / std::max(dx * dx + dy * dy, 1e-12F);
    const auto limit = static_cast<float>(reach * reach);
    for (int y = top; y <= bottom; ++y) {
      const std::uint64_t* row = mask_.row(y);
      const auto ry = static_cast<float>(y - a.y());
      for (int w = left >> 6; w <= right >> 6; ++w) {
        std::uint64_t bits = row[w];
        if (w == left >> 6) bits &= ~std::uint64_t{0} << (left & 63);
        if (w == right >> 6) bits &= ~std::uint64_t{0} >> (63 - (right & 63));
        for (; bits != 0; bits &= bits - 1) {
          const int x = 64 * w + std::countr_zero(bits);
          const auto rx = static_cast<float>(x - a.x());
          const float t = std::clamp((rx * dx + ry * dy) * inverse, 0.0F, 1.0F);
          const float ex = rx - t * dx;
          const float ey = ry - t * dy;
          const float squared = ex * ex + ey * ey;
          if (squared <= limit) {
            action(static_cast<std::size_t>(y) * static_cast<std::size_t>(mask_.width()) + static_cast<std::size_t>(x),
                   squared);
          }
        }
      }
    }
  }

  const BitImage& mask_;
  std::int32_t* labels_;
  std::unique_ptr<float[]> nearest_;  // only read at pixels with a label: memory pages without mask are never used
  std::vector<int> unlabelled_;
};

Vector2 row_of(const Cable& cable, std::ptrdiff_t row) {
  const std::ptrdiff_t n = cable.centreline.rows();
  return cable.centreline.row(cable.closed ? (row % n + n) % n : std::clamp<std::ptrdiff_t>(row, 0, n - 1)).transpose();
}

double half_width_of(const Cable& cable, std::ptrdiff_t row) {
  const auto n = static_cast<std::ptrdiff_t>(cable.widths.size());
  row = cable.closed ? (row % n + n) % n : std::clamp<std::ptrdiff_t>(row, 0, n - 1);
  return 0.5 * cable.widths[static_cast<std::size_t>(row)];
}

/// Paints the upper cable of a crossing from where its flank enters the lower one to where it leaves.
void paint_upper(Painter& painter, const Tracing& tracing, const Crossing& crossing) {
  const Cable& over = tracing.cables[static_cast<std::size_t>(crossing.over.cable)];
  const Cable& under = tracing.cables[static_cast<std::size_t>(crossing.under.cable)];
  const int o = crossing.over.row;
  const int u = crossing.under.row;
  const Vector2 along = (row_of(over, o + 3) - row_of(over, o - 3)).normalized();
  const Vector2 across = (row_of(under, u + 3) - row_of(under, u - 3)).normalized();
  const double sine = std::abs(along.x() * across.y() - along.y() * across.x());
  const double cosine = std::abs(along.dot(across));
  const double reach = (half_width_of(under, u) + half_width_of(over, o) * cosine) / std::max(sine, 0.12) + 1;
  const double spacing = (row_of(over, o + 1) - row_of(over, o - 1)).norm() / 2;
  const int rows = static_cast<int>(std::ceil(reach / std::max(spacing, 0.25)));
  for (int row = o - rows; row < o + rows; ++row) {
    if (!over.closed && (row < 0 || row + 1 >= over.centreline.rows())) continue;
    painter.paint_over(row_of(over, row), row_of(over, row + 1), half_width_of(over, row) + 0.3,
                       crossing.over.cable + 1);
  }
}

}  // namespace

void paint_labels(const BitImage& mask, const Tracing& tracing, std::int32_t* labels) {
  Painter painter(mask, labels);
  for (std::size_t c = 0; c < tracing.cables.size(); ++c) {
    const Cable& cable = tracing.cables[c];
    const std::ptrdiff_t n = cable.centreline.rows();
    const std::ptrdiff_t segments = cable.closed ? n : n - 1;
    constexpr std::ptrdiff_t step = 4;  // rows; the arc of a tight bend rises less than 0.3 px over them
    for (std::ptrdiff_t row = 0; row < segments; row += step) {
      const std::ptrdiff_t end = std::min(row + step, segments);
      painter.paint_nearest(row_of(cable, row), row_of(cable, end), half_width_of(cable, (row + end) / 2),
                            static_cast<std::int32_t>(c) + 1);
    }
    if (n == 1)
      painter.paint_nearest(row_of(cable, 0), row_of(cable, 0), half_width_of(cable, 0),
                            static_cast<std::int32_t>(c) + 1);
  }
  painter.fill_rest();
  for (const Crossing& crossing : tracing.crossings) {
    if (crossing.confidence > 0 && crossing.over.cable != crossing.under.cable) {
      paint_upper(painter, tracing, crossing);
    }
  }
}

void paint_discs(const BitImage& mask, const Tracing& tracing, std::int32_t* labels) {
  const int width = mask.width();
  std::vector<int> radii;
  const auto paint = [&](int number, std::ptrdiff_t row) {
    const Vector2 at = row_of(tracing.cables[static_cast<std::size_t>(number)], row);
    const auto cx = static_cast<int>(std::lround(at.x()));
    const auto cy = static_cast<int>(std::lround(at.y()));
    const int radius = radii[static_cast<std::size_t>(number)];
    for (int y = std::max(0, cy - radius); y <= std::min(mask.height() - 1, cy + radius); ++y) {
      const auto reach = static_cast<int>(std::sqrt(radius * radius - (y - cy) * (y - cy)));
      std::int32_t* line = labels + static_cast<std::ptrdiff_t>(y) * width;
      for (int x = std::max(0, cx - reach); x <= std::min(width - 1, cx + reach); ++x) line[x] = number + 1;
    }
  };
  for (std::size_t c = 0; c < tracing.cables.size(); ++c) {
    std::vector<double> widths = tracing.cables[c].widths;
    const auto middle = widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2);
    std::nth_element(widths.begin(), middle, widths.end());
    radii.push_back(static_cast<int>(std::lround(0.5 * *middle)));
    for (Eigen::Index row = 0; row < tracing.cables[c].centreline.rows(); ++row) paint(static_cast<int>(c), row);
  }
  for (const Crossing& crossing : tracing.crossings) {
    if (crossing.confidence <= 0) continue;
    const Cable& over = tracing.cables[static_cast<std::size_t>(crossing.over.cable)];
    for (int row = crossing.over.row - 8; row <= crossing.over.row + 8; ++row) {
      if (over.closed || (row >= 0 && row < over.centreline.rows())) paint(crossing.over.cable, row);
    }
  }
}

double labelled_share(const BitImage& mask, const std::int32_t* labels) {
  if (mask.count() == 0) return 1.0;
  const BitImage opened = dilate(erode(mask));
  std::size_t all = 0;
  std::size_t labelled = 0;
  for (int y = 0; y < opened.height(); ++y) {
    const std::int32_t* row = labels + static_cast<std::ptrdiff_t>(y) * opened.width();
    for (int w = 0; w < opened.words(); ++w) {
      for (std::uint64_t rest = opened.row(y)[w]; rest != 0; rest &= rest - 1) {
        ++all;
        labelled += row[64 * w + std::countr_zero(rest)] > 0;
      }
    }
  }
  return all == 0 ? 0.0 : static_cast<double>(labelled) / static_cast<double>(all);
}

}  // namespace withe
