#pragma once
/// Parts of a sparse elimination that several threads may compute at once. They depend on the pattern alone, and so do
/// all sums: a result has the same bits for every number of threads.

#include <vector>

#include "solvers/supernodes.hpp"

namespace withe {

/// Subtrees of the elimination tree, which are independent, and the supernodes above them, level by level: the children
/// of a supernode are in subtrees or on lower levels.
struct EliminationParts {
  /// Supernodes [first, end). Only the last one may have a parent, which is above.
  struct Subtree {
    int first, end;
  };
  /// Supernodes above the subtrees, which are independent of each other, with their operations and their entries of L.
  struct Level {
    std::vector<int> supernodes;  ///< the costliest first
    double operations = 0.0, entries = 0.0;
  };

  std::vector<Subtree> subtrees;  ///< the costliest first
  std::vector<Level> levels;

  /// True if the matrix is too small to be divided: all supernodes are in one subtree.
  bool undivided() const { return levels.empty(); }
};

EliminationParts divide(const Supernodes& supernodes);

}  // namespace withe
