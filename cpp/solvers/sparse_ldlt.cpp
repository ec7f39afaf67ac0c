#include "solvers/sparse_ldlt.hpp"

#include <algorithm>
#include <vector>

#include "solvers/front_kernels.hpp"
#include "solvers/pattern_lookup.hpp"
#include "solvers/supernodes.hpp"

namespace withe {
namespace {

int padded(int length) { return (length + kFrontPadding - 1) / kFrontPadding * kFrontPadding; }

/// values(): lower triangle column by column, in the order of the pattern.
///
/// Multifrontal [Liu 1992]: a supernode's columns are eliminated in a dense front, what is left of the front waits on a
/// stack, and its parent adds it to its own. Patterns and places are found once; the numeric phase follows them.
class SparseLdlt final : public LinearSolver {
 public:
  explicit SparseLdlt(const SparsityPattern& pattern)
      : pattern_(pattern), nodes_(find_supernodes(pattern)), inverse_pivots_(pattern.size, 0.0), work_(pattern.size) {
    make_room();
    find_places();
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
    std::fill(factor_.begin(), factor_.end(), 0.0);
    for (std::size_t p = 0; p < places_.size(); ++p) factor_[places_[p]] = values_[p];
    if (!shift.empty())
      for (int k = 0; k < size(); ++k) factor_[pivots_[k]] += shift[nodes_.order[k]];
    std::ptrdiff_t top = 0;  // of the stack
    for (int s = 0; s < nodes_.count(); ++s) {
      Front front = front_of(s);
      front.rest = rest_.data() + top;
      std::fill_n(front.rest, rest_size(s), 0.0);
      std::ptrdiff_t below = top;
      for (int child = last_child_[s]; child >= 0; child = sibling_[child]) {
        below -= rest_size(child);
        add_rest(child, rest_.data() + below, front);
      }
      front_kernels().eliminate(front);
      for (int c = 0; c < front.columns; ++c) {
        const double pivot = front.factor[std::ptrdiff_t{front.length} * c + c];
        if (!is_usable_pivot(pivot)) return {FactorStatus::singular, 0};
        result.negative_pivots += pivot < 0.0;
      }
      if (below < top) std::copy_n(front.rest, rest_size(s), rest_.data() + below);
      top = below + rest_size(s);
    }
    factorized_ = true;
    return result;
  }

