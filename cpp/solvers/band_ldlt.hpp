#pragma once
/// Symmetric band solver: A = L D L^T without pivoting, for an indefinite A too as long as no pivot
/// vanishes. The signs of D are those of the eigenvalues [Sylvester's law of inertia].

#include <memory>

#include "solvers/linear_solver.hpp"

namespace withe {

/// The pattern must be valid (require_valid); it is analysed here, once.
std::unique_ptr<LinearSolver> make_band_ldlt(const SparsityPattern& pattern);

}  // namespace withe
