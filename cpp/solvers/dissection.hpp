#pragma once
/// Order of elimination by nested dissection: the unknowns of a separator come after those of both parts that it
/// separates [George 1973]. Parts of few unknowns are ordered by minimum degree.
///
/// Minimum degree compares single unknowns. In a net with nodes at the crossings only, the angles of a cord's edges
/// have the fewest neighbours. Their elimination couples all nodes of the cord. Dissection sees the whole graph: L of a
/// planar net of n unknowns has about n log n entries and costs about n^1.5 operations [Lipton, Rose and Tarjan 1979].

#include <vector>

#include "solvers/linear_solver.hpp"

namespace withe {

/// New order of the unknowns: new -> old. It depends on the pattern alone.
std::vector<int> dissection_order(const SparsityPattern& pattern);

}  // namespace withe
