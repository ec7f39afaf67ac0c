#include "solvers/band_ldlt.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "solvers/band_storage.hpp"
#include "solvers/pattern_lookup.hpp"

namespace withe {
namespace {

/// values(): the columns of the lower band one after another, `stride` numbers each. Numbers below the matrix are
/// unused.
class SymmetricBand : public LinearSolver {
 public:
  SymmetricBand(const SparsityPattern& pattern, int width)
      : pattern_(pattern),
        half_bandwidth_(pattern.half_bandwidth()),
        stride_(band_column_stride(width)),
        values_(static_cast<std::size_t>(pattern.size) * stride_ + static_cast<std::size_t>(pattern.beside)) {}

  int size() const override { return pattern_.size; }
  Symmetry symmetry() const override { return Symmetry::symmetric; }
  std::string name() const override { return "band LDLT (half bandwidth " + std::to_string(half_bandwidth_) + ")"; }

  std::ptrdiff_t offset(int row, int column) const override {
    find_lower_entry(pattern_, row, column);
    return static_cast<std::ptrdiff_t>(column) * stride_ + (row - column);
  }
  std::span<double> values() override { return {values_.data(), values_.size()}; }
  std::span<const double> values() const override { return {values_.data(), values_.size()}; }

  Factorization factorize(std::span<const double> shift) override {
    require_shift(shift, size());
    const std::span<const double> inverse_pivots = eliminate(shift.empty() ? nullptr : shift.data());
    factorized_ = std::all_of(inverse_pivots.begin(), inverse_pivots.end(), is_usable_pivot);
    if (!factorized_) return {FactorStatus::singular, 0};
    const auto negative = std::count_if(inverse_pivots.begin(), inverse_pivots.end(), [](double d) { return d < 0.0; });
    return {FactorStatus::ok, static_cast<int>(negative)};
  }

  void solve(std::span<double> right_hand_side) const override {
    require_solvable(factorized_, right_hand_side, size());
    substitute(right_hand_side.data());
  }
  void solve_transposed(std::span<double> right_hand_side) const override { solve(right_hand_side); }

  void multiply(std::span<const double> x, std::span<double> y) const override {
    require_product(x, y, size());
    std::fill(y.begin(), y.end(), 0.0);
    for (int k = 0; k < size(); ++k) {
      const double* column = values_.data() + static_cast<std::ptrdiff_t>(k) * stride_;
      double sum = column[0] * x[k];
      const int last = std::min(half_bandwidth_, size() - 1 - k);
      for (int m = 1; m <= last; ++m) {
        y[k + m] += column[m] * x[k];
        sum += column[m] * x[k + m];
      }
      y[k] += sum;
    }
  }

 protected:
  /// Factorises the matrix, with a shift of the diagonal or without. Returns the inverse pivots.
  virtual std::span<const double> eliminate(const double* shift) = 0;
  virtual void substitute(double* x) const = 0;

  SparsityPattern pattern_;
  int half_bandwidth_;
  int stride_;
  BandEntries values_;
  bool factorized_ = false;
};

/// Band of rods and chains: as wide as kernels support; narrower bands are padded with zeros.
class BandLdlt final : public SymmetricBand {
 public:
  BandLdlt(const SparsityPattern& pattern, const BandKernels& kernels)
      : SymmetricBand(pattern, kernels.half_bandwidth),
        kernels_(kernels),
        storage_(pattern.size, kernels.half_bandwidth) {}
  std::unique_ptr<LinearSolver> clone() const override { return std::make_unique<BandLdlt>(*this); }

 private:
  std::span<const double> eliminate(const double* shift) override {
    kernels_.factorize_symmetric(storage_.factor(), values_.data(), shift);
    return storage_.inverse_pivots();
  }
  void substitute(double* x) const override { kernels_.solve_symmetric(storage_.factor(), x); }

  const BandKernels& kernels_;
  BandStorage storage_;
};

/// Band of any width, column after column of L. For comparison: the sparse solver is faster.
class WideBandLdlt final : public SymmetricBand {
 public:
  explicit WideBandLdlt(const SparsityPattern& pattern)
      : SymmetricBand(pattern, pattern.half_bandwidth()),
        factor_(values_.size(), 0.0),
        inverse_pivots_(pattern.size, 0.0) {}
  std::unique_ptr<LinearSolver> clone() const override { return std::make_unique<WideBandLdlt>(*this); }

 private:
  /// Column k of L, its first entry the diagonal.
  double* column(int k) { return factor_.data() + static_cast<std::ptrdiff_t>(k) * stride_; }
  const double* column(int k) const { return factor_.data() + static_cast<std::ptrdiff_t>(k) * stride_; }

  /// u(i, k) = a(i, k) - sum over m of l(i, k - m) d(k - m) l(k, k - m), l(i, k) = u(i, k) / d(k).
  std::span<const double> eliminate(const double* shift) override {
    std::copy_n(values_.data(), static_cast<std::ptrdiff_t>(size()) * stride_, factor_.begin());
    for (int k = 0; k < size(); ++k) {
      double* newest = column(k);
      if (shift) newest[0] += shift[k];
      for (int m = std::min(half_bandwidth_, k); m >= 1; --m) {
        const double* earlier = column(k - m);
        const double weight = earlier[m] / inverse_pivots_[k - m];
        for (int i = 0; i <= half_bandwidth_ - m; ++i) newest[i] -= earlier[m + i] * weight;
      }
      inverse_pivots_[k] = 1.0 / newest[0];
      for (int i = 1; i <= half_bandwidth_; ++i) newest[i] *= inverse_pivots_[k];
    }
    return inverse_pivots_;
  }
  void substitute(double* x) const override {
    for (int k = 0; k < size(); ++k)
      for (int m = std::min(half_bandwidth_, k); m >= 1; --m) x[k] -= column(k - m)[m] * x[k - m];
    for (int k = size() - 1; k >= 0; --k) {
      x[k] *= inverse_pivots_[k];
      for (int m = std::min(half_bandwidth_, size() - 1 - k); m >= 1; --m) x[k] -= column(k)[m] * x[k + m];
    }
  }

  std::vector<double> factor_, inverse_pivots_;
};

}  // namespace

std::unique_ptr<LinearSolver> make_band_ldlt(const SparsityPattern& pattern) {
  if (const BandKernels* kernels = band_kernels(pattern.half_bandwidth()))
    return std::make_unique<BandLdlt>(pattern, *kernels);
  return std::make_unique<WideBandLdlt>(pattern);
}

}  // namespace withe
