#pragma once
/// The arithmetic of the band LDL^T, without comparisons, so that Scalar may be a pack of simulations.
///
/// Column j of L occupies `stride` numbers from factor + j * stride: first the pivot d_j, then l(j+1, j) ...
/// l(j+half_bandwidth, j), then zeros. `half_bandwidth` columns of zeros must lie before column 0, so that the
/// first columns need no special case. Left-looking: column k is complete in registers before it is stored,
///   u(i, k) = a(i, k) - sum_{m=1..half_bandwidth} l(i, k-m) d(k-m) l(k, k-m),   l(i, k) = u(i, k) / d(k).

#include <cstddef>

namespace withe::band_ldlt {

/// Numbers a column: the update of a column reads pairs, up to one number beyond its last.
constexpr int column_stride(int half_bandwidth) { return (half_bandwidth + 3) / 2 * 2; }

/// Half bandwidth and stride known to the compiler, or only when running.
template <int kHalfBandwidth>
struct FixedBand {
  static constexpr int half_bandwidth = kHalfBandwidth;
  static constexpr int stride = column_stride(kHalfBandwidth);
};
struct AnyBand {
  int half_bandwidth;
  int stride;
};

/// Factorises with the half bandwidth as a constant: every loop has a fixed trip count and unrolls.
template <int kHalfBandwidth, class Scalar>
void factorize(FixedBand<kHalfBandwidth>, int size, const Scalar* values, const Scalar* shift, Scalar* factor,
               Scalar* inverse_pivots) {
  constexpr int kStride = column_stride(kHalfBandwidth);
  for (int k = 0; k < size; ++k) {
    Scalar column[kStride];
    for (int i = 0; i < kStride; ++i) column[i] = values[i];
    if (shift) column[0] += shift[k];
#pragma GCC unroll 32
    for (int m = kHalfBandwidth; m >= 1; --m) {
      const Scalar* earlier = factor - static_cast<std::ptrdiff_t>(m) * kStride;
      const Scalar weight = earlier[m] * earlier[0];
      for (int i = 0; i < (kHalfBandwidth - m + 2) / 2 * 2; ++i) column[i] -= earlier[m + i] * weight;
    }
    const Scalar inverse = Scalar(1) / column[0];
    inverse_pivots[k] = inverse;
    factor[0] = column[0];
    for (int i = 1; i < kStride; ++i) factor[i] = column[i] * inverse;
    values += kStride;
    factor += kStride;
  }
}

template <class Scalar>
void factorize(AnyBand band, int size, const Scalar* values, const Scalar* shift, Scalar* factor,
               Scalar* inverse_pivots) {
  for (int k = 0; k < size; ++k) {
    for (int i = 0; i < band.stride; ++i) factor[i] = values[i];
    if (shift) factor[0] += shift[k];
    for (int m = band.half_bandwidth; m >= 1; --m) {
      const Scalar* __restrict earlier = factor - static_cast<std::ptrdiff_t>(m) * band.stride;
      Scalar* __restrict column = factor;
      const Scalar weight = earlier[m] * earlier[0];
      for (int i = 0; i <= band.half_bandwidth - m; ++i) column[i] -= earlier[m + i] * weight;
    }
    const Scalar inverse = Scalar(1) / factor[0];
    inverse_pivots[k] = inverse;
    for (int i = 1; i <= band.half_bandwidth; ++i) factor[i] *= inverse;
    values += band.stride;
    factor += band.stride;
  }
}

/// Solves L D L^T x = b in place. Each sum ends with the newest unknown, so that only its term waits.
template <class Band, class Scalar>
void solve(Band band, int size, const Scalar* factor, const Scalar* inverse_pivots, Scalar* x) {
  const int edge = size < band.half_bandwidth ? size : band.half_bandwidth;
  const std::ptrdiff_t stride = band.stride;
  for (int k = 0; k < edge; ++k) {
    for (int m = k; m >= 1; --m) x[k] -= factor[(k - m) * stride + m] * x[k - m];
  }
  for (int k = edge; k < size; ++k) {
    const Scalar* newest = factor + k * stride;
    Scalar sum = x[k];
#pragma GCC unroll 32
    for (int m = band.half_bandwidth; m >= 1; --m) sum -= newest[m - m * stride] * x[k - m];
    x[k] = sum;
  }
  for (int k = size - 1; k >= size - edge; --k) {
    Scalar sum = x[k] * inverse_pivots[k];
    for (int m = size - 1 - k; m >= 1; --m) sum -= factor[k * stride + m] * x[k + m];
    x[k] = sum;
  }
  for (int k = size - 1 - edge; k >= 0; --k) {
    const Scalar* column = factor + k * stride;
    Scalar sum = x[k] * inverse_pivots[k];
#pragma GCC unroll 32
    for (int m = band.half_bandwidth; m >= 1; --m) sum -= column[m] * x[k + m];
    x[k] = sum;
  }
}

}  // namespace withe::band_ldlt
