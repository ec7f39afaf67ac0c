#pragma once
/// Sparse solver without pivoting: P A P^T = L D W^T, W = L where A is symmetric; the order is that of find_supernodes.

#include <memory>

#include "solvers/linear_solver.hpp"

namespace withe {

/// The pattern must be valid (require_valid); it is analysed here, once.
std::unique_ptr<LinearSolver> make_multifrontal(const SparsityPattern& pattern, Symmetry symmetry);

}  // namespace withe
