#include "solvers/multifrontal.hpp"

#include <algorithm>
#include <vector>

#include "solvers/front_kernels.hpp"
#include "solvers/pattern_lookup.hpp"
#include "solvers/supernodes.hpp"

namespace withe {
namespace {

int padded(int length) { return (length + kFrontPadding - 1) / kFrontPadding * kFrontPadding; }

/// values(): column by column, in the order of the pattern; symmetric: the lower triangle.
///
/// Multifrontal method [Liu 1992]. The columns of a supernode are eliminated in a dense front. The remaining matrix of
/// the front is put on a stack, and the front of the parent adds it. Patterns and places are computed once, and the
/// numeric phase uses them. An unsymmetric matrix has two sides, one for L and one for W. Each side has its own fronts.
class Multifrontal final : public LinearSolver {
 public:
  Multifrontal(const SparsityPattern& pattern, Symmetry symmetry)
      : pattern_(pattern),
        sides_(symmetry == Symmetry::symmetric ? 1 : 2),
        nodes_(find_supernodes(pattern)),
        inverse_pivots_(pattern.size, 0.0),
        work_(pattern.size) {
    number_values();
    make_room();
    find_places();
  }

  int size() const override { return pattern_.size; }
  Symmetry symmetry() const override { return sides_ == 1 ? Symmetry::symmetric : Symmetry::unsymmetric; }
  std::string name() const override { return sides_ == 1 ? "sparse LDLT" : "sparse LU"; }

  std::ptrdiff_t offset(int row, int column) const override {
    return number_of(sides_ == 1 ? find_lower_entry(pattern_, row, column) : find_entry(pattern_, row, column), column);
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
    std::ptrdiff_t top = 0;  // top of the stack
    for (int s = 0; s < nodes_.count(); ++s) {
      Front fronts[2];
      for (int side = 0; side < sides_; ++side) {
        fronts[side] = front_of(s, side);
        fronts[side].rest = rest_.data() + top + side * rest_side_size(s);
      }
      std::fill_n(rest_.begin() + top, rest_size(s), 0.0);
      std::ptrdiff_t below = top;
      for (int child = last_child_[s]; child >= 0; child = sibling_[child]) {
        below -= rest_size(child);
        for (int side = 0; side < sides_; ++side)
          add_rest(child, rest_.data() + below + side * rest_side_size(child), fronts[side]);
      }
      front_kernels().eliminate(fronts[0], fronts[sides_ - 1]);
      for (int c = 0; c < fronts[0].columns; ++c) {
        const double pivot = fronts[0].factor[std::ptrdiff_t{fronts[0].length} * c + c];
        if (!is_usable_pivot(pivot)) return {FactorStatus::singular, 0};
        result.negative_pivots += sides_ == 1 && pivot < 0.0;
      }
      if (below < top) std::copy_n(rest_.begin() + top, rest_size(s), rest_.begin() + below);
      top = below + rest_size(s);
    }
    factorized_ = true;
    return result;
  }

  void solve(std::span<double> right_hand_side) const override { solve(right_hand_side, 0, sides_ - 1); }
  void solve_transposed(std::span<double> right_hand_side) const override { solve(right_hand_side, sides_ - 1, 0); }

  void multiply(std::span<const double> x, std::span<double> y) const override {
    require_product(x, y, size());
    std::fill(y.begin(), y.end(), 0.0);
    for (int column = 0; column < size(); ++column) {
      const int first = value_starts_[column], end = value_starts_[column + 1];
      const int* rows = pattern_.row_indices.data() + (pattern_.column_starts[column + 1] - (end - first));
      for (int p = first; p < end; ++p) y[rows[p - first]] += values_[p] * x[column];
      if (sides_ == 2) continue;
      double mirrored = 0.0;
      for (int p = first + 1; p < end; ++p) mirrored += values_[p] * x[rows[p - first]];
      y[column] += mirrored;
    }
  }

  std::unique_ptr<LinearSolver> clone() const override { return std::make_unique<Multifrontal>(*this); }

 private:
  Front front_of(int s, int side) const {
    Front front;
    front.columns = nodes_.columns(s);
    front.rows = front.columns + nodes_.rest(s);
    front.length = padded(front.rows);
    front.rest_length = padded(nodes_.rest(s));
    front.factor = factor_.data() + side * side_size_ + factor_starts_[s];
    front.inverse_pivots = inverse_pivots_.data() + nodes_.column_starts[s];
    front.scratch = scratch_.data() + side * scratch_size_;
    return front;
  }

  void solve(std::span<double> right_hand_side, int down, int up) const {
    require_solvable(factorized_, right_hand_side, size());
    for (int k = 0; k < size(); ++k) work_[k] = right_hand_side[nodes_.order[k]];
    const FrontKernels& kernels = front_kernels();
    const auto x = [&](int s) { return work_.data() + nodes_.column_starts[s]; };
    const auto rows = [&](int s) { return nodes_.rows.data() + nodes_.row_starts[s]; };
    for (int s = 0; s < nodes_.count(); ++s) kernels.solve_down(front_of(s, down), x(s), rows(s), work_.data());
    for (int s = nodes_.count() - 1; s >= 0; --s) kernels.solve_up(front_of(s, up), x(s), rows(s), work_.data());
    for (int k = 0; k < size(); ++k) right_hand_side[nodes_.order[k]] = work_[k];
  }

