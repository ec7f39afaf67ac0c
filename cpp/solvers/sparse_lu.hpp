#pragma once
/// Unsymmetric sparse solver: without pivoting where that is accurate, by KLU where it is not.

#include <memory>

#include "solvers/linear_solver.hpp"

namespace withe {

/// The pattern must be valid (require_valid); it is analysed here, once.
std::unique_ptr<LinearSolver> make_sparse_lu(const SparsityPattern& pattern);

}  // namespace withe
