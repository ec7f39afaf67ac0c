// The kernels of front_kernels.hpp on packs; included once by the translation unit of each instruction set.

#include "common/pack.hpp"
#include "solvers/front_kernels.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

static_assert(kFrontPadding == 4 && kFrontPadding % kLanes == 0);

/// Updates `packs` packs of an eliminated column: subtracts the products with earlier columns, then scales.
template <int packs>
void finish_rows(const Front& a, const Front& other, int column, int row, double inverse) {
  double* own = a.factor + std::ptrdiff_t{a.length} * column + row;
  Pack sum[packs];
  for (int p = 0; p < packs; ++p) sum[p] = load(own + p * kLanes);
  const double* earlier = a.factor + row;
  const double* weight = other.scratch + column;
  for (int j = 0; j < column; ++j, earlier += a.length, weight += a.length) {
    const Pack w = *weight;
    for (int p = 0; p < packs; ++p) sum[p] -= load(earlier + p * kLanes) * w;
  }
  double* unscaled = a.scratch + std::ptrdiff_t{a.length} * column + row;
  const Pack scale = inverse;
  for (int p = 0; p < packs; ++p) {
    store(unscaled + p * kLanes, sum[p]);
    store(own + p * kLanes, sum[p] * scale);
  }
}

void finish_column(const Front& a, const Front& other, int column, double inverse) {
  int row = column / kLanes * kLanes;
  for (; row + 4 * kLanes <= a.length; row += 4 * kLanes) finish_rows<4>(a, other, column, row, inverse);
  for (; row < a.length; row += kLanes) finish_rows<1>(a, other, column, row, inverse);
}

/// Columns of L and W from left to right.
void eliminate_columns(const Front& lower, const Front& upper) {
  for (int c = 0; c < lower.columns; ++c) {
    double* own = lower.factor + std::ptrdiff_t{lower.length} * c;
    double pivot = own[c];
    for (int j = 0; j < c; ++j) {
      const std::ptrdiff_t place = std::ptrdiff_t{lower.length} * j + c;
      pivot -= lower.factor[place] * upper.scratch[place];
    }
    const double inverse = 1.0 / pivot;
    lower.inverse_pivots[c] = inverse;
    finish_column(lower, upper, c, inverse);
    if (&upper != &lower) finish_column(upper, lower, c, inverse);
    own[c] = pivot;
  }
}

/// Subtracts the products of all eliminated columns from a block of `rest`.
template <int columns, int packs>
void update_block(const Front& a, const Front& other, int column, int row) {
  double* place = a.rest + std::ptrdiff_t{a.rest_length} * column + row;
  Pack sum[columns][packs];
  for (int c = 0; c < columns; ++c)
    for (int p = 0; p < packs; ++p) sum[c][p] = load(place + std::ptrdiff_t{a.rest_length} * c + p * kLanes);
  const double* left = a.factor + a.columns + row;
  const double* weight = other.scratch + a.columns + column;
  for (int j = 0; j < a.columns; ++j, left += a.length, weight += a.length) {
    Pack l[packs];
    for (int p = 0; p < packs; ++p) l[p] = load(left + p * kLanes);
    for (int c = 0; c < columns; ++c) {
      const Pack w = weight[c];
      for (int p = 0; p < packs; ++p) sum[c][p] -= l[p] * w;
    }
  }
  for (int c = 0; c < columns; ++c)
    for (int p = 0; p < packs; ++p) store(place + std::ptrdiff_t{a.rest_length} * c + p * kLanes, sum[c][p]);
}

template <int columns>
void update_columns(const Front& a, const Front& other, int column) {
  int row = column / kLanes * kLanes;
  for (; row + 2 * kLanes <= a.rest_length; row += 2 * kLanes) update_block<columns, 2>(a, other, column, row);
  for (; row < a.rest_length; row += kLanes) update_block<columns, 1>(a, other, column, row);
}

void update_rest(const Front& a, const Front& other) {
  const int rest = a.rows - a.columns;
  int column = 0;
  for (; column + 4 <= rest; column += 4) update_columns<4>(a, other, column);
  for (; column < rest; ++column) update_columns<1>(a, other, column);
}

void eliminate(const Front& lower, const Front& upper) {
  eliminate_columns(lower, upper);
  update_rest(lower, upper);
  if (&upper != &lower) update_rest(upper, lower);
}

void solve_down(const Front& a, double* x, const int* rows, double* all) {
  for (int c = 0; c < a.columns; ++c) {
    const double* own = a.factor + std::ptrdiff_t{a.length} * c;
    for (int i = c + 1; i < a.columns; ++i) x[i] -= own[i] * x[c];
  }
  const int rest = a.rows - a.columns;
  for (int row = 0; row < rest; row += kLanes) {
    const double* own = a.factor + a.columns + row;
    Pack taken[2] = {0.0, 0.0};
    int c = 0;
    for (; c + 2 <= a.columns; c += 2, own += 2 * std::ptrdiff_t{a.length}) {
      taken[0] += load(own) * Pack(x[c]);
      taken[1] += load(own + a.length) * Pack(x[c + 1]);
    }
    if (c < a.columns) taken[0] += load(own) * Pack(x[c]);
    const Pack sum = taken[0] + taken[1];
    for (int l = 0; l < kLanes && row + l < rest; ++l) all[rows[row + l]] -= sum[l];
  }
}

/// Subtracts the products with later rows from `columns` columns up to `end`: one by one up to `row`, then in packs.
template <int columns>
void take_known(const Front& a, int end, int row, double* x) {
  const int first = end - columns;
  const double* own = a.factor + std::ptrdiff_t{a.length} * first;
  Pack taken[columns];
  for (int c = 0; c < columns; ++c) taken[c] = 0.0;
  for (int r = row; r < a.length; r += kLanes) {
    const Pack known = load(x + r);
    for (int c = 0; c < columns; ++c) taken[c] += load(own + std::ptrdiff_t{a.length} * c + r) * known;
  }
  double value[columns];
  for (int c = columns - 1; c >= 0; --c) {
    const double* entry = own + std::ptrdiff_t{a.length} * c;
    value[c] = x[first + c] - sum(taken[c]);
    for (int r = end; r < row && r < a.rows; ++r) value[c] -= entry[r] * x[r];
    for (int i = c + 1; i < columns; ++i) value[c] -= entry[first + i] * value[i];
  }
  for (int c = 0; c < columns; ++c) x[first + c] = value[c];
}

void solve_up(const Front& a, double* x, const int* rows, const double* all) {
  double* known = a.scratch;
  for (int c = 0; c < a.columns; ++c) known[c] = x[c] * a.inverse_pivots[c];
  for (int row = a.columns; row < a.rows; ++row) known[row] = all[rows[row - a.columns]];
  for (int row = a.rows; row < a.length; ++row) known[row] = 0.0;
  const int last = a.columns % kFrontPadding;
  int end = a.columns - last;
  if (last == 1) take_known<1>(a, a.columns, end + kFrontPadding, known);
  if (last == 2) take_known<2>(a, a.columns, end + kFrontPadding, known);
  if (last == 3) take_known<3>(a, a.columns, end + kFrontPadding, known);
  for (; end > 0; end -= kFrontPadding) take_known<kFrontPadding>(a, end, end, known);
  for (int c = 0; c < a.columns; ++c) x[c] = known[c];
}

}  // namespace

extern const FrontKernels kFrontKernels;
const FrontKernels kFrontKernels{&eliminate, &solve_down, &solve_up};

}  // namespace withe::WITHE_INSTRUCTION_SET
