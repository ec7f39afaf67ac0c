// The kernels of front_kernels.hpp on packs; included once by the translation unit of each instruction set.

#include "common/pack.hpp"
#include "solvers/front_kernels.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

static_assert(kFrontPadding == 4 && kFrontPadding % kLanes == 0);

/// Updates `packs` packs of a column of a panel: subtracts the products with its earlier columns, then scales.
template <int packs>
void finish_block(const Front& a, const Front& other, int first, int column, int row, double inverse) {
  double* own = a.factor + std::ptrdiff_t{a.length} * column + row;
  Pack sum[packs];
  for (int p = 0; p < packs; ++p) sum[p] = load(own + p * kLanes);
  const double* earlier = a.factor + std::ptrdiff_t{a.length} * first + row;
  const double* weight = other.scratch + std::ptrdiff_t{a.length} * first + column;
  for (int j = first; j < column; ++j, earlier += a.length, weight += a.length) {
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

void finish_column(const Front& a, const Front& other, int first, int column, int row, int end_row) {
  const double inverse = a.inverse_pivots[column];
  for (; row + 4 * kLanes <= end_row; row += 4 * kLanes) finish_block<4>(a, other, first, column, row, inverse);
  for (; row < end_row; row += kLanes) finish_block<1>(a, other, first, column, row, inverse);
}

/// Row up to which the own rows of a panel are computed: packs may reach past its end.
int end_of_own_rows(Panel panel) { return (panel.end + kFrontPadding - 1) / kFrontPadding * kFrontPadding; }

/// Columns of L and W from left to right, down to `end_row`.
void eliminate_columns(const Front& lower, const Front& upper, Panel panel, int end_row) {
  for (int c = panel.first; c < panel.end; ++c) {
    double* own = lower.factor + std::ptrdiff_t{lower.length} * c;
    double pivot = own[c];
    for (int j = panel.first; j < c; ++j) {
      const std::ptrdiff_t place = std::ptrdiff_t{lower.length} * j + c;
      pivot -= lower.factor[place] * upper.scratch[place];
    }
    lower.inverse_pivots[c] = 1.0 / pivot;
    const int row = c / kLanes * kLanes;
    finish_column(lower, upper, panel.first, c, row, end_row);
    if (&upper != &lower) finish_column(upper, lower, panel.first, c, row, end_row);
    own[c] = pivot;
  }
}

void eliminate_panel(const Front& lower, const Front& upper, Panel panel) {
  eliminate_columns(lower, upper, panel, end_of_own_rows(panel));
}

void finish_rows(const Front& a, const Front& other, Panel panel, int row, int end_row) {
  for (int c = panel.first; c < panel.end; ++c) finish_column(a, other, panel.first, c, row, end_row);
}

/// Subtracts products of columns from a block of a matrix: `left` has the columns in the rows of the block, `weight` in
/// its columns.
template <int columns, int packs>
void update_block(double* place, int length, const double* left, const double* weight, int count, int step) {
  Pack sum[columns][packs];
  for (int c = 0; c < columns; ++c)
    for (int p = 0; p < packs; ++p) sum[c][p] = load(place + std::ptrdiff_t{length} * c + p * kLanes);
  for (int j = 0; j < count; ++j, left += step, weight += step) {
    Pack l[packs];
    for (int p = 0; p < packs; ++p) l[p] = load(left + p * kLanes);
    for (int c = 0; c < columns; ++c) {
      const Pack w = weight[c];
      for (int p = 0; p < packs; ++p) sum[c][p] -= l[p] * w;
    }
  }
  for (int c = 0; c < columns; ++c)
    for (int p = 0; p < packs; ++p) store(place + std::ptrdiff_t{length} * c + p * kLanes, sum[c][p]);
}

/// Columns of a front that are stored together: `columns` of `length`, from row `offset` of the front on.
struct Stored {
  double* columns;
  int length, offset;
};

template <int columns>
void update_columns(const Front& a, const Front& other, Panel panel, Stored to, int column) {
  const std::ptrdiff_t before = std::ptrdiff_t{a.length} * panel.first + to.offset;
  const double *left = a.factor + before, *weight = other.scratch + before + column;
  double* place = to.columns + std::ptrdiff_t{to.length} * column;
  const int count = panel.end - panel.first;
  int row = column / kLanes * kLanes;
  for (; row + 2 * kLanes <= to.length; row += 2 * kLanes)
    update_block<columns, 2>(place + row, to.length, left + row, weight, count, a.length);
  for (; row < to.length; row += kLanes)
    update_block<columns, 1>(place + row, to.length, left + row, weight, count, a.length);
}

void update_stored(const Front& a, const Front& other, Panel panel, Stored to, int column, int end) {
  for (; column + 4 <= end; column += 4) update_columns<4>(a, other, panel, to, column);
  for (; column < end; ++column) update_columns<1>(a, other, panel, to, column);
}

void update(const Front& a, const Front& other, Panel panel, int column, int end_column) {
  const int end_own = end_column < a.columns ? end_column : a.columns;
  update_stored(a, other, panel, {a.factor, a.length, 0}, column, end_own);
  const int first = column > a.columns ? column - a.columns : 0;
  update_stored(a, other, panel, {a.rest, a.rest_length, a.columns}, first, end_column - a.columns);
}

void eliminate(const Front& lower, const Front& upper) {
  for (int first = 0; first < lower.columns; first += kPanelColumns) {
    const int end = first + kPanelColumns < lower.columns ? first + kPanelColumns : lower.columns;
    const Panel panel{first, end};
    eliminate_columns(lower, upper, panel, lower.length);
    update(lower, upper, panel, end, lower.rows);
    if (&upper != &lower) update(upper, lower, panel, end, lower.rows);
  }
}

/// Subtracts the products of columns [first, end) with x from the rows [row, end_row) by `take(row, lane count, sums)`.
template <class Take>
void subtract_products(const Front& a, const double* x, Panel panel, int row, int end_row, const Take& take) {
  for (; row < end_row; row += kLanes) {
    const double* own = a.factor + std::ptrdiff_t{a.length} * panel.first + row;
    Pack taken[2] = {0.0, 0.0};
    int c = panel.first;
    for (; c + 2 <= panel.end; c += 2, own += 2 * std::ptrdiff_t{a.length}) {
      taken[0] += load(own) * Pack(x[c]);
      taken[1] += load(own + a.length) * Pack(x[c + 1]);
    }
    if (c < panel.end) taken[0] += load(own) * Pack(x[c]);
    const Pack sum = taken[0] + taken[1];
    for (int l = 0; l < kLanes && row + l < end_row; ++l) take(row + l, sum[l]);
  }
}

void solve_down(const Front& a, double* x, const int* rows, double* all) {
  for (int first = 0; first < a.columns; first += kPanelColumns) {
    const int end = first + kPanelColumns < a.columns ? first + kPanelColumns : a.columns;
    for (int c = first; c < end; ++c) {
      const double* own = a.factor + std::ptrdiff_t{a.length} * c;
      for (int i = c + 1; i < end; ++i) x[i] -= own[i] * x[c];
    }
    const Panel panel{first, end};
    subtract_products(a, x, panel, end, a.columns, [&](int row, double sum) { x[row] -= sum; });
    subtract_products(a, x, panel, a.columns, a.rows, [&](int row, double sum) { all[rows[row - a.columns]] -= sum; });
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
const FrontKernels kFrontKernels{&eliminate, &eliminate_panel, &finish_rows, &update, &solve_down, &solve_up};

}  // namespace withe::WITHE_INSTRUCTION_SET
