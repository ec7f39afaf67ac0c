#include "solvers/sparse_ldlt.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <vector>

#include "solvers/pattern_lookup.hpp"

namespace withe {
namespace {

/// New order of the unknowns that keeps L sparse: order[new] = old.
std::vector<int> minimum_degree_order(const SparsityPattern& pattern) {
  const std::vector<double> ones(pattern.row_indices.size(), 1.0);
  const Eigen::Map<const Eigen::SparseMatrix<double>> matrix(
      pattern.size, pattern.size, static_cast<Eigen::Index>(pattern.row_indices.size()), pattern.column_starts.data(),
      pattern.row_indices.data(), ones.data());
  Eigen::AMDOrdering<int>::PermutationType order;
  Eigen::AMDOrdering<int>()(Eigen::SparseMatrix<double>(matrix), order);
  return {order.indices().begin(), order.indices().end()};
}

/// values(): lower triangle column by column, in the order of the pattern.
///
/// Up-looking: row k of L follows from rows 0 ... k - 1. Its pattern is found once, in `analyze`; the numeric
/// phase only walks through it and appends the row to the columns of L.
class SparseLdlt final : public LinearSolver {
 public:
  explicit SparseLdlt(const SparsityPattern& pattern) : pattern_(pattern), work_(pattern.size, 0.0) {
    lower_starts_.reserve(pattern.size + 1);
    lower_starts_.push_back(0);
    for (int column = 0; column < pattern.size; ++column) {
      const int above = static_cast<int>(find_entry(pattern, column, column)) - pattern.column_starts[column];
      const int count = pattern.column_starts[column + 1] - pattern.column_starts[column];
      lower_starts_.push_back(lower_starts_.back() + count - above);
    }
    values_.assign(static_cast<std::size_t>(lower_starts_.back()) + kPadding, 0.0);
    analyze();
  }

  int size() const override { return pattern_.size; }
  Symmetry symmetry() const override { return Symmetry::symmetric; }
  std::string name() const override { return "sparse LDLT"; }

  std::ptrdiff_t offset(int row, int column) const override {
    const std::ptrdiff_t place = find_lower_entry(pattern_, row, column);
    return place - pattern_.column_starts[column + 1] + lower_starts_[column + 1];
  }
  std::span<double> values() override { return {values_.data(), values_.size() - kPadding}; }
  std::span<const double> values() const override { return {values_.data(), values_.size() - kPadding}; }

  Factorization factorize(std::span<const double> shift) override {
    require_shift(shift, size());
    factorized_ = false;
    Factorization result;
    std::copy(column_starts_.begin(), column_starts_.end() - 1, column_ends_.begin());
    std::fill(work_.begin(), work_.end(), 0.0);
    for (int k = 0; k < size(); ++k) {
      for (int p = upper_starts_[k]; p < upper_starts_[k + 1]; ++p)
        work_[upper_columns_[p]] = values_[upper_sources_[p]];
      double pivot = values_[lower_starts_[order_[k]]];
      if (!shift.empty()) pivot += shift[order_[k]];
      for (int p = row_starts_[k]; p < row_starts_[k + 1]; ++p) {
        const int column = row_columns_[p];
        const double unscaled = work_[column];
        work_[column] = 0.0;
        const int end = column_ends_[column];
        for (int q = column_starts_[column]; q < end; ++q) work_[row_indices_[q]] -= lower_[q] * unscaled;
        lower_[end] = unscaled * inverse_pivots_[column];
        pivot -= lower_[end] * unscaled;
        column_ends_[column] = end + 1;
      }
      if (!is_usable_pivot(pivot)) return {FactorStatus::singular, 0};
      result.negative_pivots += pivot < 0.0;
      inverse_pivots_[k] = 1.0 / pivot;
    }
    factorized_ = true;
    return result;
  }

