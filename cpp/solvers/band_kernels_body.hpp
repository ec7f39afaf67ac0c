// The kernels of band_kernels.hpp on packs; included once by the translation unit of each instruction set.

#include "common/pack.hpp"
#include "solvers/band_kernels.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

static_assert(kBandPadding % kLanes == 0);

/// The lanes from `from` up to `to` of a pack, zeros beside them.
Pack lanes_between(Pack a, int from, int to) {
  Pack::Integers mask;
  for (int l = 0; l < kLanes; ++l) mask[l] = l >= from && l < to ? -1 : 0;
  return from <= 0 && to >= kLanes ? a
                                   : Pack(reinterpret_cast<Pack::Native>(reinterpret_cast<Pack::Integers>(a.v) & mask));
}
template <int lane>
Pack everywhere(Pack a) {
  if constexpr (kLanes == 4)
    return Pack(__builtin_shufflevector(a.v, a.v, lane, lane, lane, lane));
  else
    return Pack(__builtin_shufflevector(a.v, a.v, lane, lane));
}
double magnitude(double a) { return __builtin_fabs(a); }

template <int number>
struct Number {
  static constexpr int value = number;
};
/// function(Number<first>()) ... function(Number<end - 1>()). A loop over packs would become a memcpy, which moves them
/// by halves.
template <int first, int end, class Function>
[[gnu::always_inline]] inline void each(const Function& function) {
  if constexpr (first < end) {
    function(Number<first>());
    each<first + 1, end>(function);
  }
}

/// Row i of a band of this half bandwidth, in packs of columns that begin at multiples of their length: column i -
/// width is `phase` lanes into the first.
template <int width, int phase>
struct Row {
  static constexpr int stride = band_stride(width);
  static constexpr int diagonal = phase + width;
  static constexpr int home = diagonal / kLanes, lane = diagonal % kLanes;  // place of the diagonal
  static constexpr int packs = (diagonal + width) / kLanes + 1;

  Pack at[packs];

  /// Place of the first column, less the phase.
  static int first_column(int i) { return i - width - phase; }
  /// Place of that column of row i, in another row.
  template <class Numbers>
  static Numbers* place(Numbers* rows, int row, int i) {
    return rows + static_cast<std::ptrdiff_t>(row) * stride + first_column(i);
  }
  /// Reads the packs from pack `begin` of a row of the matrix, and adds a shift. `value`: address of its first column.
  template <int begin>
  [[gnu::always_inline]] void read(const double* value, const double* shift, int i) {
    each<begin, packs>([&](auto p) { at[p.value] = load(value + p.value * kLanes); });
    at[packs - 1] = lanes_between(at[packs - 1], 0, diagonal + width + 1 - (packs - 1) * kLanes);
    if (shift) at[home] += lanes_between(Pack(shift[i]), lane, lane + 1);
  }
  /// Packs from the diagonal on that hold U, without it.
  Pack beyond_diagonal(int pack) const { return pack == home ? lanes_between(at[pack], lane + 1, kLanes) : at[pack]; }

  /// Subtracts multiples of the rows i - width ... i - 1 of U, one after another. The factor l_ik stays in its place.
  [[gnu::always_inline]] void reduce(const double* upper, int i) {
    const double* u = place(upper, i - width, i);
    each<0, width>([&](auto step) {
      constexpr int column = phase + step.value, first = column / kLanes, last = (column + width) / kLanes;
      const Pack factor = everywhere<column % kLanes>(at[first]);
      each<first, last + 1>([&](auto p) { at[p.value] -= factor * load(u + step.value * stride + p.value * kLanes); });
    });
  }

  /// The same from the diagonal on, with the entries above the diagonal in L^T.
  [[gnu::always_inline]] void reduce_symmetric(const double* upper, const double* lower, int i) {
    const double* u = place(upper, i - width, i);
    const double* l = place(lower, i - width, i) + diagonal;
    each<0, width>([&](auto step) {
      constexpr int last = (phase + step.value + width) / kLanes;
      const Pack factor = l[step.value * stride];
      each<home, last + 1>([&](auto p) { at[p.value] -= factor * load(u + step.value * stride + p.value * kLanes); });
    });
  }
};

