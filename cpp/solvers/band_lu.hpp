#pragma once
/// Unsymmetric band solver: P A = L U, threshold pivoting by rows [Golub and Van Loan 2013, sec. 4.3.3; Duff, Erisman
/// and Reid 2017, sec. 5.2].

#include <memory>

#include "solvers/linear_solver.hpp"

namespace withe {

/// The pattern must be valid (require_valid); it is analysed here, once.
std::unique_ptr<LinearSolver> make_band_lu(const SparsityPattern& pattern);

}  // namespace withe
