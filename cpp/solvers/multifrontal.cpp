#include "solvers/multifrontal.hpp"

#include <algorithm>
#include <atomic>
#include <functional>
#include <numeric>
#include <vector>

#include "common/worker_pool.hpp"
#include "solvers/elimination_parts.hpp"
#include "solvers/front_kernels.hpp"
#include "solvers/parallel_front.hpp"
#include "solvers/pattern_lookup.hpp"
#include "solvers/supernodes.hpp"

namespace withe {
namespace {

// Operations and entries of L below which a level is left to one thread: waking the others takes as long.
constexpr double kMinShared = 2e5, kMinSharedEntries = 2e5;

int padded(int length) { return (length + kFrontPadding - 1) / kFrontPadding * kFrontPadding; }

/// Sets columns [first, end) of a matrix to zero, where they are many only from the diagonal down.
void clear_columns(double* matrix, int length, int first, int end) {
  double* column = matrix + std::ptrdiff_t{length} * first;
  if (end - first <= kPanelColumns) {
    std::fill_n(column, std::ptrdiff_t{length} * (end - first), 0.0);
    return;
  }
  for (int c = first; c < end; ++c, column += length) {
    const int row = c / kFrontPadding * kFrontPadding;
    std::fill_n(column + row, length - row, 0.0);
  }
}

/// values(): column by column, in the order of the pattern; symmetric: the lower triangle.
///
/// Multifrontal method [Liu 1992]. The columns of a supernode are eliminated in a dense front. The front of the parent
/// adds the remaining matrix. Patterns and places are computed once, and the numeric phase uses them. An unsymmetric
/// matrix has two sides, one for L and one for W. Each side has its own fronts.
///
/// Several threads share the subtrees of `EliminationParts`, and then the supernodes above them, level by level. Each
/// subtree has a stack of remaining matrices, each supernode above has a place of its own. Sums do not depend on
/// threads.
class Multifrontal final : public LinearSolver {
 public:
  Multifrontal(const SparsityPattern& pattern, Symmetry symmetry)
      : pattern_(pattern),
        sides_(symmetry == Symmetry::symmetric ? 1 : 2),
        nodes_(find_supernodes(pattern)),
        parts_(divide(nodes_)),
        inverse_pivots_(pattern.size, 0.0),
        work_(pattern.size) {
    number_values();
    find_children();
    make_room();
    find_places();
    make_vectors();
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
    std::atomic<int> negative = 0;
    std::atomic<bool> usable = true;
    run(parts_.subtrees.size(), [&](std::size_t i) {
      for (int s = parts_.subtrees[i].first; s < parts_.subtrees[i].end && usable; ++s)
        eliminate(s, shift, nullptr, negative, usable);
    });
    for (const EliminationParts::Level& level : parts_.levels) {
      if (!usable) break;
      const bool shared = workers_ && level.operations >= kMinShared;
      // Supernodes that would keep one thread busy longer than the others.
      std::size_t large = 0;
      while (shared && large < level.supernodes.size() &&
             nodes_.operations(level.supernodes[large]) * workers_->workers() > level.operations)
        eliminate(level.supernodes[large++], shift, workers_, negative, usable);
      const auto others = [&](std::size_t i) {
        eliminate(level.supernodes[large + i], shift, nullptr, negative, usable);
      };
      run(level.supernodes.size() - large, others, shared);
    }
    if (!usable) return {FactorStatus::singular, 0};
    factorized_ = true;
    return {FactorStatus::ok, sides_ == 1 ? negative.load() : 0};
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

  void share_work(WorkerPool* workers) override {
    const bool shared = workers && workers->workers() > 1 && !parts_.undivided(), before = workers_ != nullptr;
    workers_ = shared ? workers : nullptr;
    if (shared != before) make_room();
  }

 private:
  /// Calls work(i) for each i below `count`, by several threads where that is allowed. Does not allocate.
  template <class Work>
  void run(std::size_t count, const Work& work, bool shared = true) const {
    if (workers_ && shared) return workers_->run(count, std::ref(work));
    for (std::size_t i = 0; i < count; ++i) work(i);
  }

  Front front_of(int s, int side) const {
    Front front;
    front.columns = nodes_.columns(s);
    front.rows = front.columns + nodes_.rest(s);
    front.length = padded(front.rows);
    front.rest_length = padded(nodes_.rest(s));
    front.factor = factor_.data() + side * side_size_ + factor_starts_[s];
    front.inverse_pivots = inverse_pivots_.data() + nodes_.column_starts[s];
    front.scratch = scratch_.data() + scratch_starts_[s] + side * std::ptrdiff_t{front.length} * front.columns;
    front.rest = rest_.data() + built_at_[s] + side * rest_side_size(s);
    return front;
  }

  /// Eliminates the columns of a supernode, whose children are done. `workers`: threads that share its front.
  void eliminate(int s, std::span<const double> shift, WorkerPool* workers, std::atomic<int>& negative,
                 std::atomic<bool>& usable) {
    const Front fronts[2] = {front_of(s, 0), front_of(s, sides_ - 1)};
    for (int side = 0; side < sides_; ++side) {
      clear_columns(fronts[side].factor, fronts[side].length, 0, fronts[side].columns);
      for (int p = entry_starts_[side][s]; p < entry_starts_[side][s + 1]; ++p)
        fronts[side].factor[entries_[side][p].place] = values_[entries_[side][p].value];
      in_pieces(workers, nodes_.rest(s),
                [&](int first, int end) { clear_columns(fronts[side].rest, fronts[side].rest_length, first, end); });
    }
    if (!shift.empty())
      for (int c = 0; c < fronts[0].columns; ++c)
        fronts[0].factor[std::ptrdiff_t{fronts[0].length} * c + c] += shift[nodes_.order[nodes_.column_starts[s] + c]];
    for (int child = last_child_[s]; child >= 0; child = sibling_[child]) {
      for (int side = 0; side < sides_; ++side) {
        const double* rest = rest_.data() + kept_at_[child] + side * rest_side_size(child);
        in_pieces(workers, nodes_.rest(child),
                  [&](int first, int end) { add_rest(child, rest, first, end, fronts[side]); });
      }
    }
    if (workers)
      eliminate_together(*workers, fronts[0], fronts[sides_ - 1]);
    else
      front_kernels().eliminate(fronts[0], fronts[sides_ - 1]);
    int below_zero = 0;
    for (int c = 0; c < fronts[0].columns; ++c) {
      const double pivot = fronts[0].factor[std::ptrdiff_t{fronts[0].length} * c + c];
      if (!is_usable_pivot(pivot)) usable = false;
      below_zero += pivot < 0.0;
    }
    negative += below_zero;
    if (kept_at_[s] < built_at_[s])
      std::copy_n(rest_.begin() + built_at_[s], rest_size(s), rest_.begin() + kept_at_[s]);
  }

  void solve(std::span<double> right_hand_side, int down, int up) const {
    require_solvable(factorized_, right_hand_side, size());
    for (int k = 0; k < size(); ++k) work_[k] = right_hand_side[nodes_.order[k]];
    run(parts_.subtrees.size(), [&](std::size_t i) { solve_down(parts_.subtrees[i], down); });
    for (const EliminationParts::Level& level : parts_.levels)
      run(
          level.supernodes.size(), [&](std::size_t i) { solve_down(level.supernodes[i], down); },
          level.entries >= kMinSharedEntries);
    for (auto level = parts_.levels.rbegin(); level != parts_.levels.rend(); ++level)
      run(
          level->supernodes.size(), [&](std::size_t i) { solve_up(level->supernodes[i], up); },
          level->entries >= kMinSharedEntries);
    run(parts_.subtrees.size(), [&](std::size_t i) {
      for (int s = parts_.subtrees[i].end - 1; s >= parts_.subtrees[i].first; --s) solve_up(s, up);
    });
    for (int k = 0; k < size(); ++k) right_hand_side[nodes_.order[k]] = work_[k];
  }

  /// Solves L x = x in the columns of a subtree. The products with x, which are to be subtracted from the rows below
  /// its root, are summed in the vector of the root.
  void solve_down(const EliminationParts::Subtree& subtree, int side) const {
    const int root = subtree.end - 1, first = nodes_.column_starts[subtree.first];
    const int columns = nodes_.column_starts[subtree.end] - first;
    const bool undivided = parts_.undivided();
    double* x = undivided ? work_.data() : vectors_.data() + vector_starts_[root];
    if (!undivided) {
      std::copy_n(work_.data() + first, columns, x);
      std::fill_n(x + columns, nodes_.rest(root), 0.0);
    }
    for (int s = subtree.first; s < subtree.end; ++s)
      front_kernels().solve_down(front_of(s, side), x + nodes_.column_starts[s] - first,
                                 rows_in_subtree_.data() + nodes_.row_starts[s], x);
    if (!undivided) std::copy_n(x, columns, work_.data() + first);
  }

  /// As above, for one supernode above the subtrees: its vector has its columns and the rows below.
  void solve_down(int s, int side) const {
    const int columns = nodes_.columns(s);
    double *x = vectors_.data() + vector_starts_[s], *own = work_.data() + nodes_.column_starts[s];
    std::copy_n(own, columns, x);
    std::fill_n(x + columns, nodes_.rest(s), 0.0);
    for (int child = last_child_[s]; child >= 0; child = sibling_[child]) {
      const double* below = vectors_.data() + below_starts_[child];
      const int* place = rows_in_parent_.data() + nodes_.row_starts[child];
      for (int r = 0; r < nodes_.rest(child); ++r) x[place[r]] += below[r];
    }
    front_kernels().solve_down(front_of(s, side), x, successive_.data(), x + columns);
    std::copy_n(x, columns, own);
  }

  void solve_up(int s, int side) const {
    front_kernels().solve_up(front_of(s, side), work_.data() + nodes_.column_starts[s],
                             nodes_.rows.data() + nodes_.row_starts[s], work_.data());
  }

  /// Numbers on the stack.
  std::ptrdiff_t rest_size(int s) const { return sides_ * rest_side_size(s); }
  std::ptrdiff_t rest_side_size(int s) const { return std::ptrdiff_t{padded(nodes_.rest(s))} * nodes_.rest(s); }

  /// Adds columns of the remaining matrix of a child to the front of its parent.
  void add_rest(int child, const double* rest, int first, int end, const Front& parent) const {
    const int rows = nodes_.rest(child), length = padded(rows);
    const int* place = rows_in_parent_.data() + nodes_.row_starts[child];
    rest += std::ptrdiff_t{length} * first;
    for (int column = first; column < end; ++column, rest += length) {
      const int to = place[column];
      double* target = to < parent.columns
                           ? parent.factor + std::ptrdiff_t{parent.length} * to
                           : parent.rest + std::ptrdiff_t{parent.rest_length} * (to - parent.columns) - parent.columns;
      for (int row = column; row < rows; ++row) target[place[row]] += rest[row];
    }
  }

  void find_children() {
    last_child_.assign(nodes_.count(), -1);
    sibling_.assign(nodes_.count(), -1);
    for (int s = 0; s < nodes_.count(); ++s) {
      const int parent = nodes_.parent[s];
      if (parent < 0) continue;
      sibling_[s] = last_child_[parent];
      last_child_[parent] = s;
    }
  }

  /// Allocates memory for L and W, and for the remaining matrices. Those of the roots of subtrees and of supernodes
  /// above have places of their own. The others are on a stack. Threads need a stack and scratch each.
  void make_room() {
    const int count = nodes_.count();
    factor_starts_.resize(count);
    scratch_starts_.resize(count);
    built_at_.resize(count);
    kept_at_.resize(count);
    side_size_ = 0;
    const auto stored = [&](int s) {
      return std::ptrdiff_t{padded(nodes_.columns(s) + nodes_.rest(s))} * nodes_.columns(s);
    };
    for (int s = 0; s < count; ++s) {
      factor_starts_[s] = side_size_;
      side_size_ += stored(s) + kFrontPadding;  // kernels read so many numbers after the last column
    }
    std::ptrdiff_t rest_end = 0, rest_size_needed = 0, scratch_end = 0, scratch_size_needed = 0;
    const auto keep = [&](int s) {
      built_at_[s] = kept_at_[s] = rest_end;
      rest_end += rest_size(s);
    };
    for (const EliminationParts::Level& level : parts_.levels) {
      for (int s : level.supernodes) {
        keep(s);
        scratch_starts_[s] = scratch_end;
        scratch_size_needed = std::max(scratch_size_needed, scratch_end + sides_ * stored(s));
        if (workers_) scratch_end += sides_ * stored(s);
      }
    }
    if (!parts_.undivided())
      for (const EliminationParts::Subtree& subtree : parts_.subtrees) keep(subtree.end - 1);
    for (const EliminationParts::Subtree& subtree : parts_.subtrees) {
      std::ptrdiff_t top = rest_end, highest = rest_end, scratch = 0;
      for (int s = subtree.first; s < subtree.end; ++s) {
        scratch_starts_[s] = scratch_end;
        scratch = std::max(scratch, sides_ * stored(s));
        if (s == subtree.end - 1 && !parts_.undivided()) continue;
        built_at_[s] = top;
        highest = std::max(highest, top + rest_size(s));
        for (int child = last_child_[s]; child >= 0; child = sibling_[child]) top -= rest_size(child);
        kept_at_[s] = top;
        top += rest_size(s);
      }
      rest_size_needed = std::max(rest_size_needed, highest);
      scratch_size_needed = std::max(scratch_size_needed, scratch_end + scratch);
      if (!workers_) continue;
      rest_end = highest;
      scratch_end += scratch;
    }
    factor_.resize(static_cast<std::size_t>(side_size_ * sides_) + kPadding, 0.0);
    rest_.resize(static_cast<std::size_t>(std::max(rest_end, rest_size_needed)) + kPadding, 0.0);
    scratch_.resize(static_cast<std::size_t>(scratch_size_needed) + kPadding, 0.0);
  }

  /// Vectors of the roots of subtrees and of the supernodes above, see `solve_down`.
  void make_vectors() {
    rows_in_subtree_ = nodes_.rows;
    successive_.resize(size());
    std::iota(successive_.begin(), successive_.end(), 0);
    if (parts_.undivided()) return;
    vector_starts_.assign(nodes_.count(), -1);
    below_starts_.assign(nodes_.count(), -1);
    std::ptrdiff_t end = 0;
    const auto add = [&](int s, int columns) {
      vector_starts_[s] = end;
      below_starts_[s] = end + columns;
      end += columns + nodes_.rest(s);
    };
    for (const EliminationParts::Subtree& subtree : parts_.subtrees) {
      const int root = subtree.end - 1, first = nodes_.column_starts[subtree.first];
      const int columns = nodes_.column_starts[subtree.end] - first;
      add(root, columns);
      const auto below = nodes_.rows.begin() + nodes_.row_starts[root], end_below = below + nodes_.rest(root);
      for (int r = nodes_.row_starts[subtree.first]; r < nodes_.row_starts[subtree.end]; ++r) {
        const int row = nodes_.rows[r];
        rows_in_subtree_[r] = row < first + columns
                                  ? row - first
                                  : columns + static_cast<int>(std::lower_bound(below, end_below, row) - below);
      }
    }
    for (const EliminationParts::Level& level : parts_.levels)
      for (int s : level.supernodes) add(s, nodes_.columns(s));
    vectors_.assign(static_cast<std::size_t>(end) + kPadding, 0.0);
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
  int number_of(std::ptrdiff_t p, int column) const {
    return static_cast<int>(p) - pattern_.column_starts[column + 1] + value_starts_[column + 1];
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
    rows_in_parent_.resize(nodes_.rows.size());
    for (int side = 0; side < sides_; ++side) entry_starts_[side].assign(1, 0);
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
        const int column = length * c;
        for (int p = pattern_.column_starts[old]; p < pattern_.column_starts[old + 1]; ++p) {
          const int other = pattern_.row_indices[p];
          if (place[other] < first + c) continue;
          const int own = number_of(p, old), mirrored = number_of(mirror[p], other);
          const int to = column + row_of[place[other]];
          if (sides_ == 1) {
            entries_[0].push_back({other >= old ? own : mirrored, to});
          } else {
            entries_[0].push_back({own, to});
            if (other != old) entries_[1].push_back({mirrored, to});  // the diagonal belongs to the lower side
          }
        }
      }
      for (int side = 0; side < sides_; ++side) entry_starts_[side].push_back(static_cast<int>(entries_[side].size()));
    }
  }

