// The kernels of band_lu_kernels.hpp on packs; included once by the translation unit of each instruction set.

#include "common/pack.hpp"
#include "solvers/band_lu_kernels.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

static_assert(kBandPadding % kLanes == 0);

/// Threshold of pivoting. The diagonal remains the pivot if its magnitude is at least this share of the greatest in its
/// column, since exchanges widen the band [Duff, Erisman and Reid 2017, sec. 5.2]. Entries are measured relative to the
/// greatest of their row, so that pivots do not depend on units [Golub and Van Loan 2013, sec. 3.5.2].
constexpr double kPivotThreshold = 0.1;

double magnitude(double a) { return __builtin_fabs(a); }
bool is_usable(double pivot) { return pivot != 0.0 && pivot * 0.0 == 0.0; }
int smaller(int a, int b) { return a < b ? a : b; }
int padded(int count) { return (count + kLanes - 1) / kLanes * kLanes; }

double* entry(const BandLuFactor& a, int row, int column) {
  return a.work + static_cast<std::ptrdiff_t>(row) * a.work_stride + column;
}
double* multipliers_of(const BandLuFactor& a, int column) {
  return a.multipliers + static_cast<std::ptrdiff_t>(column) * a.multiplier_stride;
}

double greater(double a, double b) { return b <= a ? a : b; }

void load_row(const BandLuFactor& a, int row, const double* values, const double* shift) {
  const double* value = values + static_cast<std::ptrdiff_t>(row) * a.value_stride;
  double* work = entry(a, row, row - a.width);
  for (int i = -kBandPadding; i < 0; ++i) work[i] = 0.0;
  double greatest = 0.0;
  for (int i = 0; i < a.value_stride; ++i) {
    work[i] = value[i];
    greatest = greater(greatest, magnitude(value[i]));
  }
  a.row_scales[row] = greatest > 0.0 ? 1.0 / greatest : 1.0;
  for (int i = a.value_stride; i <= a.work_stride - kBandPadding; ++i) work[i] = 0.0;
  if (shift) work[a.width] += shift[row];
}

int find_pivot(const BandLuFactor& a, int column, int last_row) {
  const auto measure = [&](int row) { return magnitude(entry(a, row, column)[0]) * a.row_scales[row]; };
  int best = column;
  double most = measure(column);
  const double own = most;
  for (int row = column + 1; row <= last_row; ++row) {
    const double other = measure(row);
    if (!(other <= most)) {  // an entry that is not finite becomes the pivot, so that it is reported
      most = other;
      best = row;
    }
  }
  return own >= kPivotThreshold * most ? column : best;
}

void exchange(double* a, double* b, int count) {
  for (int i = 0; i < count; ++i) {
    const double kept = a[i];
    a[i] = b[i];
    b[i] = kept;
  }
}

/// Subtracts multiples of row j from the rows below: `packs` packs from column `first` on, or `count` columns if
/// `packs` is 0. In the first pack, columns up to j are never read again.
template <int packs>
void eliminate(const BandLuFactor& a, int j, int last_row, int first, int count, double inverse) {
  const double* pivot_row = entry(a, j, first);
  double* multiplier = multipliers_of(a, j);
  double* target = entry(a, j + 1, first);
  const int pivot = j - first;
  Pack kept[packs > 0 ? packs : 1];
  for (int p = 0; p < packs; ++p) kept[p] = load(pivot_row + p * kLanes);
  for (int row = j + 1; row <= last_row; ++row, target += a.work_stride) {
    const double factor = target[pivot] * inverse;
    *multiplier++ = factor;
    const Pack f = factor;
    if constexpr (packs > 0)
      for (int p = 0; p < packs; ++p) store(target + p * kLanes, load(target + p * kLanes) - f * kept[p]);
    else
      for (int c = 0; c < count; c += kLanes) store(target + c, load(target + c) - f * load(pivot_row + c));
  }
}

