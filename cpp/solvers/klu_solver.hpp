#pragma once
/// LU with pivots off the diagonal, by KLU [Davis and Palamadai Natarajan 2010]. Other code uses KLU only through this
/// header.

#include <memory>
#include <span>
#include <vector>

#include "solvers/linear_solver.hpp"

namespace withe {

/// Pivots are determined again for each matrix, which allocates memory. Bit-exact restarts need factors that depend
/// only on the matrix, not on the pivots of an earlier matrix. A copy has the same factors.
class KluSolver {
 public:
  /// The pattern must be valid (require_valid); it is analysed here, once.
  explicit KluSolver(const SparsityPattern& pattern);
  KluSolver(const KluSolver& other);
  KluSolver& operator=(const KluSolver&) = delete;
  ~KluSolver();

  /// Column by column, in the order of the pattern; false where a pivot is zero or a value not finite.
  bool factorize(std::vector<double> values);
  bool factorized() const;
  void solve(std::span<double> right_hand_side) const;
  void solve_transposed(std::span<double> right_hand_side) const;

 private:
  struct Klu;
  KluSolver(const SparsityPattern& pattern, const std::vector<int>& order);

  SparsityPattern pattern_;
  std::vector<int> order_;  ///< that of the fronts: new -> old
  std::vector<double> values_;
  std::unique_ptr<Klu> klu_;
};

}  // namespace withe
