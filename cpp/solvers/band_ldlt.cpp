#include "solvers/band_ldlt.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "solvers/band_ldlt_kernel.hpp"
#include "solvers/pattern_lookup.hpp"

namespace withe {
namespace {

/// values(): column after column of the lower band, `stride` numbers each, those below the matrix never used.
template <class Band>
class BandLdlt final : public LinearSolver {
 public:
  BandLdlt(const SparsityPattern& pattern, Band band)
      : pattern_(pattern),
        band_(band),
        half_bandwidth_(pattern.half_bandwidth()),
        values_(static_cast<std::size_t>(pattern.size) * band.stride + kPadding, 0.0),
        factor_(static_cast<std::size_t>(pattern.size + band.half_bandwidth) * band.stride, 0.0),
        inverse_pivots_(pattern.size, 0.0) {}

  int size() const override { return pattern_.size; }
  Symmetry symmetry() const override { return Symmetry::symmetric; }
  std::string name() const override { return "band LDLT (half bandwidth " + std::to_string(half_bandwidth_) + ")"; }

  std::ptrdiff_t offset(int row, int column) const override {
    find_lower_entry(pattern_, row, column);
    return static_cast<std::ptrdiff_t>(column) * band_.stride + (row - column);
  }
  std::span<double> values() override { return {values_.data(), values_.size() - kPadding}; }
  std::span<const double> values() const override { return {values_.data(), values_.size() - kPadding}; }

  Factorization factorize(std::span<const double> shift) override {
    require_shift(shift, size());
    double* factor = factor_.data() + static_cast<std::ptrdiff_t>(band_.half_bandwidth) * band_.stride;
    band_ldlt::factorize(band_, size(), values_.data(), shift.empty() ? nullptr : shift.data(), factor,
                         inverse_pivots_.data());
    Factorization result;
    bool usable = true;
    for (int k = 0; k < size(); ++k) {
      const double pivot = factor[static_cast<std::ptrdiff_t>(k) * band_.stride];
      usable &= is_usable_pivot(pivot);
      result.negative_pivots += pivot < 0.0;
    }
    if (!usable) result = {FactorStatus::singular, 0};
    factorized_ = usable;
    return result;
  }

  void solve(std::span<double> right_hand_side) const override {
    require_solvable(factorized_, right_hand_side, size());
    const double* factor = factor_.data() + static_cast<std::ptrdiff_t>(band_.half_bandwidth) * band_.stride;
    band_ldlt::solve(band_, size(), factor, inverse_pivots_.data(), right_hand_side.data());
  }
  void solve_transposed(std::span<double> right_hand_side) const override { solve(right_hand_side); }

  void multiply(std::span<const double> x, std::span<double> y) const override {
    require_product(x, y, size());
    std::fill(y.begin(), y.end(), 0.0);
    for (int k = 0; k < size(); ++k) {
      const double* column = values_.data() + static_cast<std::ptrdiff_t>(k) * band_.stride;
      double sum = column[0] * x[k];
      const int last = std::min(half_bandwidth_, size() - 1 - k);
      for (int m = 1; m <= last; ++m) {
        y[k + m] += column[m] * x[k];
        sum += column[m] * x[k + m];
      }
      y[k] += sum;
    }
  }

  std::unique_ptr<LinearSolver> clone() const override { return std::make_unique<BandLdlt>(*this); }

 private:
  SparsityPattern pattern_;
  Band band_;
  int half_bandwidth_;
  std::vector<double> values_;
  std::vector<double> factor_;
  std::vector<double> inverse_pivots_;
  bool factorized_ = false;
};

template <int kHalfBandwidth>
std::unique_ptr<LinearSolver> make_fixed(const SparsityPattern& pattern) {
  using Band = band_ldlt::FixedBand<kHalfBandwidth>;
  return std::make_unique<BandLdlt<Band>>(pattern, Band());
}

}  // namespace

std::unique_ptr<LinearSolver> make_band_ldlt(const SparsityPattern& pattern) {
  // Narrower bands are padded with zeros: cheaper than loops whose length the compiler does not know.
  const int half_bandwidth = pattern.half_bandwidth();
  if (half_bandwidth <= 5) return make_fixed<5>(pattern);
  if (half_bandwidth <= 10) return make_fixed<10>(pattern);
  if (half_bandwidth <= 16) return make_fixed<16>(pattern);
  if (half_bandwidth <= 24) return make_fixed<24>(pattern);
  const band_ldlt::AnyBand band{half_bandwidth, band_ldlt::column_stride(half_bandwidth)};
  return std::make_unique<BandLdlt<band_ldlt::AnyBand>>(pattern, band);
}

}  // namespace withe
