#pragma once
/// Dense work of a sparse factorisation, by the instruction set in use. A front is a few columns that are eliminated
/// together, with all rows that they have entries in: their own first. Raw pointers only: the kernels behind share no
/// code with the rest.

#include "common/instruction_set.hpp"

namespace withe {

/// Columns are stored one after another. Their length is a multiple of kFrontPadding. Values above the diagonal and
/// after the last row are undefined. kPadding numbers after the end of each array may be read.
constexpr int kFrontPadding = 4;
/// Columns of a panel: columns are eliminated panel by panel, so that those that update a column stay in the cache.
constexpr int kPanelColumns = 48;
static_assert(kPanelColumns % kFrontPadding == 0);

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

/// Columns [first, end) of a panel.
struct Panel {
  int first, end;
};

/// Kernels of the factorisation A = L D W^T. `lower` has the columns of A from the diagonal down, and L replaces them.
/// `upper` has its rows to the right of the diagonal, and W replaces them. If A is symmetric, W = L, and both are the
/// same front. `other` is the front of the other side.
struct FrontKernels {
  /// Factorises all columns of a front.
  void (*eliminate)(const Front& lower, const Front& upper);
  /// Factorises the rows of a panel that are its own columns, after all panels before it.
  void (*eliminate_panel)(const Front& lower, const Front& upper, Panel panel);
  /// Computes the rows [row, end_row) below a panel, whose own rows are factorised; both are multiples of
  /// kFrontPadding.
  void (*finish_rows)(const Front& a, const Front& other, Panel panel, int row, int end_row);
  /// Subtracts the products of a panel's columns from the columns [column, end_column) after it, in `factor` and
  /// `rest`.
  void (*update)(const Front& a, const Front& other, Panel panel, int column, int end_column);
  /// Solves L x = x in place. Subtracts the products with x from `all` at `rows`, the rows below the columns of the
  /// front.
  void (*solve_down)(const Front& front, double* x, const int* rows, double* all);
  /// Solves L^T x = D^-1 x in place, where `all` is known at `rows`.
  void (*solve_up)(const Front& front, double* x, const int* rows, const double* all);
};

const FrontKernels& front_kernels();

}  // namespace withe
