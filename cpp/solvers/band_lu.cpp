#include "solvers/band_lu.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "solvers/band_lu_kernels.hpp"
#include "solvers/band_storage.hpp"
#include "solvers/pattern_lookup.hpp"

namespace withe {
namespace {

/// Memory of the factors with exchanges.
class PivotedStorage {
 public:
  PivotedStorage(int size, int width)
      : size_(size),
        width_(width),
        work_(static_cast<std::size_t>(size) * (band_lu_stride(width) + 1) + before()),
        multipliers_(static_cast<std::size_t>(size) * band_padded(width), 0.0),
        inverse_pivots_(size, 0.0),
        row_scales_(size, 0.0),
        pivot_rows_(size, 0),
        last_columns_(size, 0) {}

  BandLuFactor factor() const {
    PivotedStorage& self = const_cast<PivotedStorage&>(*this);
    return {size_,
            width_,
            2 * width_ + 1,
            band_lu_stride(width_),
            band_padded(width_),
            self.work_.data() + before(),
            self.multipliers_.data(),
            self.inverse_pivots_.data(),
            self.row_scales_.data(),
            self.pivot_rows_.data(),
            self.last_columns_.data()};
  }

 private:
  /// Numbers in front of column 0.
  int before() const { return band_padded(width_ + kBandPadding); }

  int size_, width_;
  BandNumbers work_;
  std::vector<double> multipliers_;
  std::vector<double> inverse_pivots_;
  std::vector<double> row_scales_;
  std::vector<int> pivot_rows_;
  std::vector<int> last_columns_;
};

/// values(): row after row of the band, 2 w + 1 numbers each (w the half bandwidth), column i - w first.
///
/// Rows are exchanged where factors without exchanges grow; which is done depends on the matrix alone, as bit-exact
/// restarts need.
class BandLu final : public LinearSolver {
 public:
  explicit BandLu(const SparsityPattern& pattern)
      : pattern_(pattern),
        kernels_(band_kernels(pattern.half_bandwidth())),
        width_(kernels_ ? kernels_->half_bandwidth : pattern.half_bandwidth()),
        value_stride_(2 * width_ + 1),
        values_(static_cast<std::size_t>(pattern.size) * value_stride_ + static_cast<std::size_t>(pattern.beside)) {
    if (kernels_)
      plain_.emplace(size(), width_);
    else
      pivoted_.emplace(size(), width_);
  }

  int size() const override { return pattern_.size; }
  Symmetry symmetry() const override { return Symmetry::unsymmetric; }
  std::string name() const override { return "band LU"; }

  std::ptrdiff_t offset(int row, int column) const override {
    find_entry(pattern_, row, column);
    return static_cast<std::ptrdiff_t>(row) * value_stride_ + (column - row + width_);
  }
  std::span<double> values() override { return {values_.data(), values_.size()}; }
  std::span<const double> values() const override { return {values_.data(), values_.size()}; }

  Factorization factorize(std::span<const double> shift) override {
    require_shift(shift, size());
    const double* added = shift.empty() ? nullptr : shift.data();
    exchanged_ = !(kernels_ && kernels_->factorize(plain_->factor(), values_.data(), added));
    factorized_ = true;
    if (exchanged_) {
      if (!pivoted_) pivoted_.emplace(size(), width_);
      factorized_ = band_lu_kernels().factorize(pivoted_->factor(), values_.data(), added);
    }
    return {factorized_ ? FactorStatus::ok : FactorStatus::singular, 0};
  }

  void solve(std::span<double> x) const override {
    require_solvable(factorized_, x, size());
    exchanged_ ? band_lu_kernels().solve(pivoted_->factor(), x.data()) : kernels_->solve(plain_->factor(), x.data());
  }

  void solve_transposed(std::span<double> x) const override {
    require_solvable(factorized_, x, size());
    exchanged_ ? band_lu_kernels().solve_transposed(pivoted_->factor(), x.data())
               : kernels_->solve_transposed(plain_->factor(), x.data());
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
  SparsityPattern pattern_;
  const BandKernels* kernels_;  // kernels without row exchanges; null if there are none for this band
  int width_;
  int value_stride_;
  BandEntries values_;
  std::optional<BandStorage> plain_;
  std::optional<PivotedStorage> pivoted_;  // made when first needed
  bool exchanged_ = false;                 // the last factorisation
  bool factorized_ = false;
};

}  // namespace

std::unique_ptr<LinearSolver> make_band_lu(const SparsityPattern& pattern) { return std::make_unique<BandLu>(pattern); }

}  // namespace withe
