#pragma once
/// The arithmetic of the unsymmetric band solver where rows are exchanged, by the instruction set in use. Raw pointers
/// only: the kernels behind share no code with the rest.
///
/// While column j is eliminated, rows j ... j + w are active (w the half bandwidth). Row i of `work` holds columns
/// i - w ... i + 2 w: exchanges widen U to 2 w. Multipliers stay where they were made, as the exchanges of later
/// columns are applied to the right-hand side in turn. Rows are padded, to the right with zeros, so that they are read
/// in packs, which begin where columns are multiples of their length.

#include "solvers/band_kernels.hpp"

namespace withe {

/// From one row of `work` to the next in the same column: columns i - w ... i + 2 w, padded to either side.
constexpr int band_lu_stride(int width) { return band_padded(3 * width + 2 * kBandPadding); }

struct BandLuFactor {
  int size = 0, width = 0;
  int value_stride = 0, work_stride = 0, multiplier_stride = 0;
  double* work = nullptr;         ///< column 0 of row 0, aligned to packs; of size rows: U from the diagonal on
  double* multipliers = nullptr;  ///< size rows: multiples of the pivot row that were subtracted from the rows below
  double* inverse_pivots = nullptr;
  double* row_scales = nullptr;  ///< 1 / the greatest entry of each row of the matrix
  int* pivot_rows = nullptr;     ///< row with which each row was exchanged
  int* last_columns = nullptr;   ///< last column of each row of U
};

struct BandLuKernels {
  /// Factorises a matrix. `values` has the rows of the band one after another, 2 w + 1 numbers each. `shift` is added
  /// to the diagonal, or is null. Returns false if a pivot is zero or not finite.
  bool (*factorize)(const BandLuFactor& factor, const double* values, const double* shift);
  void (*solve)(const BandLuFactor& factor, double* x);
  void (*solve_transposed)(const BandLuFactor& factor, double* x);
};

const BandLuKernels& band_lu_kernels();

}  // namespace withe
