#include "vision/bit_image.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace withe {

namespace {

constexpr std::uint64_t kOnes = ~std::uint64_t{0};

/// The pixels to the left and to the right of every pixel of word w.
std::uint64_t from_left(const std::uint64_t* row, int w) { return (row[w] << 1) | (row[w - 1] >> 63); }
std::uint64_t from_right(const std::uint64_t* row, int w) { return (row[w] >> 1) | (row[w + 1] << 63); }

/// Full adder, bit by bit.
struct Sum {
  std::uint64_t ones, twos;
};
Sum add(std::uint64_t a, std::uint64_t b, std::uint64_t c) { return {a ^ b ^ c, (a & b) | (c & (a ^ b))}; }

/// Nearest zero bit to the left of x (inclusive) in a row; -1 if every pixel up to the border is set.
int nearest_clear_left(const std::uint64_t* row, int x) {
  int w = x >> 6;
  std::uint64_t clear = ~row[w] & (kOnes >> (63 - (x & 63)));
  while (clear == 0) {
    if (--w < 0) return -1;
    clear = ~row[w];
  }
  return 64 * w + 63 - std::countl_zero(clear);
}

/// Nearest zero bit to the right of x (inclusive); at least `width` if every pixel up to the border is set.
int nearest_clear_right(const std::uint64_t* row, int x, int words) {
  int w = x >> 6;
  std::uint64_t clear = ~row[w] & (kOnes << (x & 63));
  while (clear == 0) {
    if (++w >= words) return 64 * words;
    clear = ~row[w];
  }
  return 64 * w + std::countr_zero(clear);
}

}  // namespace

BitImage::BitImage(int height, int width)
    : height_(height),
      width_(width),
      words_((width + 63) / 64),
      stride_(words_ + 2),
      last_word_(width % 64 == 0 ? kOnes : kOnes >> (64 - width % 64)),
      bits_(static_cast<std::size_t>(height + 2) * (words_ + 2), 0) {}

std::size_t BitImage::count() const {
  std::size_t sum = 0;
  for (const std::uint64_t word : bits_) sum += static_cast<std::size_t>(std::popcount(word));
  return sum;
}

std::size_t count_differences(const BitImage& a, const BitImage& b) {
  std::size_t count = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int w = 0; w < a.words(); ++w) count += static_cast<std::size_t>(std::popcount(a.row(y)[w] ^ b.row(y)[w]));
  }
  return count;
}

BitImage pack(const std::uint8_t* pixels, int height, int width, std::ptrdiff_t stride) {
  BitImage image(height, width);
  constexpr std::uint64_t low = 0x7f7f7f7f7f7f7f7fULL;
  constexpr std::uint64_t gather = 0x0102040810204080ULL;
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* source = pixels + y * stride;
    std::uint64_t* row = image.row(y);
    int x = 0;
    if constexpr (std::endian::native == std::endian::little) {
      for (; x + 8 <= width; x += 8) {
        std::uint64_t eight = 0;
        std::memcpy(&eight, source + x, 8);
        if (eight == 0) continue;
        const std::uint64_t ones = ((eight | ((eight & low) + low)) >> 7) & 0x0101010101010101ULL;
        row[x >> 6] |= ((ones * gather) >> 56) << (x & 63);
      }
    }
    for (; x < width; ++x) {
      if (source[x] != 0) row[x >> 6] |= std::uint64_t{1} << (x & 63);
    }
  }
  return image;
}

void unpack(const BitImage& image, std::uint8_t* pixels) {
  constexpr std::uint64_t low = 0x7f7f7f7f7f7f7f7fULL;
  constexpr std::uint64_t spread = 0x8040201008040201ULL;
  for (int y = 0; y < image.height(); ++y) {
    const std::uint64_t* row = image.row(y);
    std::uint8_t* target = pixels + static_cast<std::size_t>(y) * image.width();
    int x = 0;
    if constexpr (std::endian::native == std::endian::little) {
      for (; x + 8 <= image.width(); x += 8) {
        const std::uint64_t eight = (((row[x >> 6] >> (x & 63)) & 0xff) * 0x0101010101010101ULL) & spread;
        const std::uint64_t ones = (((eight & low) + low) | eight) >> 7 & 0x0101010101010101ULL;
        std::memcpy(target + x, &ones, 8);
      }
    }
    for (; x < image.width(); ++x) target[x] = (row[x >> 6] >> (x & 63)) & 1U;
  }
}

BitImage dilate(const BitImage& image) {
  BitImage result(image.height(), image.width());
  for (int y = 0; y < image.height(); ++y) {
    const std::uint64_t* row = image.row(y);
    // Every row affects three rows. Empty words are skipped.
    for (int w = 0; w < image.words(); ++w) {
      const std::uint64_t any = row[w] | from_left(row, w) | from_right(row, w);
      if (any == 0) continue;
      for (int dy = -1; dy <= 1; ++dy) result.row(y + dy)[w] |= any;
    }
  }
  for (int y = -1; y <= image.height(); ++y) {
    std::uint64_t* out = result.row(y);
    if (y < 0 || y == image.height()) {
      std::fill(out, out + image.words(), 0);
    } else {
      out[image.words() - 1] &= image.last_word();
    }
  }
  return result;
}