/// Packs begin at multiples of their length, so that each is read with the boundaries with which it was last written. A
/// read across two packs that are not yet in memory would wait for both.
void eliminate(const BandLuFactor& a, int j, int last_row, int last_column, double inverse) {
  const int first = (j + 1) / kLanes * kLanes, count = last_column + 1 - first;
  switch (padded(count) / kLanes) {
    case 1:
      return eliminate<1>(a, j, last_row, first, count, inverse);
    case 2:
      return eliminate<2>(a, j, last_row, first, count, inverse);
    case 3:
      return eliminate<3>(a, j, last_row, first, count, inverse);
    case 4:
      return eliminate<4>(a, j, last_row, first, count, inverse);
    case 5:
      return eliminate<5>(a, j, last_row, first, count, inverse);
    default:
      return eliminate<0>(a, j, last_row, first, count, inverse);
  }
}

bool factorize(const BandLuFactor& a, const double* values, const double* shift) {
  for (int row = 0; row < smaller(a.width, a.size); ++row) load_row(a, row, values, shift);
  int last_column = 0;
  for (int j = 0; j < a.size; ++j) {
    const int last_row = smaller(j + a.width, a.size - 1);
    if (j + a.width < a.size) load_row(a, j + a.width, values, shift);
    const int pivot_row = find_pivot(a, j, last_row);
    const int reached = smaller(pivot_row + a.width, a.size - 1);
    if (reached > last_column) last_column = reached;
    if (pivot_row != j) {
      exchange(entry(a, j, j), entry(a, pivot_row, j), last_column - j + 1);
      exchange(a.row_scales + j, a.row_scales + pivot_row, 1);
    }
    const double pivot = entry(a, j, j)[0];
    if (!is_usable(pivot)) return false;
    a.pivot_rows[j] = pivot_row;
    a.last_columns[j] = last_column;
    const double inverse = 1.0 / pivot;
    a.inverse_pivots[j] = inverse;
    eliminate(a, j, last_row, last_column, inverse);
  }
  return true;
}

/// Subtracts `factor` times `count` numbers from as many elements of x, which has `room` elements. The numbers are
/// padded with zeros.
void take_off(const double* numbers, int count, double factor, double* x, int room) {
  const int all = padded(count);
  if (all <= room) {
    const Pack f = factor;
    for (int i = 0; i < all; i += kLanes) store(x + i, load(x + i) - load(numbers + i) * f);
  } else {
    for (int i = 0; i < count; ++i) x[i] -= numbers[i] * factor;
  }
}

/// `start` minus the products of `count` numbers. The sum ends with the first number, which belongs to the newest
/// unknown, so that only this term waits. `known`: the count as a constant, or 0.
template <int known>
double less_products(double start, const double* numbers, const double* x, int count) {
  double sum = start;
#pragma GCC unroll 16
  for (int i = (known > 0 ? known : count) - 1; i >= 0; --i) sum -= numbers[i] * x[i];
  return sum;
}
double less_products(double start, const double* numbers, const double* x, int count) {
  if (count == 10) return less_products<10>(start, numbers, x, count);  // the band of a rod in space
  if (count == 5) return less_products<5>(start, numbers, x, count);    // and in a plane
  return less_products<0>(start, numbers, x, count);
}

void exchange_unknowns(const BandLuFactor& a, int j, double* x) {
  if (a.pivot_rows[j] != j) exchange(x + j, x + a.pivot_rows[j], 1);
}

void solve(const BandLuFactor& a, double* x) {
  for (int j = 0; j < a.size; ++j) {
    exchange_unknowns(a, j, x);
    const int room = a.size - 1 - j;
    take_off(multipliers_of(a, j), smaller(a.width, room), x[j], x + j + 1, room);
  }
  for (int j = a.size - 1; j >= 0; --j)
    x[j] = less_products(x[j], entry(a, j, j) + 1, x + j + 1, a.last_columns[j] - j) * a.inverse_pivots[j];
}

void solve_transposed(const BandLuFactor& a, double* x) {
  for (int j = 0; j < a.size; ++j) {
    x[j] *= a.inverse_pivots[j];
    take_off(entry(a, j, j) + 1, a.last_columns[j] - j, x[j], x + j + 1, a.size - 1 - j);
  }
  for (int j = a.size - 1; j >= 0; --j) {
    x[j] = less_products(x[j], multipliers_of(a, j), x + j + 1, smaller(a.width, a.size - 1 - j));
    exchange_unknowns(a, j, x);
  }
}

}  // namespace

extern const BandLuKernels kBandLuKernels;
const BandLuKernels kBandLuKernels{&factorize, &solve, &solve_transposed};

}  // namespace withe::WITHE_INSTRUCTION_SET
