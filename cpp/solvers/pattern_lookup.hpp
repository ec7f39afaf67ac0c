#pragma once
/// Checks and look-ups that every solver needs; private to this room.

#include <cstddef>
#include <span>

#include "solvers/linear_solver.hpp"

namespace withe {

/// Throws std::invalid_argument unless the pattern is valid, see SparsityPattern.
void require_valid(const SparsityPattern& pattern);

/// Place of (row, column) in pattern.row_indices; throws std::invalid_argument outside the pattern.
std::ptrdiff_t find_entry(const SparsityPattern& pattern, int row, int column);

/// The same, and refuses row < column: a symmetric matrix keeps its lower triangle.
std::ptrdiff_t find_lower_entry(const SparsityPattern& pattern, int row, int column);

/// Throws std::invalid_argument unless the shift is empty or has one number a row.
void require_shift(std::span<const double> shift, int size);

/// Throws std::logic_error unless there is a factorisation to solve with, and
/// std::invalid_argument unless the right-hand side has one number a row.
void require_solvable(bool factorized, std::span<const double> right_hand_side, int size);

/// Throws std::invalid_argument unless x and y have one number a row and do not share memory.
void require_product(std::span<const double> x, std::span<const double> y, int size);

/// False for a zero, subnormally small or non-finite pivot.
bool is_usable_pivot(double pivot);

}  // namespace withe
