#pragma once
/// Colours of strands as classes: which pixels of a mask have clearly different colours.

#include <cstdint>
#include <vector>

#include "vision/color_image.hpp"
#include "vision/crossing_zones.hpp"

namespace withe {

/// Colour as logarithms of the channels: two coordinates of chromaticity, which shading keeps, and the brightness.
struct LogColor {
  Eigen::Vector2f chromaticity = Eigen::Vector2f::Zero();
  float brightness = 0;
};

/// Difference of two colours; above 1 they are clearly different. Shading and shadows change the brightness of a
/// strand. The brightness therefore counts much less than the chromaticity.
float color_difference(const LogColor& a, const LogColor& b);

/// Mean colour along the pixels [first, last] of an edge, over 3 x 3 pixels around each.
LogColor mean_color(const ColorImage& image, const SkeletonEdge& edge, int first, int last);

/// Colour of a branch beside its zone or tip, over up to four widths.
LogColor branch_color(const ColorImage& image, const SkeletonGraph& graph, const Continuations& links, HalfEdge half);

/// True if the result that follows from the shapes alone contradicts the colours:
///
/// - two branches of clearly different colours continue each other
/// - the colour changes along an edge
/// - a branch is left over in a zone whose branches have clearly different colours
bool contradicts_colors(const ColorImage& image, const SkeletonGraph& graph, const Continuations& links);

/// A class of colour for every pixel of a mask.
class StrandClasses {
 public:
  /// The classes are the most frequent colours along the skeleton that differ clearly. Every pixel belongs to the class
  /// of the most similar colour. Regions much narrower than a cable have blended colours; they go to their neighbours.
  StrandClasses(const ColorImage& image, const SkeletonGraph& graph, const BitImage& mask);

  int count() const { return static_cast<int>(colors_.size()); }
  /// Class of a pixel; -1 outside the mask, and everywhere if there are fewer than two classes.
  int at(int x, int y) const {
    if (classes_.empty() || x < 0 || y < 0 || x >= width_ || y >= height_) return -1;
    return classes_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
  }
  /// Pixels of the class of a pixel; empty where `at` is -1.
  BitImage region_of(const Vector2& point) const;
  /// Removes pixels between classes, so that pixels of two classes do not touch. Returns true if it removed any.
  bool cut(BitImage& mask) const;

 private:
  void find_colors(const ColorImage& image, const SkeletonGraph& graph);
  void classify(const ColorImage& image, const BitImage& mask, int opening);

  int height_ = 0;
  int width_ = 0;
  std::vector<LogColor> colors_;
  std::vector<std::int8_t> classes_;
};

}  // namespace withe