  /// Numbers on the stack.
  std::ptrdiff_t rest_size(int s) const { return sides_ * rest_side_size(s); }
  std::ptrdiff_t rest_side_size(int s) const { return std::ptrdiff_t{padded(nodes_.rest(s))} * nodes_.rest(s); }

  /// Adds the remaining matrix of a child to the front of its parent.
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

  /// Allocates memory for L and W, and for the greatest size of the stack.
  void make_room() {
    const int count = nodes_.count();
    last_child_.assign(count, -1);
    sibling_.assign(count, -1);
    std::ptrdiff_t top = 0, highest = 0;
    for (int s = 0; s < count; ++s) {
      const std::ptrdiff_t stored = std::ptrdiff_t{padded(nodes_.columns(s) + nodes_.rest(s))} * nodes_.columns(s);
      factor_starts_.push_back(side_size_);
      side_size_ += stored;
      scratch_size_ = std::max(scratch_size_, stored);
      highest = std::max(highest, top + rest_size(s));
      for (int child = last_child_[s]; child >= 0; child = sibling_[child]) top -= rest_size(child);
      top += rest_size(s);
      const int parent = nodes_.parent[s];
      if (parent < 0) continue;
      sibling_[s] = last_child_[parent];
      last_child_[parent] = s;
    }
    factor_.assign(static_cast<std::size_t>(side_size_ * sides_) + kPadding, 0.0);
    rest_.assign(static_cast<std::size_t>(highest) + kPadding, 0.0);
    scratch_.assign(static_cast<std::size_t>(scratch_size_ * sides_) + kPadding, 0.0);
  }

  void number_values() {
    value_starts_.assign(1, 0);
    for (int column = 0; column < size(); ++column) {
      const int end = pattern_.column_starts[column + 1];
      const auto first = sides_ == 1 ? find_entry(pattern_, column, column) : pattern_.column_starts[column];
      value_starts_.push_back(value_starts_.back() + static_cast<int>(end - first));
    }
    values_.assign(static_cast<std::size_t>(value_starts_.back() + pattern_.beside) + kPadding, 0.0);
  }

  /// Place in values_ of entry p of the pattern.
  std::ptrdiff_t number_of(std::ptrdiff_t p, int column) const {
    return p - pattern_.column_starts[column + 1] + value_starts_[column + 1];
  }

  /// Mirrored entry for each entry of the pattern. Rows are sorted, so that the entries of a row are found in the order
  /// of their columns.
  std::vector<int> find_mirrors() const {
    std::vector<int> mirror, next(pattern_.column_starts);
    mirror.reserve(pattern_.row_indices.size());
    for (int row : pattern_.row_indices) mirror.push_back(next[row]++);
    return mirror;
  }

  /// Finds the places of values in L and W, and of the remaining matrices of children in the fronts of their parents.
  void find_places() {
    const std::vector<int> mirror = find_mirrors();
    std::vector<int> place(size()), row_of(size());
    for (int k = 0; k < size(); ++k) place[nodes_.order[k]] = k;
    places_.resize(static_cast<std::size_t>(value_starts_.back()));
    pivots_.resize(size());
    rows_in_parent_.resize(nodes_.rows.size());
    for (int s = 0; s < nodes_.count(); ++s) {
      const int first = nodes_.column_starts[s], columns = nodes_.columns(s), length = front_of(s, 0).length;
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
          const int other = pattern_.row_indices[p];
          if (place[other] < first + c) continue;
          const std::ptrdiff_t own = number_of(p, old), mirrored = number_of(mirror[p], other);
          const std::ptrdiff_t to = column + row_of[place[other]];
          if (sides_ == 1) {
            places_[other >= old ? own : mirrored] = to;
          } else {
            places_[mirrored] = side_size_ + to;
            places_[own] = to;  // the diagonal is its own mirrored entry and belongs to the lower side
          }
        }
      }
    }
  }

  SparsityPattern pattern_;
  int sides_;
  std::vector<int> value_starts_;  // starts of the columns in values_
  std::vector<double> values_;

  Supernodes nodes_;
  std::vector<int> last_child_, sibling_;            // of each supernode; a sibling precedes it
  std::vector<int> rows_in_parent_;                  // per row below a supernode: its row in the parent's front
  std::ptrdiff_t side_size_ = 0, scratch_size_ = 0;  // sizes for one side
  std::vector<std::ptrdiff_t> factor_starts_;        // per supernode
  std::vector<std::ptrdiff_t> places_;               // place of each value in factor_
  std::vector<std::ptrdiff_t> pivots_;               // place of the pivot of each column, in the new order
  mutable std::vector<double> factor_, inverse_pivots_;
  std::vector<double> rest_;
  mutable std::vector<double> scratch_, work_;
  bool factorized_ = false;
};

}  // namespace

std::unique_ptr<LinearSolver> make_multifrontal(const SparsityPattern& pattern, Symmetry symmetry) {
  return std::make_unique<Multifrontal>(pattern, symmetry);
}

}  // namespace withe
