#include "solvers/band_lu.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "solvers/band_lu_kernels.hpp"
#include "solvers/pattern_lookup.hpp"

namespace withe {
namespace {

/// values(): row after row of the band, 2 w + 1 numbers each (w the half bandwidth), column i - w first.
class BandLu final : public LinearSolver {
 public:
  explicit BandLu(const SparsityPattern& pattern)
      : pattern_(pattern),
        width_(pattern.half_bandwidth()),
        value_stride_(2 * width_ + 1),
        values_(static_cast<std::size_t>(pattern.size) * value_stride_ + kPadding, 0.0),
        work_((static_cast<std::size_t>(pattern.size) * (band_lu_stride(width_) + 1) + before()) / kBandLuPadding + 1),
        multipliers_(static_cast<std::size_t>(pattern.size) * band_lu_padded(width_), 0.0),
        inverse_pivots_(pattern.size, 0.0),
        pivot_rows_(pattern.size, 0),
        last_columns_(pattern.size, 0) {}

  int size() const override { return pattern_.size; }
  Symmetry symmetry() const override { return Symmetry::unsymmetric; }
  std::string name() const override { return "band LU"; }

  std::ptrdiff_t offset(int row, int column) const override {
    find_entry(pattern_, row, column);
    return static_cast<std::ptrdiff_t>(row) * value_stride_ + (column - row + width_);
  }
  std::span<double> values() override { return {values_.data(), values_.size() - kPadding}; }
  std::span<const double> values() const override { return {values_.data(), values_.size() - kPadding}; }

  Factorization factorize(std::span<const double> shift) override {
    require_shift(shift, size());
    factorized_ = band_lu_kernels().factorize(factor(), values_.data(), shift.empty() ? nullptr : shift.data());
    return {factorized_ ? FactorStatus::ok : FactorStatus::singular, 0};
  }

  void solve(std::span<double> x) const override {
    require_solvable(factorized_, x, size());
    band_lu_kernels().solve(factor(), x.data());
  }

  void solve_transposed(std::span<double> x) const override {
    require_solvable(factorized_, x, size());
    band_lu_kernels().solve_transposed(factor(), x.data());
  }

  void multiply(std::span<const double> x, std::span<double> y) const override {
    require_product(x, y, size());
    for (int row = 0; row < size(); ++row) {
      const double* value = values_.data() + static_cast<std::ptrdiff_t>(row) * value_stride_ + width_ - row;
      double sum = 0.0;
      const int last = std::min(row + width_, size() - 1);
      for (int column = std::max(row - width_, 0); column <= last; ++column) sum += value[column] * x[column];
      y[row] = sum;
    }
  }

  std::unique_ptr<LinearSolver> clone() const override { return std::make_unique<BandLu>(*this); }

 private:
  struct alignas(kBandLuPadding * sizeof(double)) Block {
    double numbers[kBandLuPadding] = {};
  };

  /// Numbers in front of column 0.
  int before() const { return band_lu_padded(width_ + kBandLuPadding); }
  BandLuFactor factor() const {
    BandLu& self = const_cast<BandLu&>(*this);
    return {size(),
            width_,
            value_stride_,
            band_lu_stride(width_),
            band_lu_padded(width_),
            self.work_.data()->numbers + before(),
            self.multipliers_.data(),
            self.inverse_pivots_.data(),
            self.pivot_rows_.data(),
            self.last_columns_.data()};
  }

  SparsityPattern pattern_;
  int width_;
  int value_stride_;
  std::vector<double> values_;
  std::vector<Block> work_;
  std::vector<double> multipliers_;
  std::vector<double> inverse_pivots_;
  std::vector<int> pivot_rows_;
  std::vector<int> last_columns_;
  bool factorized_ = false;
};

}  // namespace

std::unique_ptr<LinearSolver> make_band_lu(const SparsityPattern& pattern) { return std::make_unique<BandLu>(pattern); }

}  // namespace withe
