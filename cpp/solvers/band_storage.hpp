#pragma once
/// Memory of a band factorisation.

#include <vector>

#include "solvers/band_kernels.hpp"

namespace withe {

/// Numbers that begin at a multiple of kBandPadding of them in memory; copies do as well.
class BandNumbers {
 public:
  explicit BandNumbers(std::size_t count) : blocks_(count / kBandPadding + 1) {}
  double* data() { return blocks_.data()->numbers; }

 private:
  struct alignas(kBandPadding * sizeof(double)) Block {
    double numbers[kBandPadding] = {};
  };
  std::vector<Block> blocks_;
};

/// Entries of a matrix, which kernels read a little beyond either end.
class BandEntries {
 public:
  explicit BandEntries(std::size_t count) : numbers_(kBandPadding + count + kPadding, 0.0) {}
  double* data() { return numbers_.data() + kBandPadding; }
  const double* data() const { return numbers_.data() + kBandPadding; }
  std::size_t size() const { return numbers_.size() - kBandPadding - kPadding; }

 private:
  std::vector<double> numbers_;
};

class BandStorage {
 public:
  BandStorage(int size, int half_bandwidth)
      : size_(size),
        row_margin_(band_padded(half_bandwidth * (band_stride(half_bandwidth) + 1) + kBandPadding)),
        margin_(band_padded(half_bandwidth + kBandPadding)),
        upper_(rows(half_bandwidth)),
        lower_(rows(half_bandwidth)),
        scale_(size + 2 * static_cast<std::size_t>(margin_)),
        reach_(size + 2 * static_cast<std::size_t>(margin_)),
        inverse_pivots_(size, 0.0) {}

  BandFactor factor() const {
    BandStorage& self = const_cast<BandStorage&>(*this);
    return {size_,
            self.upper_.data() + row_margin_,
            self.lower_.data() + row_margin_,
            self.inverse_pivots_.data(),
            self.scale_.data() + margin_,
            self.reach_.data() + margin_};
  }
  const std::vector<double>& inverse_pivots() const { return inverse_pivots_; }

 private:
  std::size_t rows(int half_bandwidth) const {
    return static_cast<std::size_t>(size_) * (band_stride(half_bandwidth) + 1) + row_margin_ + 2 * margin_;
  }

  int size_, row_margin_, margin_;
  BandNumbers upper_, lower_, scale_, reach_;
  std::vector<double> inverse_pivots_;
};

}  // namespace withe