  void solve(std::span<double> right_hand_side) const override {
    require_solvable(factorized_, right_hand_side, size());
    for (int k = 0; k < size(); ++k) work_[k] = right_hand_side[order_[k]];
    for (int k = 0; k < size(); ++k) {
      const double x = work_[k];
      for (int q = column_starts_[k]; q < column_starts_[k + 1]; ++q) work_[row_indices_[q]] -= lower_[q] * x;
    }
    for (int k = size() - 1; k >= 0; --k) {
      double sum = work_[k] * inverse_pivots_[k];
      for (int q = column_starts_[k]; q < column_starts_[k + 1]; ++q) sum -= lower_[q] * work_[row_indices_[q]];
      work_[k] = sum;
    }
    for (int k = 0; k < size(); ++k) right_hand_side[order_[k]] = work_[k];
  }
  void solve_transposed(std::span<double> right_hand_side) const override { solve(right_hand_side); }

  void multiply(std::span<const double> x, std::span<double> y) const override {
    require_product(x, y, size());
    std::fill(y.begin(), y.end(), 0.0);
    for (int column = 0; column < size(); ++column) {
      const int diagonal = lower_starts_[column];
      const int end = lower_starts_[column + 1];
      const int* rows = pattern_.row_indices.data() + (pattern_.column_starts[column + 1] - (end - diagonal));
      double sum = values_[diagonal] * x[column];
      for (int p = diagonal + 1; p < end; ++p) {
        const int row = rows[p - diagonal];
        y[row] += values_[p] * x[column];
        sum += values_[p] * x[row];
      }
      y[column] += sum;
    }
  }

  std::unique_ptr<LinearSolver> clone() const override { return std::make_unique<SparseLdlt>(*this); }

 private:
  /// Patterns of the permuted matrix and of L, from the elimination tree [Liu 1990, sec. 3 and 5].
  void analyze() {
    const int n = size();
    order_ = minimum_degree_order(pattern_);
    std::vector<int> place(n);
    for (int k = 0; k < n; ++k) place[order_[k]] = k;

    std::vector<int> parent(n, -1);
    std::vector<int> visitor(n, -1);
    std::vector<int> counts(n, 0);
    upper_starts_.assign(1, 0);
    row_starts_.assign(1, 0);
    for (int k = 0; k < n; ++k) {
      visitor[k] = k;
      const int old = order_[k];
      for (int p = pattern_.column_starts[old]; p < pattern_.column_starts[old + 1]; ++p) {
        const int other = pattern_.row_indices[p];
        const int column = place[other];
        if (column >= k) continue;
        upper_columns_.push_back(column);
        upper_sources_.push_back(static_cast<int>(offset(std::max(old, other), std::min(old, other))));
        for (int node = column; visitor[node] != k; node = parent[node]) {
          if (parent[node] < 0) parent[node] = k;
          visitor[node] = k;
          row_columns_.push_back(node);
          ++counts[node];
        }
      }
      std::sort(row_columns_.begin() + row_starts_.back(), row_columns_.end());
      upper_starts_.push_back(static_cast<int>(upper_columns_.size()));
      row_starts_.push_back(static_cast<int>(row_columns_.size()));
    }

    column_starts_.assign(1, 0);
    for (int k = 0; k < n; ++k) column_starts_.push_back(column_starts_.back() + counts[k]);
    column_ends_.assign(column_starts_.begin(), column_starts_.end() - 1);
    row_indices_.resize(row_columns_.size());
    lower_.assign(row_columns_.size(), 0.0);
    inverse_pivots_.assign(n, 0.0);
    for (int k = 0; k < n; ++k) {
      for (int p = row_starts_[k]; p < row_starts_[k + 1]; ++p) row_indices_[column_ends_[row_columns_[p]]++] = k;
    }
  }

  SparsityPattern pattern_;
  std::vector<int> lower_starts_;  // of the columns in values_; the diagonal comes first
  std::vector<double> values_;

  std::vector<int> order_;                                         // new -> old
  std::vector<int> upper_starts_, upper_columns_, upper_sources_;  // row k of the permuted matrix, left of the diagonal
  std::vector<int> row_starts_, row_columns_;                      // pattern of L by rows, columns ascending
  std::vector<int> column_starts_, row_indices_;                   // pattern of L by columns, diagonal left out
  std::vector<double> lower_, inverse_pivots_;
  std::vector<int> column_ends_;
  mutable std::vector<double> work_;
  bool factorized_ = false;
};

}  // namespace

std::unique_ptr<LinearSolver> make_sparse_ldlt(const SparsityPattern& pattern) {
  return std::make_unique<SparseLdlt>(pattern);
}

}  // namespace withe
