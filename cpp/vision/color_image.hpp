#pragma once
/// Colour pictures, and masks from their colours.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/types.hpp"

namespace withe {

/// A picture that somebody else owns: three bytes a pixel, red, green, blue.
struct ColorImage {
  const std::uint8_t* pixels = nullptr;
  int height = 0;
  int width = 0;
  std::ptrdiff_t stride = 0;  ///< bytes from one row to the next

  const std::uint8_t* at(int x, int y) const { return pixels + y * stride + 3 * x; }
  /// Colour between pixels by bilinear interpolation. Outside the image it is the colour of the border.
  Eigen::Vector3f sample(const Vector2& point) const;
};

/// Lowest and highest hue (0 to 180, half degrees), saturation and value (0 to 255), all inclusive.
struct HsvRange {
  std::array<int, 3> low{};
  std::array<int, 3> high{};
};

/// Hue, saturation and value of a colour, rounded as OpenCV does for bytes.
std::array<int, 3> to_hsv(int red, int green, int blue);

/// One byte a pixel: 1 where the colour lies in one of the ranges. Dark pixels below all ranges are passed over eight
/// at a time.
void hsv_mask(const ColorImage& image, const std::vector<HsvRange>& ranges, std::uint8_t* mask);

/// One byte per pixel: 1 if the colour is far from the median colour of the image border. The distance is the largest
/// difference of a channel. Its threshold best separates two classes of the square roots of the distance [Otsu 1979].
/// All pixels are 0 if the classes differ by less than `contrast` levels.
void foreground_mask(const ColorImage& image, int contrast, std::uint8_t* mask);

}  // namespace withe
