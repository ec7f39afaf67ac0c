#pragma once
/// Binary images with one bit a pixel: 64 pixels of a row are handled by one machine instruction.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace withe {

/// A position in an image, x to the right and y downwards, (0, 0) the first pixel.
struct Pixel {
  int x = 0;
  int y = 0;
  bool operator==(const Pixel&) const = default;
};

/// A binary image. Every row is framed by one empty word on each side and the image by one empty row above and
/// below, so that neighbours of every pixel can be read without looking for the border.
class BitImage {
 public:
  BitImage() = default;
  BitImage(int height, int width);

  int height() const { return height_; }
  int width() const { return width_; }
  /// Words of a row that hold pixels.
  int words() const { return words_; }
  /// Words from one row to the next.
  std::ptrdiff_t stride() const { return stride_; }

  /// First word with pixels of row y, -1 <= y <= height.
  std::uint64_t* row(int y) { return bits_.data() + (y + 1) * stride_ + 1; }
  const std::uint64_t* row(int y) const { return bits_.data() + (y + 1) * stride_ + 1; }

  /// Pixels outside the image are background.
  bool at(int x, int y) const {
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return false;
    return (row(y)[x >> 6] >> (x & 63)) & 1U;
  }
  void set(int x, int y) { row(y)[x >> 6] |= std::uint64_t{1} << (x & 63); }
  void clear(int x, int y) { row(y)[x >> 6] &= ~(std::uint64_t{1} << (x & 63)); }

  /// Number of pixels that are set.
  std::size_t count() const;
  /// Bits of the last word of a row that are pixels.
  std::uint64_t last_word() const { return last_word_; }

  bool operator==(const BitImage&) const = default;

 private:
  int height_ = 0;
  int width_ = 0;
  int words_ = 0;
  std::ptrdiff_t stride_ = 0;
  std::uint64_t last_word_ = 0;
  std::vector<std::uint64_t> bits_;
};

/// Number of pixels that differ between two images of one size.
std::size_t count_differences(const BitImage& a, const BitImage& b);

/// From one byte a pixel, zero is background. `stride` is the number of bytes from one row to the next.
BitImage pack(const std::uint8_t* pixels, int height, int width, std::ptrdiff_t stride);
/// To one byte a pixel, 0 or 1, rows one after the other.
void unpack(const BitImage& image, std::uint8_t* pixels);

/// Dilation and erosion by a square of 3 x 3 pixels. Pixels outside the image are ignored.
BitImage dilate(const BitImage& image);
BitImage erode(const BitImage& image);

/// Pixels with at least five of the nine pixels around them set: frays and pinholes vanish, straight borders stay.
/// Beyond the border the image continues as it ends.
BitImage majority(const BitImage& image);

/// Calls `visit` with the pixels of each region; pixels that touch at a corner are in one region.
void for_each_region(BitImage image, const std::function<void(const std::vector<Pixel>&)>& visit);

/// The image without its regions of fewer pixels than `least`.
BitImage without_specks(const BitImage& image, std::size_t least);

/// Distance from a pixel that is set to the nearest one that is not, Euclidean and exact [px]. Pixels outside the
/// image count as background only where `border_is_background`. At most `limit` is returned.
double distance_to_background(const BitImage& image, Pixel pixel, double limit, bool border_is_background);

/// The number of a set pixel in reading order, by counting bits; a map from pixels to rows of a table that costs
/// no image.
class PixelIndex {
 public:
  explicit PixelIndex(const BitImage& image);
  int operator()(int x, int y) const {
    const std::uint64_t before = image_->row(y)[x >> 6] & ((std::uint64_t{1} << (x & 63)) - 1);
    return first_[static_cast<std::size_t>(y) * image_->words() + (x >> 6)] + std::popcount(before);
  }
  const std::vector<Pixel>& pixels() const { return pixels_; }

 private:
  const BitImage* image_;
  std::vector<int> first_;
  std::vector<Pixel> pixels_;
};

}  // namespace withe
