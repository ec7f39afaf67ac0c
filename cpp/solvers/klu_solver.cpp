#include "solvers/klu_solver.hpp"

#include <klu.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <vector>

#include "solvers/pattern_lookup.hpp"

namespace withe {
namespace {

/// Below this reciprocal pivot growth, min over columns of max|A| / max|U|, pivots off the diagonal are sought:
/// the backward error of the diagonal ones may reach 1e-16 / 1e-4.
constexpr double kSmallestPivotGrowth = 1e-4;

/// values(): column by column, in the order of the pattern.
///
/// Bit-exact restarts need factors that depend on the matrix alone, not on the pivot order of an earlier one. So
/// the constructor factorises the unit matrix on the full pattern, which fixes the order of the diagonal pivots;
/// factorize() reuses it (klu_refactor, no allocation), and where growth or a zero pivot forbids that, it pivots
/// anew (klu_factor, allocates) and forgets that order afterwards.
class KluSolver final : public LinearSolver {
 public:
  explicit KluSolver(const SparsityPattern& pattern)
      : pattern_(pattern),
        values_(pattern.row_indices.size() + kPadding, 0.0),
        shifted_(pattern.row_indices.size(), 0.0) {
    diagonal_.reserve(pattern.size);
    for (int i = 0; i < pattern.size; ++i) diagonal_.push_back(find_entry(pattern, i, i));
    klu_defaults(&common_);
    // A structurally symmetric matrix with a full diagonal has no block triangular form worth the search, and
    // the search could move the diagonal away.
    common_.btf = 0;
    try {
      symbolic_ = klu_analyze(pattern.size, starts(), rows(), &common_);
      if (!symbolic_) throw std::bad_alloc();
      for (std::ptrdiff_t place : diagonal_) shifted_[place] = 1.0;
      diagonal_factors_ = klu_factor(starts(), rows(), shifted_.data(), symbolic_, &common_);
      if (!diagonal_factors_) throw std::bad_alloc();
    } catch (...) {
      release();
      throw;
    }
  }
  KluSolver(const KluSolver&) = delete;
  KluSolver& operator=(const KluSolver&) = delete;
  ~KluSolver() override { release(); }

  int size() const override { return pattern_.size; }
  Symmetry symmetry() const override { return Symmetry::unsymmetric; }
  std::string name() const override { return "KLU"; }
  std::ptrdiff_t offset(int row, int column) const override { return find_entry(pattern_, row, column); }
  std::span<double> values() override { return {values_.data(), values_.size() - kPadding}; }
  std::span<const double> values() const override { return {values_.data(), values_.size() - kPadding}; }

  Factorization factorize(std::span<const double> shift) override {
    require_shift(shift, size());
    std::copy_n(values_.begin(), shifted_.size(), shifted_.begin());
    for (std::size_t i = 0; i < shift.size(); ++i) shifted_[diagonal_[i]] += shift[i];
    return factorize_shifted();
  }

  void solve(std::span<double> right_hand_side) const override {
    require_solvable(active_ != nullptr, right_hand_side, size());
    klu_solve(symbolic_, active_, size(), 1, right_hand_side.data(), &common_);
  }
  void solve_transposed(std::span<double> right_hand_side) const override {
    require_solvable(active_ != nullptr, right_hand_side, size());
    klu_tsolve(symbolic_, active_, size(), 1, right_hand_side.data(), &common_);
  }

  void multiply(std::span<const double> x, std::span<double> y) const override {
    require_product(x, y, size());
    std::fill(y.begin(), y.end(), 0.0);
    for (int column = 0; column < size(); ++column) {
      for (int p = pattern_.column_starts[column]; p < pattern_.column_starts[column + 1]; ++p) {
        y[pattern_.row_indices[p]] += values_[p] * x[column];
      }
    }
  }

  std::unique_ptr<LinearSolver> clone() const override {
    auto copy = std::make_unique<KluSolver>(pattern_);
    copy->values_ = values_;
    copy->shifted_ = shifted_;
    if (active_) copy->factorize_shifted();
    return copy;
  }

 private:
  // KLU takes what it only reads through pointers to non-const.
  int* starts() { return pattern_.column_starts.data(); }
  int* rows() { return pattern_.row_indices.data(); }

  Factorization factorize_shifted() {
    active_ = nullptr;
    if (pivoted_factors_) klu_free_numeric(&pivoted_factors_, &common_);
    // KLU looks at pivots only; a number that is not finite need not reach one.
    if (!std::all_of(shifted_.begin(), shifted_.end(), [](double value) { return std::isfinite(value); })) {
      return {FactorStatus::singular, 0};
    }
    if (klu_refactor(starts(), rows(), shifted_.data(), symbolic_, diagonal_factors_, &common_) &&
        common_.status == KLU_OK && pivots_are_usable(diagonal_factors_) &&
        klu_rgrowth(starts(), rows(), shifted_.data(), symbolic_, diagonal_factors_, &common_) &&
        common_.rgrowth >= kSmallestPivotGrowth) {
      active_ = diagonal_factors_;
      return {};
    }
    pivoted_factors_ = klu_factor(starts(), rows(), shifted_.data(), symbolic_, &common_);
    if (common_.status == KLU_OUT_OF_MEMORY) throw std::bad_alloc();
    if (!pivoted_factors_ || common_.status != KLU_OK || !pivots_are_usable(pivoted_factors_)) {
      return {FactorStatus::singular, 0};
    }
    active_ = pivoted_factors_;
    return {};
  }

  bool pivots_are_usable(const klu_numeric* factors) const {
    const double* pivots = static_cast<const double*>(factors->Udiag);
    return std::all_of(pivots, pivots + size(), is_usable_pivot);
  }

  void release() {
    klu_free_numeric(&pivoted_factors_, &common_);
    klu_free_numeric(&diagonal_factors_, &common_);
    klu_free_symbolic(&symbolic_, &common_);
  }

  SparsityPattern pattern_;
  std::vector<double> values_;
  std::vector<double> shifted_;
  std::vector<std::ptrdiff_t> diagonal_;
  mutable klu_common common_;
  klu_symbolic* symbolic_ = nullptr;
  klu_numeric* diagonal_factors_ = nullptr;
  klu_numeric* pivoted_factors_ = nullptr;
  klu_numeric* active_ = nullptr;  // the one of the two to solve with
};

}  // namespace

std::unique_ptr<LinearSolver> make_klu_solver(const SparsityPattern& pattern) {
  return std::make_unique<KluSolver>(pattern);
}

}  // namespace withe
