#include "vision/thinning.hpp"

#include <array>
#include <utility>

namespace withe {

namespace {

/// Passes, as a sum of 1 (first) and 2 (second), in which a pixel goes by the rule of Zhang and Suen. The
/// neighbours are the bits of `code`, clockwise from the upper left.
constexpr int zhang_suen(int code) {
  const auto bit = [code](int k) { return (code >> (k % 8)) & 1; };
  int neighbours = 0;
  int starts = 0;  // changes from background to object around the pixel
  for (int k = 0; k < 8; ++k) {
    neighbours += bit(k);
    starts += !bit(k) && bit(k + 1);
  }
  if (neighbours < 2 || neighbours > 6 || starts != 1) return 0;
  const bool north = bit(1), east = bit(3), south = bit(5), west = bit(7);
  const bool first = !(north && east && south) && !(east && south && west);
  const bool second = !(north && east && west) && !(north && south && west);
  return (first ? 1 : 0) + (second ? 2 : 0);
}

/// Neighbourhoods that are decided otherwise: corners of staircases go, tips of diagonals stay longer.
constexpr std::array<std::pair<int, int>, 25> kExceptions{
    {{3, 1},   {6, 1},   {10, 3},  {11, 1},  {12, 1},  {14, 1},  {24, 2},  {26, 2},  {40, 3},
     {48, 0},  {56, 2},  {96, 2},  {104, 2}, {108, 2}, {129, 0}, {130, 3}, {131, 1}, {134, 1},
     {160, 3}, {161, 1}, {176, 2}, {192, 2}, {194, 1}, {198, 1}, {224, 2}}};

constexpr std::array<int, 256> make_table() {
  std::array<int, 256> table{};
  for (int code = 0; code < 256; ++code) table[static_cast<std::size_t>(code)] = zhang_suen(code);
  for (const auto& [code, passes] : kExceptions) table[static_cast<std::size_t>(code)] = passes;
  return table;
}
constexpr std::array<int, 256> kTable = make_table();

/// Neighbours in the order in which the decision looks at them: sides first, then corners.
constexpr std::array<int, 8> kOrder{1, 3, 5, 7, 0, 2, 4, 6};

using Neighbours = std::array<std::uint64_t, 8>;

/// True if the table is constant once the first `Depth` neighbours of the order are `Code`: 0, 1, or -1 for neither.
template <int Pass, int Depth, int Code>
constexpr int constant() {
  int seen = -1;
  for (int rest = 0; rest < (1 << (8 - Depth)); ++rest) {
    int code = Code;
    for (int k = Depth; k < 8; ++k) code |= ((rest >> (k - Depth)) & 1) << kOrder[static_cast<std::size_t>(k)];
    const int value = (kTable[static_cast<std::size_t>(code)] & Pass) != 0 ? 1 : 0;
    if (seen >= 0 && seen != value) return -1;
    seen = value;
  }
  return seen;
}

/// The table as a circuit of bit operations, written by the compiler: one selection for each neighbour that still
/// matters (Shannon expansion); equal branches are computed once.
template <int Pass, int Depth = 0, int Code = 0>
inline std::uint64_t removable(const Neighbours& n) {
  constexpr int value = constant<Pass, Depth, Code>();
  if constexpr (value == 0) {
    return 0;
  } else if constexpr (value == 1) {
    return ~std::uint64_t{0};
  } else {
    constexpr int neighbour = kOrder[static_cast<std::size_t>(Depth)];
    const std::uint64_t clear = removable<Pass, Depth + 1, Code>(n);
    const std::uint64_t set = removable<Pass, Depth + 1, Code | (1 << neighbour)>(n);
    return clear ^ (n[neighbour] & (clear ^ set));
  }
}

Neighbours neighbours_of(const std::uint64_t* word, std::ptrdiff_t stride) {
  const std::uint64_t* up = word - stride;
  const std::uint64_t* down = word + stride;
  const auto left = [](const std::uint64_t* w) { return (w[0] << 1) | (w[-1] >> 63); };
  const auto right = [](const std::uint64_t* w) { return (w[0] >> 1) | (w[1] << 63); };
  return {left(up), up[0], right(up), right(word), right(down), down[0], left(down), left(word)};
}

/// Words that may change in each of the two passes: those with changes nearby since that pass last examined them.
class Agenda {
 public:
  Agenda(BitImage& image)
      : bits_(image.row(-1) - 1),
        stride_(image.stride()),
        listed_(static_cast<std::size_t>(image.stride()) * static_cast<std::size_t>(image.height() + 2), 0) {
    for (int y = 0; y < image.height(); ++y) {
      for (int w = 0; w < image.words(); ++w) {
        if (image.row(y)[w] != 0) list(image.row(y) + w - bits_);
      }
    }
  }

  /// Removes all pixels of pass 1 or 2 at once. Returns true if there were any.
  template <int Pass>
  bool run() {
    active_.clear();
    active_.swap(lists_[Pass - 1]);
    removed_.resize(active_.size());
    for (std::size_t i = 0; i < active_.size(); ++i) {
      const std::uint64_t* word = bits_ + active_[i];
      listed_[active_[i]] &= ~Pass;
      removed_[i] = *word & removable<Pass>(neighbours_of(word, stride_));
    }
    bool any = false;
    for (std::size_t i = 0; i < active_.size(); ++i) {
      if (removed_[i] == 0) continue;
      any = true;
      bits_[active_[i]] &= ~removed_[i];
      for (const std::ptrdiff_t row : {-stride_, std::ptrdiff_t{0}, stride_}) {
        const std::ptrdiff_t word = static_cast<std::ptrdiff_t>(active_[i]) + row;
        list(word);
        if (removed_[i] & 1U) list(word - 1);
        if (removed_[i] >> 63) list(word + 1);
      }
    }
    return any;
  }

 private:
  void list(std::ptrdiff_t word) {
    char& listed = listed_[static_cast<std::size_t>(word)];
    if (listed == 3 || bits_[word] == 0) return;
    if (!(listed & 1)) lists_[0].push_back(static_cast<std::size_t>(word));
    if (!(listed & 2)) lists_[1].push_back(static_cast<std::size_t>(word));
    listed = 3;
  }

  std::uint64_t* bits_;
  std::ptrdiff_t stride_;
  std::vector<char> listed_;
  std::array<std::vector<std::size_t>, 2> lists_;
  std::vector<std::size_t> active_;
  std::vector<std::uint64_t> removed_;
};

}  // namespace

BitImage thin(const BitImage& image) {
  BitImage result = image;
  Agenda agenda(result);
  while (true) {
    const bool first = agenda.run<1>();
    const bool second = agenda.run<2>();
    if (!first && !second) return result;
  }
}

}  // namespace withe