  /// Place of a value in the columns of its front.
  struct Entry {
    int value, place;
  };

  SparsityPattern pattern_;
  int sides_;
  std::vector<int> value_starts_;  // starts of the columns in values_
  std::vector<double> values_;

  Supernodes nodes_;
  EliminationParts parts_;
  WorkerPool* workers_ = nullptr;
  std::vector<int> last_child_, sibling_;  // of each supernode; a sibling precedes it
  std::vector<int> rows_in_parent_;        // per row below a supernode: its row in the parent's front
  std::vector<int> rows_in_subtree_;       // per row below a supernode of a subtree: its place in the root's vector
  std::vector<int> successive_;            // 0, 1, 2, ...
  std::ptrdiff_t side_size_ = 0;           // size of L
  std::vector<std::ptrdiff_t> factor_starts_, scratch_starts_;  // per supernode
  std::vector<std::ptrdiff_t> built_at_, kept_at_;              // its remaining matrix, while and after it is computed
  std::vector<std::ptrdiff_t> vector_starts_, below_starts_;    // its vector, and the rows below its columns in it
  std::vector<Entry> entries_[2];                               // supernode after supernode, per side
  std::vector<int> entry_starts_[2];
  mutable std::vector<double> factor_, inverse_pivots_;
  mutable std::vector<double> rest_, scratch_, work_, vectors_;
  bool factorized_ = false;
};

}  // namespace

std::unique_ptr<LinearSolver> make_multifrontal(const SparsityPattern& pattern, Symmetry symmetry) {
  return std::make_unique<Multifrontal>(pattern, symmetry);
}

}  // namespace withe
