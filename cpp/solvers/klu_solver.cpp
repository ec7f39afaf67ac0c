#include "solvers/klu_solver.hpp"

#include <klu.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

#include "solvers/pattern_lookup.hpp"
#include "solvers/supernodes.hpp"

namespace withe {

struct KluSolver::Klu {
  klu_common common;
  klu_symbolic* symbolic = nullptr;
  klu_numeric* factors = nullptr;

  ~Klu() {
    klu_free_numeric(&factors, &common);
    klu_free_symbolic(&symbolic, &common);
  }
};

KluSolver::KluSolver(const SparsityPattern& pattern) : KluSolver(pattern, find_supernodes(pattern).order) {}

KluSolver::KluSolver(const SparsityPattern& pattern, const std::vector<int>& order)
    : pattern_(pattern), order_(order), klu_(std::make_unique<Klu>()) {
  klu_defaults(&klu_->common);
  // A structurally symmetric matrix with a full diagonal has no block triangular form worth the search, and
  // the search could move the diagonal away.
  klu_->common.btf = 0;
  klu_->symbolic = klu_analyze_given(pattern_.size, pattern_.column_starts.data(), pattern_.row_indices.data(),
                                     order_.data(), order_.data(), &klu_->common);
  if (!klu_->symbolic) throw std::bad_alloc();
}

KluSolver::KluSolver(const KluSolver& other) : KluSolver(other.pattern_, other.order_) {
  if (other.factorized()) factorize(other.values_);
}

KluSolver::~KluSolver() = default;

bool KluSolver::factorize(std::vector<double> values) {
  Klu& k = *klu_;
  values_ = std::move(values);
  klu_free_numeric(&k.factors, &k.common);
  // KLU looks at pivots only; a number that is not finite need not reach one.
  if (!std::all_of(values_.begin(), values_.end(), [](double value) { return std::isfinite(value); })) return false;
  k.factors =
      klu_factor(pattern_.column_starts.data(), pattern_.row_indices.data(), values_.data(), k.symbolic, &k.common);
  if (k.common.status == KLU_OUT_OF_MEMORY) throw std::bad_alloc();
  if (!k.factors) return false;
  const double* pivots = static_cast<const double*>(k.factors->Udiag);
  if (k.common.status == KLU_OK && std::all_of(pivots, pivots + pattern_.size, is_usable_pivot)) return true;
  klu_free_numeric(&k.factors, &k.common);
  return false;
}

bool KluSolver::factorized() const { return klu_->factors != nullptr; }

void KluSolver::solve(std::span<double> right_hand_side) const {
  require_solvable(factorized(), right_hand_side, pattern_.size);
  klu_solve(klu_->symbolic, klu_->factors, pattern_.size, 1, right_hand_side.data(), &klu_->common);
}

void KluSolver::solve_transposed(std::span<double> right_hand_side) const {
  require_solvable(factorized(), right_hand_side, pattern_.size);
  klu_tsolve(klu_->symbolic, klu_->factors, pattern_.size, 1, right_hand_side.data(), &klu_->common);
}

}  // namespace withe
