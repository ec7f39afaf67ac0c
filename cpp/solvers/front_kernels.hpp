#pragma once
/// Dense work of a sparse factorisation, by the instruction set in use. A front is a few columns that are eliminated
/// together, with all rows that they have entries in: their own first. Raw pointers only: the kernels behind share no
/// code with the rest.

#include "common/instruction_set.hpp"

namespace withe {

/// Columns are stored one after another. Their length is a multiple of kFrontPadding. Values above the diagonal and
/// after the last row are undefined. kPadding numbers after the end of each array may be read.
constexpr int kFrontPadding = 4;

struct Front {
  int columns = 0;           ///< number of eliminated columns
  int rows = 0;              ///< number of rows: of these columns, and further ones
  int length = 0;            ///< length of a column of `factor` and of `scratch`
  int rest_length = 0;       ///< length of a column of `rest`
  double* factor = nullptr;  ///< `columns` columns of the matrix; becomes D, with L below the diagonal
  double* rest = nullptr;    ///< square of size rows - columns: becomes the remaining matrix
  double* inverse_pivots = nullptr;
  double* scratch = nullptr;  ///< receives L D, size of `factor`; for solves, size `length`
};

struct FrontKernels {
  /// Factorises A = L D W^T. `lower` has the columns of A from the diagonal down, and L replaces them. `upper` has
  /// its rows to the right of the diagonal, and W replaces them. If A is symmetric, W = L, and both are the same front.
  void (*eliminate)(const Front& lower, const Front& upper);
  /// Solves L x = x in place. Subtracts the products with x from `all` at `rows`, the rows below the columns of the
  /// front.
  void (*solve_down)(const Front& front, double* x, const int* rows, double* all);
  /// Solves L^T x = D^-1 x in place, where `all` is known at `rows`.
  void (*solve_up)(const Front& front, double* x, const int* rows, const double* all);
};

const FrontKernels& front_kernels();

}  // namespace withe