/// Row i of L and of U; whether they have not grown.
template <int width, int phase>
[[gnu::always_inline]] inline bool factorize_row(const BandFactor& a, const double* values, const double* shift,
                                                 int i) {
  using R = Row<width, phase>;
  R row;
  row.template read<0>(values + static_cast<std::ptrdiff_t>(i) * (2 * width + 1) - phase, shift, i);
  row.reduce(a.upper, i);

  const Pack pivot = everywhere<R::lane>(row.at[R::home]), inverse = Pack(1.0) / pivot;
  a.inverse_pivots[i] = inverse[0];
  Pack reach = 0.0, growth = 0.0;
  each<R::home, R::packs>([&](auto p) {
    const Pack u = row.beyond_diagonal(p.value) * inverse;
    store(R::place(a.upper, i, i) + p.value * kLanes, u);
    reach += absolute(u) * load(a.scale + R::first_column(i) + p.value * kLanes);
  });
  each<0, R::home + 1>([&](auto p) {
    const Pack l = lanes_between(row.at[p.value], p.value == 0 ? phase : 0, p.value == R::home ? R::lane : kLanes);
    store(R::place(a.lower, i, i) + p.value * kLanes, l);
    growth += absolute(l) * load(a.reach + R::first_column(i) + p.value * kLanes);
  });
  a.reach[i] = a.scale[i] + sum(reach);
  return (sum(growth) + magnitude(pivot[0]) * a.reach[i]) * a.scale[i] <= kGreatestGrowth;
}

/// Row i of D U and of U.
template <int width, int phase>
[[gnu::always_inline]] inline void factorize_symmetric_row(const BandFactor& a, const double* values,
                                                           const double* shift, int i) {
  using R = Row<width, phase>;
  R row;
  const double* value = values + static_cast<std::ptrdiff_t>(i) * band_column_stride(width) - R::diagonal;
  row.template read<R::home>(value, shift, i);
  row.reduce_symmetric(a.upper, a.lower, i);

  const Pack inverse = Pack(1.0) / everywhere<R::lane>(row.at[R::home]);
  a.inverse_pivots[i] = inverse[0];
  each<R::home, R::packs>([&](auto p) {
    store(R::place(a.lower, i, i) + p.value * kLanes, row.at[p.value]);
    store(R::place(a.upper, i, i) + p.value * kLanes, row.beyond_diagonal(p.value) * inverse);
  });
}

/// function(phase, i) for every row, the phase known to the compiler.
template <int width, class Function>
[[gnu::always_inline]] inline void each_row(int size, const Function& function) {
  for (int first = 0; first < size; first += kLanes) {
    each<0, kLanes>([&](auto k) {
      constexpr int phase = ((k.value - width) % kLanes + kLanes) % kLanes;
      if (first + k.value < size) function(Number<phase>(), first + k.value);
    });
  }
}

template <int width>
bool factorize(const BandFactor& a, const double* values, const double* shift) {
  constexpr std::ptrdiff_t kStep = 2 * width + 1;
  for (int i = 0; i < a.size; i += kLanes) {
    const int last = a.size - 1;
    const Pack diagonal = from_lanes([&](int l) {
      const int row = i + l < last ? i + l : last;
      return values[row * kStep + width] + (shift ? shift[row] : 0.0);
    });
    const Pack scale = Pack(1.0) / square_root(absolute(diagonal));
    store(a.scale + i, lanes_between(scale, 0, a.size - i));
    store(a.reach + i, Pack(0.0));  // values of an earlier matrix may not be finite
  }
  bool within = true;
  each_row<width>(a.size, [&](auto phase, int i) { within &= factorize_row<width, phase.value>(a, values, shift, i); });
  return within;
}

template <int width>
void factorize_symmetric(const BandFactor& a, const double* values, const double* shift) {
  each_row<width>(a.size, [&](auto phase, int i) { factorize_symmetric_row<width, phase.value>(a, values, shift, i); });
}

