#pragma once
/// Order of elimination by approximate minimum degree [Amestoy, Davis and Duff 1996].

#include <vector>

#include "solvers/linear_solver.hpp"

namespace withe {

/// New order of the unknowns that keeps L sparse: new -> old.
std::vector<int> minimum_degree_order(const SparsityPattern& pattern);

}  // namespace withe