BitImage erode(const BitImage& image) {
  BitImage result(image.height(), image.width());
  const int words = image.words();
  const std::uint64_t last_pixel = std::uint64_t{1} << ((image.width() - 1) & 63);
  const auto all_three = [&](const std::uint64_t* row, int w) {
    std::uint64_t left = from_left(row, w);
    std::uint64_t right = from_right(row, w);
    if (w == 0) left |= 1U;
    if (w == words - 1) right |= last_pixel;
    return row[w] & left & right;
  };
  for (int y = 0; y < image.height(); ++y) {
    const std::uint64_t* row = image.row(y);
    std::uint64_t* out = result.row(y);
    for (int w = 0; w < words; ++w) {
      if (row[w] == 0) continue;
      std::uint64_t all = all_three(row, w);
      if (y > 0) all &= all_three(image.row(y - 1), w);
      if (y + 1 < image.height()) all &= all_three(image.row(y + 1), w);
      out[w] = all;
    }
  }
  return result;
}

BitImage majority(const BitImage& image) {
  BitImage result(image.height(), image.width());
  const int words = image.words();
  const int last = (image.width() - 1) & 63;
  // Sums of three pixels side by side, for the row above, the row itself and the row below, kept while going down.
  std::vector<Sum> sums(3 * static_cast<std::size_t>(words));
  std::vector<char> empty(3, 1);
  const auto sum_row = [&](int y) {
    const int slot = (y + 3) % 3;
    const std::uint64_t* row = image.row(std::clamp(y, 0, image.height() - 1));
    std::uint64_t any = 0;
    for (int w = 0; w < words; ++w) {
      std::uint64_t left = from_left(row, w);
      std::uint64_t right = from_right(row, w);
      if (w == 0) left |= row[0] & 1U;
      if (w == words - 1) right |= row[w] & (std::uint64_t{1} << last);
      sums[static_cast<std::size_t>(slot) * words + w] = add(left, row[w], right);
      any |= row[w];
    }
    empty[static_cast<std::size_t>(slot)] = any == 0;
  };
  sum_row(-1);
  sum_row(0);
  for (int y = 0; y < image.height(); ++y) {
    sum_row(y + 1);
    if (empty[0] && empty[1] && empty[2]) continue;
    std::uint64_t* out = result.row(y);
    for (int w = 0; w < words; ++w) {
      const Sum a = sums[static_cast<std::size_t>(w)];
      const Sum b = sums[static_cast<std::size_t>(words + w)];
      const Sum c = sums[static_cast<std::size_t>(2 * words + w)];
      const Sum ones = add(a.ones, b.ones, c.ones);
      const Sum twos = add(a.twos, b.twos, c.twos);
      // total = ones.ones + 2 (ones.twos + twos.ones) + 4 twos.twos, wanted: total >= 5
      const std::uint64_t two = ones.twos ^ twos.ones;
      const std::uint64_t carry = ones.twos & twos.ones;
      const std::uint64_t four = carry ^ twos.twos;
      const std::uint64_t eight = carry & twos.twos;
      out[w] = eight | (four & (two | ones.ones));
    }
    out[words - 1] &= image.last_word();
  }
  return result;
}

void for_each_region(BitImage left, const std::function<void(const std::vector<Pixel>&)>& visit) {
  std::vector<Pixel> region;
  for (int y = 0; y < left.height(); ++y) {
    for (int w = 0; w < left.words(); ++w) {
      while (const std::uint64_t bits = left.row(y)[w]) {
        region.assign(1, {64 * w + std::countr_zero(bits), y});
        left.clear(region.front().x, y);
        for (std::size_t next = 0; next < region.size(); ++next) {
          const Pixel pixel = region[next];
          for (int dy = -1; dy <= 1; ++dy) {
            for (int dx = -1; dx <= 1; ++dx) {
              const Pixel other{pixel.x + dx, pixel.y + dy};
              if (!left.at(other.x, other.y)) continue;
              left.clear(other.x, other.y);
              region.push_back(other);
            }
          }
        }
        visit(region);
      }
    }
  }
}

BitImage without_specks(const BitImage& image, std::size_t least) {
  BitImage result = image;
  for_each_region(image, [&result, least](const std::vector<Pixel>& region) {
    if (region.size() >= least) return;
    for (const Pixel pixel : region) result.clear(pixel.x, pixel.y);
  });
  return result;
}

double distance_to_background(const BitImage& image, Pixel pixel, double limit, bool border_is_background) {
  const auto [x, y] = pixel;
  const int width = image.width();
  double best = limit * limit;
  for (int dy = 0; dy * dy < best; ++dy) {
    for (const int row_y : {y - dy, y + dy}) {
      if (row_y < 0 || row_y >= image.height()) {
        if (border_is_background) best = std::min(best, static_cast<double>(dy) * dy);
        continue;
      }
      const std::uint64_t* row = image.row(row_y);
      const int left = nearest_clear_left(row, x);
      if (left >= 0 || border_is_background) {
        best = std::min(best, static_cast<double>(x - left) * (x - left) + dy * dy);
      }
      const int right = nearest_clear_right(row, x, image.words());
      if (right < width || border_is_background) {
        best = std::min(best, static_cast<double>(right - x) * (right - x) + dy * dy);
      }
    }
  }
  return std::sqrt(best);
}

PixelIndex::PixelIndex(const BitImage& image) : image_(&image) {
  first_.resize(static_cast<std::size_t>(image.height()) * image.words());
  std::size_t slot = 0;
  for (int y = 0; y < image.height(); ++y) {
    const std::uint64_t* row = image.row(y);
    for (int w = 0; w < image.words(); ++w) {
      first_[slot++] = static_cast<int>(pixels_.size());
      for (std::uint64_t rest = row[w]; rest != 0; rest &= rest - 1) {
        pixels_.push_back({64 * w + std::countr_zero(rest), y});
      }
    }
  }
}

}  // namespace withe