/// x_i = finish(i, x_i - sum over m of entry(i, m) x_{i - m}). Each sum ends with the newest unknown, so that only its
/// term waits.
template <int width, class Entry, class Finish>
[[gnu::always_inline]] inline void sweep_down(int size, double* x, const Entry& entry, const Finish& finish) {
  const int edge = size < width ? size : width;
  for (int i = 0; i < edge; ++i) {
    double sum = x[i];
    for (int m = i; m >= 1; --m) sum -= entry(i, m) * x[i - m];
    x[i] = finish(i, sum);
  }
  for (int i = edge; i < size; ++i) {
    double sum = x[i];
#pragma GCC unroll 32
    for (int m = width; m >= 1; --m) sum -= entry(i, m) * x[i - m];
    x[i] = finish(i, sum);
  }
}

/// x_i = finish(i, start(i, x_i) - sum over m of entry(i, m) x_{i + m}).
template <int width, class Start, class Entry, class Finish>
[[gnu::always_inline]] inline void sweep_up(int size, double* x, const Start& start, const Entry& entry,
                                            const Finish& finish) {
  const int edge = size < width ? size : width;
  for (int i = size - 1; i >= size - edge; --i) {
    double sum = start(i, x[i]);
    for (int m = size - 1 - i; m >= 1; --m) sum -= entry(i, m) * x[i + m];
    x[i] = finish(i, sum);
  }
  for (int i = size - 1 - edge; i >= 0; --i) {
    double sum = start(i, x[i]);
#pragma GCC unroll 32
    for (int m = width; m >= 1; --m) sum -= entry(i, m) * x[i + m];
    x[i] = finish(i, sum);
  }
}

/// Steps of the sweeps.
template <int width>
struct Sweeps {
  static constexpr std::ptrdiff_t kStride = band_stride(width);
  const BandFactor& a;

  static double entry(const double* rows, int i, int column) { return rows[i * kStride + column]; }
  static double as_it_is(int, double x) { return x; }
  auto by_pivot() const {
    return [inverse = a.inverse_pivots](int i, double x) { return x * inverse[i]; };
  }
  auto to_the_left(const double* rows) const {
    return [rows](int i, int m) { return entry(rows, i, i - m); };
  }
  auto to_the_right(const double* rows) const {
    return [rows](int i, int m) { return entry(rows, i, i + m); };
  }
  auto above(const double* rows) const {
    return [rows](int i, int m) { return entry(rows, i - m, i); };
  }
  auto below(const double* rows) const {
    return [rows](int i, int m) { return entry(rows, i + m, i); };
  }
};

template <int width>
void solve(const BandFactor& a, double* x) {
  const Sweeps<width> s{a};
  sweep_down<width>(a.size, x, s.to_the_left(a.lower), s.by_pivot());
  sweep_up<width>(a.size, x, s.as_it_is, s.to_the_right(a.upper), s.as_it_is);
}

template <int width>
void solve_transposed(const BandFactor& a, double* x) {
  const Sweeps<width> s{a};
  sweep_down<width>(a.size, x, s.above(a.upper), s.as_it_is);
  sweep_up<width>(a.size, x, s.as_it_is, s.below(a.lower), s.by_pivot());
}

template <int width>
void solve_symmetric(const BandFactor& a, double* x) {
  const Sweeps<width> s{a};
  sweep_down<width>(a.size, x, s.above(a.upper), s.as_it_is);
  sweep_up<width>(a.size, x, s.by_pivot(), s.to_the_right(a.upper), s.as_it_is);
}

template <int width>
constexpr BandKernels kernels_of() noexcept {
  return {width,         &factorize<width>,        &factorize_symmetric<width>,
          &solve<width>, &solve_transposed<width>, &solve_symmetric<width>};
}

}  // namespace

extern const BandKernels kBandKernels[4];
constinit const BandKernels kBandKernels[4] = {kernels_of<5>(), kernels_of<10>(), kernels_of<16>(), kernels_of<24>()};

}  // namespace withe::WITHE_INSTRUCTION_SET
