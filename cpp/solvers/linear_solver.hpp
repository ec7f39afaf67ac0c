#pragma once
/// The only interface to linear algebra: a matrix with a fixed pattern, which is filled through precomputed offsets. It
/// is factorised and solved many times without allocation. Only its implementation uses SuiteSparse.

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/instruction_set.hpp"

namespace withe {

class WorkerPool;

/// Pattern of a square matrix, structurally symmetric, column by column, rows sorted, diagonal included.
struct SparsityPattern {
  int size = 0;
  std::vector<int> column_starts;  ///< size + 1
  std::vector<int> row_indices;
  int beside = 0;  ///< numbers that values() has beside the matrix, at its end; solvers ignore them

  /// Pattern from cliques: every group of unknowns couples fully. Entries < 0 are skipped.
  static SparsityPattern from_cliques(int size, const std::vector<std::vector<int>>& cliques);
  /// Index of an entry in `row_indices`; -1: there is none.
  std::ptrdiff_t find(int row, int column) const;
  bool contains(int row, int column) const { return find(row, column) >= 0; }
  /// Greatest |row - column| of any entry.
  int half_bandwidth() const;
};

enum class Symmetry { symmetric, unsymmetric };

enum class SolverKind {
  automatic,  ///< band where the half bandwidth is small, otherwise sparse
  band,       ///< LDL^T of fixed half bandwidth, or band LU with threshold pivoting
  sparse,     ///< multifrontal LDL^T or LU
};

enum class FactorStatus { ok, singular };

struct Factorization {
  FactorStatus status = FactorStatus::ok;
  int negative_pivots = 0;  ///< symmetric only: number of negative eigenvalues (Sylvester)
};

class LinearSolver {
 public:
  virtual ~LinearSolver() = default;
  virtual int size() const = 0;
  virtual Symmetry symmetry() const = 0;
  /// "band LDLT (half bandwidth 10)", "sparse LDLT", "band LU", "sparse LU": for `plan`.
  virtual std::string name() const = 0;
  /// Place of entry (row, column) in values(). In a symmetric matrix row >= column is required. Throws
  /// std::invalid_argument outside the pattern.
  virtual std::ptrdiff_t offset(int row, int column) const = 0;
  /// Place of an entry or its mirror image, which are one in a symmetric matrix.
  std::ptrdiff_t place(int row, int column) const {
    return symmetry() == Symmetry::symmetric && column > row ? offset(column, row) : offset(row, column);
  }
  /// The matrix's entries, and `SparsityPattern::beside` numbers; kept intact by factorize(). Zeros may be added to
  /// kPadding numbers past their end.
  virtual std::span<double> values() = 0;
  virtual std::span<const double> values() const = 0;
  /// Factorises values() plus `shift` (empty, or one number a row) on the diagonal. Does not allocate
  /// after the first call. A zero or non-finite pivot gives FactorStatus::singular.
  virtual Factorization factorize(std::span<const double> shift = {}) = 0;
  /// Solves in place with the last factorisation.
  virtual void solve(std::span<double> right_hand_side) const = 0;
  virtual void solve_transposed(std::span<double> right_hand_side) const = 0;
  /// y = A x with the unfactorised values().
  virtual void multiply(std::span<const double> x, std::span<double> y) const = 0;
  virtual std::unique_ptr<LinearSolver> clone() const = 0;
  /// Lets several threads factorise and solve where this pays; null: this thread alone. Results have the same bits.
  /// `workers` must outlive the solver and its clones.
  virtual void share_work(WorkerPool* /*workers*/) {}
};

/// Analyses the pattern once. `automatic` takes the band when its half bandwidth is at most 24.
std::unique_ptr<LinearSolver> make_linear_solver(const SparsityPattern& pattern, Symmetry symmetry,
                                                 SolverKind kind = SolverKind::automatic);

}  // namespace withe
