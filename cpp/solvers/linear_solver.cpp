#include "solvers/linear_solver.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <string_view>

#include "common/check.hpp"
#include "solvers/band_ldlt.hpp"
#include "solvers/band_lu.hpp"
#include "solvers/multifrontal.hpp"
#include "solvers/pattern_lookup.hpp"
#include "solvers/sparse_lu.hpp"

namespace withe {
namespace {

constexpr int kWidestAutomaticBand = 24;
constexpr double kSmallestPivot = 1e-300;

std::string entry_text(int row, int column) {
  return "entry (" + std::to_string(row) + ", " + std::to_string(column) + ")";
}

void require_length(std::string_view argument, std::size_t got, int expected) {
  if (got == static_cast<std::size_t>(expected)) return;
  throw std::invalid_argument(std::string(argument) + " must have " + std::to_string(expected) + " entries, got " +
                              std::to_string(got));
}

}  // namespace

SparsityPattern SparsityPattern::from_cliques(int size, const std::vector<std::vector<int>>& cliques) {
  require(size >= 1, "size of a sparsity pattern must be at least 1, got ", size);
  std::vector<int> starts(size + 1, 0);  // start of the list of cliques that contain each column
  for (const std::vector<int>& clique : cliques) {
    for (int column : clique) {
      require(column < size, "unknown in cliques must be below size ", size, ", got ", column);
      if (column >= 0) ++starts[column + 1];
    }
  }
  std::partial_sum(starts.begin(), starts.end(), starts.begin());
  std::vector<const std::vector<int>*> cliques_of(starts.back());
  std::vector<int> ends(starts.begin(), starts.end() - 1);
  for (const std::vector<int>& clique : cliques)
    for (int column : clique)
      if (column >= 0) cliques_of[ends[column]++] = &clique;
  SparsityPattern pattern;
  pattern.size = size;
  pattern.column_starts.reserve(size + 1);
  pattern.column_starts.push_back(0);
  std::vector<int> seen(size, -1), rows;
  for (int column = 0; column < size; ++column) {
    rows.assign(1, column);
    seen[column] = column;
    for (int k = starts[column]; k < starts[column + 1]; ++k) {
      for (int row : *cliques_of[k]) {
        if (row < 0 || seen[row] == column) continue;
        seen[row] = column;
        rows.push_back(row);
      }
    }
    std::sort(rows.begin(), rows.end());
    pattern.row_indices.insert(pattern.row_indices.end(), rows.begin(), rows.end());
    pattern.column_starts.push_back(static_cast<int>(pattern.row_indices.size()));
  }
  return pattern;
}

std::ptrdiff_t SparsityPattern::find(int row, int column) const {
  // Without branches: all but one step of a short search would be mispredicted as often as not.
  const int* first = row_indices.data() + column_starts[column];
  for (int count = column_starts[column + 1] - column_starts[column]; count > 1;) {
    const int half = count / 2;
    first += first[half] <= row ? half : 0;
    count -= half;
  }
  return *first == row ? first - row_indices.data() : std::ptrdiff_t{-1};
}

int SparsityPattern::half_bandwidth() const {
  int widest = 0;
  for (int column = 0; column < size; ++column) {
    for (int p = column_starts[column]; p < column_starts[column + 1]; ++p) {
      widest = std::max(widest, std::abs(row_indices[p] - column));
    }
  }
  return widest;
}

void require_valid(const SparsityPattern& pattern) {
  require(pattern.size >= 1, "size of a sparsity pattern must be at least 1, got ", pattern.size);
  require_length("column_starts", pattern.column_starts.size(), pattern.size + 1);
  const std::vector<int>& starts = pattern.column_starts;
  require(starts.front() == 0 && std::is_sorted(starts.begin(), starts.end()),
          "column_starts must begin with 0 and not decrease");
  require_length("row_indices", pattern.row_indices.size(), starts.back());
  for (int column = 0; column < pattern.size; ++column) {
    const auto begin = pattern.row_indices.begin() + starts[column];
    const auto end = pattern.row_indices.begin() + starts[column + 1];
    require(std::adjacent_find(begin, end, std::greater_equal<int>()) == end, "row_indices of column ", column,
            " must increase");
    require(begin == end || (*begin >= 0 && *(end - 1) < pattern.size), "row_indices of column ", column,
            " must lie within the matrix");
    require(std::binary_search(begin, end, column), "pattern lacks diagonal entry (", column, ", ", column, ")");
  }
  // Column by column the mirrored entries come up in the order of their rows.
  std::vector<int> next(starts.begin(), starts.end() - 1);
  for (int column = 0; column < pattern.size; ++column) {
    for (int p = starts[column]; p < starts[column + 1]; ++p) {
      const int row = pattern.row_indices[p], mirrored = next[row]++;
      if (mirrored >= starts[row + 1] || pattern.row_indices[mirrored] != column)
        find_entry(pattern, column, row);  // throws if the mirrored entry is missing
    }
  }
}

std::ptrdiff_t find_entry(const SparsityPattern& pattern, int row, int column) {
  if (row >= 0 && row < pattern.size && column >= 0 && column < pattern.size) {
    if (const std::ptrdiff_t found = pattern.find(row, column); found >= 0) return found;
  }
  throw std::invalid_argument(entry_text(row, column) + " is outside the sparsity pattern of a matrix of size " +
                              std::to_string(pattern.size));
}

std::ptrdiff_t find_lower_entry(const SparsityPattern& pattern, int row, int column) {
  if (row < column) {
    throw std::invalid_argument("row of a symmetric matrix's entry must not be below its column, got " +
                                entry_text(row, column));
  }
  return find_entry(pattern, row, column);
}

void require_shift(std::span<const double> shift, int size) {
  if (!shift.empty()) require_length("shift", shift.size(), size);
}

void require_solvable(bool factorized, std::span<const double> right_hand_side, int size) {
  if (!factorized) throw std::logic_error("solve needs a factorisation that did not end singular");
  require_length("right_hand_side", right_hand_side.size(), size);
}

void require_product(std::span<const double> x, std::span<const double> y, int size) {
  require_length("x", x.size(), size);
  require_length("y", y.size(), size);
  const std::less<const double*> before;
  if (before(x.data(), y.data() + y.size()) && before(y.data(), x.data() + x.size())) {
    throw std::invalid_argument("x and y of a product must not share memory");
  }
}

bool is_usable_pivot(double pivot) {
  const double magnitude = std::abs(pivot);
  return magnitude >= kSmallestPivot && magnitude <= std::numeric_limits<double>::max();
}

std::unique_ptr<LinearSolver> make_linear_solver(const SparsityPattern& pattern, Symmetry symmetry, SolverKind kind) {
  require_valid(pattern);
  const bool band =
      kind == SolverKind::band || (kind == SolverKind::automatic && pattern.half_bandwidth() <= kWidestAutomaticBand);
  if (symmetry == Symmetry::symmetric) return band ? make_band_ldlt(pattern) : make_multifrontal(pattern, symmetry);
  return band ? make_band_lu(pattern) : make_sparse_lu(pattern);
}

}  // namespace withe
