#pragma once
/// Elimination of a symmetric sparse matrix, found once from its pattern: its order, and the columns eliminated at
/// once.

#include <vector>

#include "solvers/linear_solver.hpp"

namespace withe {

/// Supernodes: columns of L that follow one another and have their entries in the same rows, or nearly.
struct Supernodes {
  std::vector<int> order;          ///< order of the unknowns: new -> old
  std::vector<int> column_starts;  ///< first column of each, count + 1
  std::vector<int> row_starts;     ///< start of each supernode in `rows`, count + 1
  std::vector<int> rows;           ///< below its own columns, ascending
  std::vector<int> parent;         ///< supernode to which the remaining matrix is added, always a later one; -1: none

  int count() const { return static_cast<int>(parent.size()); }
  int columns(int s) const { return column_starts[s + 1] - column_starts[s]; }
  int rest(int s) const { return row_starts[s + 1] - row_starts[s]; }
  /// Numbers that L takes, its diagonal included, and additions and multiplications to find them; A is symmetric.
  double entries() const;
  double operations() const;
  double entries(int s) const;  ///< of one supernode
  double operations(int s) const;
};

/// Finds supernodes in the order of approximate minimum degree. If this order is costly and nested dissection costs
/// less, the order is that of dissection. Every subtree is together, and its root comes last.
Supernodes find_supernodes(const SparsityPattern& pattern);

}  // namespace withe
