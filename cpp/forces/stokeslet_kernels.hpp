#pragma once
/// Regularized Stokeslets on segments by the instruction set in use. Only raw pointers are used, since the kernels
/// share no code with the rest.
///
/// A force per length f on the segment from a to b, linear from f_a to f_b, moves the fluid at x by
///   8 pi mu u(x) = integral of [(1/R + eps^2 / R^3) f + (f . r) r / R^3] ds,  R^2 = r^2 + eps^2,  r = x - y(s)
/// [Cortez 2018, J. Comput. Phys. 375, eq. 3-4]. Let e be the segment's direction, and r = p + w e with p normal to e.
/// Then w runs from w0 = (x - a) . e down to w1 = w0 - L, and R^2 = w^2 + D^2 with D^2 = p^2 + eps^2. The integrals of
/// w^m / R^n are J for n = 1 and K for n = 3:
///   J0 = 2 atanh(L / (R0 + R1)),  J1 = R0 - R1,  K0 = (w0/R0 - w1/R1) / D^2,  K1 = 1/R1 - 1/R0,
///   K2 = J0 - D^2 K0,  K3 = J1 + D^2 (1/R0 - 1/R1).
/// The contributions of f_a and f_b follow from those of m and m + 1.

#include <cstddef>

#include "common/instruction_set.hpp"

namespace withe {

/// Entries of a symmetric 3 x 3 block: xx, xy, xz, yy, yz, zz.
constexpr int kBlockEntries = 6;
/// The length of a line of numbers is a multiple of this. Zeros fill its end.
constexpr std::ptrdiff_t kLineUnit = 4;
constexpr std::ptrdiff_t line_length(std::ptrdiff_t numbers) {
  return (numbers + kLineUnit - 1) / kLineUnit * kLineUnit;
}

/// Segments, each from its start along a unit vector; of length and direction zero: none. `count` is a multiple of
/// kLineUnit.
struct SegmentBatch {
  std::ptrdiff_t count;
  const double* start[3];
  const double* direction[3];
  const double* length;
  const double* inverse_length;  ///< 0 if there is no edge
};

/// A symmetric matrix of symmetric 3 x 3 blocks. Blocks left of the diagonal are stored line by line: kBlockEntries
/// rows of line_length(i) numbers for line i. Blocks on the diagonal are stored as kBlockEntries rows of `line`
/// numbers.
struct BlockMatrix {
  std::ptrdiff_t size;
  std::ptrdiff_t line;  ///< length of each component of a vector; x, y, z are stored one after another
  const double* lower;
  const double* diagonal;
};

struct StokesletKernels {
  /// Velocity times 8 pi mu at x of unit forces per length at each segment's start and end: kBlockEntries rows of
  /// `count` numbers each.
  void (*velocity)(const SegmentBatch&, const double* x, double regularization, double* of_start, double* of_end);
  /// y = A x.
  void (*multiply)(const BlockMatrix&, const double* x, double* y);
};

const StokesletKernels& stokeslet_kernels();

}  // namespace withe
