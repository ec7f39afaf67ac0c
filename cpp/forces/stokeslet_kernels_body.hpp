// The kernels of stokeslet_kernels.hpp on packs; included once by the translation unit of each instruction set.

#include "common/pack.hpp"
#include "forces/stokeslet_kernels.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

static_assert(kLineUnit % kLanes == 0);

/// The factors of f, p p, p e + e p and e e in the velocity that a unit force at one end of a segment gives.
struct Factors {
  Pack one, pp, pe, ee;
};

/// alpha 1 + beta p p + gamma (p e + e p) + delta e e, entry by entry.
void store_block(const Factors& f, const Pack (&p)[3], const Pack (&e)[3], double* out, std::ptrdiff_t row) {
  int entry = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j, ++entry) {
      Pack value = f.pp * (p[i] * p[j]) + f.pe * (p[i] * e[j] + e[i] * p[j]) + f.ee * (e[i] * e[j]);
      if (i == j) value += f.one;
      store(out + entry * row, value);
    }
}

[[gnu::flatten]] void velocity(const SegmentBatch& batch, const double* x, double regularization, double* of_start,
                               double* of_end) {
  const Pack epsilon2 = regularization * regularization;
  for (std::ptrdiff_t s = 0; s < batch.count; s += kLanes) {
    Pack e[3], p[3];
    for (int i = 0; i < 3; ++i) {
      e[i] = load(batch.direction[i] + s);
      p[i] = Pack(x[i]) - load(batch.start[i] + s);
    }
    const Pack length = load(batch.length + s), inverse_length = load(batch.inverse_length + s);
    const Pack w0 = p[0] * e[0] + p[1] * e[1] + p[2] * e[2], w1 = w0 - length;
    for (int i = 0; i < 3; ++i) p[i] -= w0 * e[i];
    const Pack d2 = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + epsilon2;
    const Pack r0 = square_root(w0 * w0 + d2), r1 = square_root(w1 * w1 + d2);
    const Pack inverse = Pack(1.0) / (r0 * r1 * d2);  // one division for three
    const Pack inverse_r0 = r1 * d2 * inverse, inverse_r1 = r0 * d2 * inverse, inverse_d2 = r0 * r1 * inverse;
    const Pack j0 = Pack(2.0) * inverse_tanh(length / (r0 + r1)), j1 = r0 - r1;
    const Pack along = w0 * inverse_r0 - w1 * inverse_r1;
    const Pack k0 = along * inverse_d2, k1 = inverse_r1 - inverse_r0, k2 = j0 - along, k3 = j1 - d2 * k1;
    // w = w0 - s: the end's share of the force is (w0 - w) / L, the start's (w - w1) / L.
    const Pack a = w0 * inverse_length, b = w1 * inverse_length;
    const Factors end{(a * j0 - inverse_length * j1) + epsilon2 * (a * k0 - inverse_length * k1),
                      a * k0 - inverse_length * k1, a * k1 - inverse_length * k2, a * k2 - inverse_length * k3};
    const Factors start{(inverse_length * j1 - b * j0) + epsilon2 * (inverse_length * k1 - b * k0),
                        inverse_length * k1 - b * k0, inverse_length * k2 - b * k1, inverse_length * k3 - b * k2};
    store_block(start, p, e, of_start + s, batch.count);
    store_block(end, p, e, of_end + s, batch.count);
  }
}

/// Three components of a block times a vector.
struct Product {
  Pack x, y, z;
};
Product product(const Pack (&a)[kBlockEntries], Pack x, Pack y, Pack z) {
  return {a[0] * x + a[1] * y + a[2] * z, a[1] * x + a[3] * y + a[4] * z, a[2] * x + a[4] * y + a[5] * z};
}

[[gnu::flatten]] void multiply(const BlockMatrix& matrix, const double* x, double* y) {
  const std::ptrdiff_t line = matrix.line;
  for (std::ptrdiff_t j = 0; j < line; j += kLanes) {
    Pack a[kBlockEntries];
    for (int k = 0; k < kBlockEntries; ++k) a[k] = load(matrix.diagonal + k * line + j);
    const Product own = product(a, load(x + j), load(x + line + j), load(x + 2 * line + j));
    store(y + j, own.x), store(y + line + j, own.y), store(y + 2 * line + j, own.z);
  }
  const double* row = matrix.lower;
  for (std::ptrdiff_t i = 0; i < matrix.size; ++i) {
    const std::ptrdiff_t length = line_length(i);
    const Pack xi = x[i], yi = x[line + i], zi = x[2 * line + i];
    Product total{0.0, 0.0, 0.0};
    for (std::ptrdiff_t j = 0; j < length; j += kLanes) {
      Pack a[kBlockEntries];
      for (int k = 0; k < kBlockEntries; ++k) a[k] = load(row + k * length + j);
      const Product left = product(a, load(x + j), load(x + line + j), load(x + 2 * line + j));
      total.x += left.x, total.y += left.y, total.z += left.z;
      const Product below = product(a, xi, yi, zi);
      store(y + j, load(y + j) + below.x);
      store(y + line + j, load(y + line + j) + below.y);
      store(y + 2 * line + j, load(y + 2 * line + j) + below.z);
    }
    y[i] += sum(total.x), y[line + i] += sum(total.y), y[2 * line + i] += sum(total.z);
    row += kBlockEntries * length;
  }
}

}  // namespace

extern const StokesletKernels kStokesletKernels;
const StokesletKernels kStokesletKernels{velocity, multiply};

}  // namespace withe::WITHE_INSTRUCTION_SET
