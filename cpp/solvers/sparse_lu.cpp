#include "solvers/sparse_lu.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "solvers/klu_solver.hpp"
#include "solvers/multifrontal.hpp"
#include "solvers/pattern_lookup.hpp"

namespace withe {
namespace {

/// Backward error of a row, |A x - b| / (|A| |x| + |b|), above which pivots off the diagonal are sought.
constexpr double kGreatestError = 1e-13;

/// values(): column by column, in the order of the pattern.
///
/// Where pivots on the diagonal are usable and solve one system to kGreatestError, they stay; they and KLU's depend on
/// the matrix alone, as bit-exact restarts need. KLU allocates, and is made when first needed.
class SparseLu final : public LinearSolver {
 public:
  explicit SparseLu(const SparsityPattern& pattern)
      : pattern_(pattern),
        diagonal_pivots_(make_multifrontal(pattern, Symmetry::unsymmetric)),
        force_(pattern.size),
        solution_(pattern.size) {
    for (int i = 0; i < pattern.size; ++i) diagonal_.push_back(offset(i, i));
  }
  SparseLu(const SparseLu& other)
      : pattern_(other.pattern_),
        diagonal_pivots_(other.diagonal_pivots_->clone()),
        klu_(other.klu_),
        by_klu_(other.by_klu_),
        diagonal_(other.diagonal_),
        force_(other.force_),
        solution_(other.solution_) {}
  SparseLu& operator=(const SparseLu&) = delete;

  int size() const override { return pattern_.size; }
  Symmetry symmetry() const override { return Symmetry::unsymmetric; }
  std::string name() const override { return diagonal_pivots_->name(); }
  std::ptrdiff_t offset(int row, int column) const override { return diagonal_pivots_->offset(row, column); }
  std::span<double> values() override { return diagonal_pivots_->values(); }
  std::span<const double> values() const override { return std::as_const(*diagonal_pivots_).values(); }

  Factorization factorize(std::span<const double> shift) override {
    by_klu_ = false;
    const Factorization result = diagonal_pivots_->factorize(shift);
    if (result.status == FactorStatus::ok && is_accurate(shift)) return result;
    if (!klu_) klu_.emplace(pattern_);
    by_klu_ = true;
    std::vector<double> shifted(values().begin(), values().end());
    for (std::size_t i = 0; i < shift.size(); ++i) shifted[diagonal_[i]] += shift[i];
    return {klu_->factorize(std::move(shifted)) ? FactorStatus::ok : FactorStatus::singular, 0};
  }

  void solve(std::span<double> right_hand_side) const override {
    by_klu_ ? klu_->solve(right_hand_side) : diagonal_pivots_->solve(right_hand_side);
  }
  void solve_transposed(std::span<double> right_hand_side) const override {
    by_klu_ ? klu_->solve_transposed(right_hand_side) : diagonal_pivots_->solve_transposed(right_hand_side);
  }
  void multiply(std::span<const double> x, std::span<double> y) const override { diagonal_pivots_->multiply(x, y); }
  std::unique_ptr<LinearSolver> clone() const override { return std::make_unique<SparseLu>(*this); }
  void share_work(WorkerPool* workers) override { diagonal_pivots_->share_work(workers); }

 private:
  /// Solves A^T x = b, whose rows are together, with b_i = sqrt |a_ii|: it has the units of row i where unknowns are
  /// measured in others.
  bool is_accurate(std::span<const double> shift) {
    const std::span<const double> a = values();
    const auto shift_of = [&](int i) { return shift.empty() ? 0.0 : shift[i]; };
    for (int i = 0; i < size(); ++i) force_[i] = std::sqrt(std::abs(a[diagonal_[i]] + shift_of(i)));
    solution_ = force_;
    diagonal_pivots_->solve_transposed(solution_);
    for (int i = 0; i < size(); ++i) {
      double residual = shift_of(i) * solution_[i] - force_[i];
      double magnitude = std::abs(shift_of(i) * solution_[i]) + force_[i];
      for (int p = pattern_.column_starts[i]; p < pattern_.column_starts[i + 1]; ++p) {
        const double term = a[p] * solution_[pattern_.row_indices[p]];
        residual += term;
        magnitude += std::abs(term);
      }
      if (!(std::abs(residual) <= kGreatestError * magnitude && std::isfinite(magnitude))) return false;
    }
    return true;
  }

  SparsityPattern pattern_;
  std::unique_ptr<LinearSolver> diagonal_pivots_;
  std::optional<KluSolver> klu_;
  bool by_klu_ = false;  // the last factorisation
  std::vector<std::ptrdiff_t> diagonal_;
  std::vector<double> force_, solution_;
};

}  // namespace

std::unique_ptr<LinearSolver> make_sparse_lu(const SparsityPattern& pattern) {
  return std::make_unique<SparseLu>(pattern);
}

}  // namespace withe
