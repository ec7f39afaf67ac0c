#include "solvers/band_lu.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "solvers/pattern_lookup.hpp"

namespace withe {
namespace {

/// Half bandwidth of a rod in space.
constexpr int kRodWidth = 10;

/// values(): row after row of the band, 2 w + 1 numbers each (w the half bandwidth), column i - w first.
///
/// While column j is eliminated, rows j ... j + w are active. Row i of `work_` holds columns i - w ... i + 2 w:
/// exchanges widen U to 2 w. Multipliers stay where they were made, as the exchanges of later columns are
/// applied to the right-hand side in turn.
class BandLu final : public LinearSolver {
 public:
  explicit BandLu(const SparsityPattern& pattern)
      : pattern_(pattern),
        width_(pattern.half_bandwidth()),
        value_stride_(2 * width_ + 1),
        work_stride_(3 * width_ + 1),
        values_(static_cast<std::size_t>(pattern.size) * value_stride_ + kPadding, 0.0),
        work_(static_cast<std::size_t>(pattern.size) * work_stride_, 0.0),
        multipliers_(static_cast<std::size_t>(pattern.size) * width_, 0.0),
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
    factorized_ = false;
    for (int row = 0; row < std::min(width_, size()); ++row) load_row(row, shift);
    int last_column = 0;
    for (int j = 0; j < size(); ++j) {
      const int last_row = std::min(j + width_, size() - 1);
      if (j + width_ < size()) load_row(j + width_, shift);
      const int pivot_row = find_pivot(j, last_row);
      last_column = std::max(last_column, std::min(pivot_row + width_, size() - 1));
      if (!is_usable_pivot(entry(pivot_row, j)[0])) return {FactorStatus::singular, 0};
      if (pivot_row != j) std::swap_ranges(entry(j, j), entry(j, j) + (last_column - j + 1), entry(pivot_row, j));
      pivot_rows_[j] = pivot_row;
      last_columns_[j] = last_column;
      eliminate(j, last_row, last_column);
    }
    factorized_ = true;
    return {};
  }

  void solve(std::span<double> x) const override {
    require_solvable(factorized_, x, size());
    for (int j = 0; j < size(); ++j) {
      std::swap(x[j], x[pivot_rows_[j]]);
      const double* multiplier = multipliers_.data() + static_cast<std::ptrdiff_t>(j) * width_;
      const int count = std::min(width_, size() - 1 - j);
      for (int i = 0; i < count; ++i) x[j + 1 + i] -= multiplier[i] * x[j];
    }
    for (int j = size() - 1; j >= 0; --j) {
      const double* row = entry(j, j);
      double sum = x[j];
      for (int c = last_columns_[j] - j; c >= 1; --c) sum -= row[c] * x[j + c];
      x[j] = sum * inverse_pivots_[j];
    }
  }

  void solve_transposed(std::span<double> x) const override {
    require_solvable(factorized_, x, size());
    for (int j = 0; j < size(); ++j) {
      const double* row = entry(j, j);
      x[j] *= inverse_pivots_[j];
      for (int c = 1; c <= last_columns_[j] - j; ++c) x[j + c] -= row[c] * x[j];
    }
    for (int j = size() - 1; j >= 0; --j) {
      const double* multiplier = multipliers_.data() + static_cast<std::ptrdiff_t>(j) * width_;
      const int count = std::min(width_, size() - 1 - j);
      double sum = x[j];
      for (int i = count - 1; i >= 0; --i) sum -= multiplier[i] * x[j + 1 + i];
      x[j] = sum;
      std::swap(x[j], x[pivot_rows_[j]]);
    }
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
  double* entry(int row, int column) {
    return work_.data() + static_cast<std::ptrdiff_t>(row) * work_stride_ + (column - row + width_);
  }
  const double* entry(int row, int column) const { return const_cast<BandLu*>(this)->entry(row, column); }

  void load_row(int row, std::span<const double> shift) {
    const double* value = values_.data() + static_cast<std::ptrdiff_t>(row) * value_stride_;
    double* work = work_.data() + static_cast<std::ptrdiff_t>(row) * work_stride_;
    std::copy_n(value, value_stride_, work);
    std::fill_n(work + value_stride_, width_, 0.0);
    if (!shift.empty()) work[width_] += shift[row];
  }

  /// A number that is not finite wins, so that it is met as a pivot and reported.
  int find_pivot(int column, int last_row) const {
    int best = column;
    double greatest = std::abs(entry(column, column)[0]);
    for (int row = column + 1; row <= last_row; ++row) {
      const double magnitude = std::abs(entry(row, column)[0]);
      if (!(magnitude <= greatest)) {
        greatest = magnitude;
        best = row;
      }
    }
    return best;
  }

  void eliminate(int j, int last_row, int last_column) {
    const int count = last_column - j;
    // Beyond the last column the pivot row has zeros, so that counts known beforehand do for all there are: the band of
    // a rod in space, without exchanges and with them.
    if (width_ == kRodWidth && last_row == j + kRodWidth)
      count <= kRodWidth ? eliminate_rows<kRodWidth>(j, last_row, count)
                         : eliminate_rows<2 * kRodWidth>(j, last_row, count);
    else
      eliminate_rows<0>(j, last_row, count);
  }

  /// `known`: how many columns; 0: `count`.
  template <int known>
  void eliminate_rows(int j, int last_row, int count) {
    const double* __restrict pivot_row = entry(j, j) + 1;
    const double inverse = 1.0 / pivot_row[-1];
    inverse_pivots_[j] = inverse;
    double* multiplier = multipliers_.data() + static_cast<std::ptrdiff_t>(j) * width_;
    for (int row = j + 1; row <= last_row; ++row) {
      double* __restrict target = entry(row, j) + 1;
      const double factor = target[-1] * inverse;
      *multiplier++ = factor;
      for (int c = 0; c < (known > 0 ? known : count); ++c) target[c] -= factor * pivot_row[c];
    }
  }

  SparsityPattern pattern_;
  int width_;
  int value_stride_;
  int work_stride_;
  std::vector<double> values_;
  std::vector<double> work_;
  std::vector<double> multipliers_;
  std::vector<double> inverse_pivots_;
  std::vector<int> pivot_rows_;
  std::vector<int> last_columns_;
  bool factorized_ = false;
};

}  // namespace

std::unique_ptr<LinearSolver> make_band_lu(const SparsityPattern& pattern) { return std::make_unique<BandLu>(pattern); }

}  // namespace withe
