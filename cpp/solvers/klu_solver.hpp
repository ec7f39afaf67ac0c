#pragma once
/// Unsymmetric sparse solver over KLU [Davis and Palamadai Natarajan 2010]. The only header that knows of it.

#include <memory>

#include "solvers/linear_solver.hpp"

namespace withe {

/// The pattern must be valid (require_valid); it is analysed here, once.
std::unique_ptr<LinearSolver> make_klu_solver(const SparsityPattern& pattern);

}  // namespace withe
