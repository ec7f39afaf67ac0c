#pragma once
/// Dense work of a sparse factorisation, by the instruction set in use. A front is a few columns that are eliminated
/// together, with all rows that they have entries in: their own first. Raw pointers only: the kernels behind share no
/// code with the rest.

#include "common/instruction_set.hpp"

namespace withe {

/// Columns lie one after another, their length a multiple of kFrontPadding; what is above the diagonal, and past the
/// last row, means nothing. kPadding numbers past the end of each array may be read.
constexpr int kFrontPadding = 4;

struct Front {
  int columns = 0;           ///< eliminated
  int rows = 0;              ///< theirs and further ones
  int length = 0;            ///< of a column of `factor` and of `scratch`
  int rest_length = 0;       ///< of a column of `rest`
  double* factor = nullptr;  ///< `columns`: the matrix; becomes L below D on the diagonal
  double* rest = nullptr;    ///< rows - columns, square: becomes what is left to eliminate
  double* inverse_pivots = nullptr;
  double* scratch = nullptr;  ///< as large as `factor`: gets L D; to solve with, `length`
};

struct FrontKernels {
  /// A = L D W^T, W in place of L in `upper`: A's columns from the diagonal down in `lower`, its rows from the diagonal
  /// on, without it, in `upper`. Where A is symmetric, W = L, and both are the same front.
  void (*eliminate)(const Front& lower, const Front& upper);
  /// L x = x in place; takes what goes with x from `all`, at `rows`, those below the front's columns.
  void (*solve_down)(const Front& front, double* x, const int* rows, double* all);
  /// L^T x = D^-1 x in place, `all` being known at `rows`.
  void (*solve_up)(const Front& front, double* x, const int* rows, const double* all);
};

const FrontKernels& front_kernels();

}  // namespace withe