  void solve(std::span<double> right_hand_side) const override {
    require_solvable(factorized_, right_hand_side, size());
    for (int k = 0; k < size(); ++k) work_[k] = right_hand_side[nodes_.order[k]];
    const FrontKernels& kernels = front_kernels();
    const auto x = [&](int s) { return work_.data() + nodes_.column_starts[s]; };
    const auto rows = [&](int s) { return nodes_.rows.data() + nodes_.row_starts[s]; };
    for (int s = 0; s < nodes_.count(); ++s) kernels.solve_down(front_of(s), x(s), rows(s), work_.data());
    for (int s = nodes_.count() - 1; s >= 0; --s) kernels.solve_up(front_of(s), x(s), rows(s), work_.data());
    for (int k = 0; k < size(); ++k) right_hand_side[nodes_.order[k]] = work_[k];
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
  Front front_of(int s) const {
    Front front;
    front.columns = nodes_.columns(s);
    front.rows = front.columns + nodes_.rest(s);
    front.length = padded(front.rows);
    front.rest_length = padded(nodes_.rest(s));
    front.factor = factor_.data() + factor_starts_[s];
    front.inverse_pivots = inverse_pivots_.data() + nodes_.column_starts[s];
    front.scratch = scratch_.data();
    return front;
  }

  /// Numbers on the stack.
  std::ptrdiff_t rest_size(int s) const { return std::ptrdiff_t{padded(nodes_.rest(s))} * nodes_.rest(s); }

  /// Adds what is left of a child to its parent's front.
  void add_rest(int child, const double* rest, const Front& parent) const {
    const int rows = nodes_.rest(child), length = padded(rows);
    const int* place = rows_in_parent_.data() + nodes_.row_starts[child];
    for (int column = 0; column < rows; ++column, rest += length) {
      const int to = place[column];
      double* target = to < parent.columns
                           ? parent.factor + std::ptrdiff_t{parent.length} * to
                           : parent.rest + std::ptrdiff_t{parent.rest_length} * (to - parent.columns) - parent.columns;
      for (int row = column; row < rows; ++row) target[place[row]] += rest[row];
    }
  }

  /// For L, and for what waits on the stack when it is highest.
  void make_room() {
    const int count = nodes_.count();
    last_child_.assign(count, -1);
    sibling_.assign(count, -1);
    std::ptrdiff_t stored = 0, top = 0, highest = 0, widest = 0;
    for (int s = 0; s < count; ++s) {
      factor_starts_.push_back(stored);
      const std::ptrdiff_t length = padded(nodes_.columns(s) + nodes_.rest(s));
      stored += length * nodes_.columns(s);
      widest = std::max(widest, length * nodes_.columns(s));
      highest = std::max(highest, top + rest_size(s));
      for (int child = last_child_[s]; child >= 0; child = sibling_[child]) top -= rest_size(child);
      top += rest_size(s);
      const int parent = nodes_.parent[s];
      if (parent < 0) continue;
      sibling_[s] = last_child_[parent];
      last_child_[parent] = s;
    }
    factor_.assign(static_cast<std::size_t>(stored) + kPadding, 0.0);
    rest_.assign(static_cast<std::size_t>(highest) + kPadding, 0.0);
    scratch_.assign(static_cast<std::size_t>(widest) + kPadding, 0.0);
  }

  /// Of each entry of the pattern, the one in values_ that it is or mirrors; rows being sorted, those above a diagonal
  /// come up in the order of their columns.
  std::vector<int> number_values() {
    std::vector<int> number(pattern_.row_indices.size()), next(pattern_.column_starts);
    lower_starts_.assign(1, 0);
    for (int column = 0; column < size(); ++column) {
      int value = lower_starts_.back();
      for (int p = next[column]; p < pattern_.column_starts[column + 1]; ++p, ++value) {
        const int row = pattern_.row_indices[p];
        number[p] = value;
        if (row > column) number[next[row]++] = value;
      }
      lower_starts_.push_back(value);
    }
    values_.assign(static_cast<std::size_t>(lower_starts_.back()) + kPadding, 0.0);
    return number;
  }

  /// Where values go in L, and the rests of children in their parents' fronts.
  void find_places() {
    const std::vector<int> number = number_values();
    std::vector<int> place(size()), row_of(size());
    for (int k = 0; k < size(); ++k) place[nodes_.order[k]] = k;
    places_.resize(values_.size() - kPadding);
    pivots_.resize(size());
    rows_in_parent_.resize(nodes_.rows.size());
    for (int s = 0; s < nodes_.count(); ++s) {
      const int first = nodes_.column_starts[s], columns = nodes_.columns(s), length = front_of(s).length;
      const int* rows = nodes_.rows.data() + nodes_.row_starts[s];
      for (int c = 0; c < columns; ++c) row_of[first + c] = c;
      for (int r = 0; r < nodes_.rest(s); ++r) row_of[rows[r]] = columns + r;
      for (int child = last_child_[s]; child >= 0; child = sibling_[child])
        for (int r = nodes_.row_starts[child]; r < nodes_.row_starts[child + 1]; ++r)
          rows_in_parent_[r] = row_of[nodes_.rows[r]];
      for (int c = 0; c < columns; ++c) {
        const int old = nodes_.order[first + c];
        const std::ptrdiff_t column = factor_starts_[s] + std::ptrdiff_t{length} * c;
        pivots_[first + c] = column + c;
        for (int p = pattern_.column_starts[old]; p < pattern_.column_starts[old + 1]; ++p) {
          const int row = place[pattern_.row_indices[p]];
          if (row >= first + c) places_[number[p]] = column + row_of[row];
        }
      }
    }
  }

  SparsityPattern pattern_;
  std::vector<int> lower_starts_;  // of the columns in values_; the diagonal comes first
  std::vector<double> values_;

  Supernodes nodes_;
  std::vector<int> last_child_, sibling_;      // of each supernode; a sibling comes before
  std::vector<int> rows_in_parent_;            // of each of its rows below, the row in its parent's front
  std::vector<std::ptrdiff_t> factor_starts_;  // of each supernode
  std::vector<std::ptrdiff_t> places_;         // of each value in factor_
  std::vector<std::ptrdiff_t> pivots_;         // of each column, in the new order
  mutable std::vector<double> factor_, inverse_pivots_;
  std::vector<double> rest_;
  mutable std::vector<double> scratch_, work_;
  bool factorized_ = false;
};

}  // namespace

std::unique_ptr<LinearSolver> make_sparse_ldlt(const SparsityPattern& pattern) {
  return std::make_unique<SparseLdlt>(pattern);
}

}  // namespace withe
