#pragma once
/// The arithmetic of band factorisations without exchanges, for the instruction set in use: A = L U, with a unit
/// diagonal of U, row by row [Crout's order; Golub and Van Loan 2013, sec. 3.2.9]. For a symmetric matrix L^T = D U,
/// which halves the work. Raw pointers only: the kernels behind share no code with the rest.
///
/// A row is complete in registers before it is stored. Rows lie `stride` numbers apart, with column 0 of row 0 at the
/// pointer. Packs of columns therefore begin at multiples of their length in every row, and each is read as it was last
/// written. A read across two packs that are still on their way to memory would wait for both.

#include <cstddef>

#include "common/instruction_set.hpp"

namespace withe {

/// Packs of the widest instruction set.
constexpr int kBandPadding = 4;
constexpr int band_padded(int count) { return (count + kBandPadding - 1) / kBandPadding * kBandPadding; }
/// From one row to the next in the same column: a row of U or of L, from a multiple of kBandPadding to another.
constexpr int band_stride(int half_bandwidth) { return band_padded(half_bandwidth + kBandPadding); }

/// `half_bandwidth` rows, and as many numbers and kBandPadding of `scale` and `reach`, lie before row 0 and after the
/// last: zeros, so that the first and last rows need no special case.
struct BandFactor {
  int size = 0;
  double* upper = nullptr;           ///< U beyond its diagonal
  double* lower = nullptr;           ///< L beyond its diagonal; of a symmetric matrix L^T = D U with it, by rows
  double* inverse_pivots = nullptr;  ///< inverse of the diagonal of L
  double* scale = nullptr;           ///< 1 / sqrt |a_ii|: units in which the diagonal is one
  double* reach = nullptr;           ///< sum of |u_ij| scale_j over a row of U
};

struct BandKernels {
  int half_bandwidth;
  /// Factorises a matrix. `values` has the rows of the band one after another, each of 2 w + 1 numbers for the half
  /// bandwidth w, with kBandPadding numbers before and after them. `shift` is added to the diagonal, or is null.
  /// Returns false if | L | | U | exceeds kGreatestGrowth, in units in which the diagonal of A is one. This product
  /// bounds the errors of the factors [Higham 2002, thm 9.3].
  bool (*factorize)(const BandFactor& factor, const double* values, const double* shift);
  /// The same for a symmetric matrix. `values` has the columns of the lower triangle, band_column_stride(w) numbers
  /// each.
  void (*factorize_symmetric)(const BandFactor& factor, const double* values, const double* shift);
  void (*solve)(const BandFactor& factor, double* x);
  void (*solve_transposed)(const BandFactor& factor, double* x);
  void (*solve_symmetric)(const BandFactor& factor, double* x);
};

/// Number of stored values per column of a symmetric matrix.
constexpr int band_column_stride(int half_bandwidth) { return (half_bandwidth + 3) / 2 * 2; }

/// Greatest growth of the factors: above it, their rounding would cost more than two digits.
constexpr double kGreatestGrowth = 100.0;

/// Kernels of the narrowest band that contains this one: 5 (a rod in a plane), 10 (in space), 16, 24. Null for a wider
/// band.
const BandKernels* band_kernels(int half_bandwidth);

}  // namespace withe
