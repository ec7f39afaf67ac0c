#pragma once
/// Symmetric sparse solver: P A P^T = L D L^T, approximate minimum degree ordering, no pivoting.

#include <memory>

#include "solvers/linear_solver.hpp"

namespace withe {

/// The pattern must be valid (require_valid); it is analysed here, once.
std::unique_ptr<LinearSolver> make_sparse_ldlt(const SparsityPattern& pattern);

}  // namespace withe
