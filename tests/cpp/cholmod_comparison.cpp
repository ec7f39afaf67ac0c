// Built only with the option WITHE_WITH_CHOLMOD. References: CHOLMOD and UMFPACK on the pattern of an open rod, with
// half bandwidth 10.

#include <cholmod.h>
#include <gtest/gtest.h>
#include <umfpack.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "solvers/linear_solver.hpp"

namespace withe {
namespace {

constexpr int kHalfBandwidth = 10;

SparsityPattern open_rod_pattern(int nodes) {
  const int size = 4 * nodes - 1;
  std::vector<std::vector<int>> cliques;
  for (int first = 0; first < size; first += 4) {
    std::vector<int> stencil;
    for (int i = first; i < std::min(size, first + kHalfBandwidth + 1); ++i) stencil.push_back(i);
    cliques.push_back(stencil);
  }
  return SparsityPattern::from_cliques(size, cliques);
}

/// Random entries, symmetric where asked for, with a diagonal that makes elimination safe.
std::vector<double> random_values(const SparsityPattern& pattern, Symmetry symmetry, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<double> values(pattern.row_indices.size());
  for (int column = 0; column < pattern.size; ++column) {
    for (int p = pattern.column_starts[column]; p < pattern.column_starts[column + 1]; ++p) {
      const int row = pattern.row_indices[p];
      if (row == column) {
        values[p] = 4.0 * kHalfBandwidth;
      } else if (symmetry == Symmetry::unsymmetric || row > column) {
        values[p] = uniform(random);
      }
    }
  }
  return values;
}

std::vector<double> solve_by_withe(const SparsityPattern& pattern, const std::vector<double>& values, Symmetry symmetry,
                                   SolverKind kind, std::vector<double> b) {
  const auto solver = make_linear_solver(pattern, symmetry, kind);
  for (int column = 0; column < pattern.size; ++column) {
    for (int p = pattern.column_starts[column]; p < pattern.column_starts[column + 1]; ++p) {
      const int row = pattern.row_indices[p];
      if (symmetry == Symmetry::unsymmetric || row >= column) solver->values()[solver->offset(row, column)] = values[p];
    }
  }
  EXPECT_EQ(solver->factorize().status, FactorStatus::ok);
  solver->solve(b);
  return b;
}

std::vector<double> solve_by_cholmod(SparsityPattern pattern, std::vector<double> values, std::vector<double> b) {
  cholmod_common common;
  cholmod_start(&common);
  const auto size = static_cast<std::size_t>(pattern.size);
  cholmod_sparse matrix{};
  matrix.nrow = matrix.ncol = size;
  matrix.nzmax = values.size();
  matrix.p = pattern.column_starts.data();
  matrix.i = pattern.row_indices.data();
  matrix.x = values.data();
  matrix.stype = -1;  // the lower triangle counts
  matrix.itype = CHOLMOD_INT;
  matrix.xtype = CHOLMOD_REAL;
  matrix.dtype = CHOLMOD_DOUBLE;
  matrix.sorted = matrix.packed = 1;
  cholmod_dense right{};
  right.nrow = right.d = right.nzmax = size;
  right.ncol = 1;
  right.x = b.data();
  right.xtype = CHOLMOD_REAL;
  right.dtype = CHOLMOD_DOUBLE;
  cholmod_factor* factor = cholmod_analyze(&matrix, &common);
  cholmod_factorize(&matrix, factor, &common);
  cholmod_dense* x = cholmod_solve(CHOLMOD_A, factor, &right, &common);
  const auto* first = static_cast<const double*>(x->x);
  std::vector<double> result(first, first + size);
  cholmod_free_dense(&x, &common);
  cholmod_free_factor(&factor, &common);
  cholmod_finish(&common);
  return result;
}

std::vector<double> solve_by_umfpack(const SparsityPattern& pattern, const std::vector<double>& values,
                                     const std::vector<double>& b) {
  const int *starts = pattern.column_starts.data(), *rows = pattern.row_indices.data();
  void *symbolic = nullptr, *numeric = nullptr;
  umfpack_di_symbolic(pattern.size, pattern.size, starts, rows, values.data(), &symbolic, nullptr, nullptr);
  umfpack_di_numeric(starts, rows, values.data(), symbolic, &numeric, nullptr, nullptr);
  std::vector<double> x(b.size());
  umfpack_di_solve(UMFPACK_A, starts, rows, values.data(), x.data(), b.data(), numeric, nullptr, nullptr);
  umfpack_di_free_symbolic(&symbolic);
  umfpack_di_free_numeric(&numeric);
  return x;
}

double greatest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double greatest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) greatest = std::max(greatest, std::abs(a[i] - b[i]));
  return greatest;
}

class OpenRod : public testing::TestWithParam<int> {
 protected:
  const SparsityPattern pattern = open_rod_pattern(GetParam());
  const std::vector<double> b = std::vector<double>(static_cast<std::size_t>(pattern.size), 1.0);
};

TEST_P(OpenRod, SymmetricSolversAgreeWithCholmod) {
  const auto values = random_values(pattern, Symmetry::symmetric, 7);
  const auto expected = solve_by_cholmod(pattern, values, b);
  for (const SolverKind kind : {SolverKind::band, SolverKind::sparse}) {
    EXPECT_LT(greatest_difference(solve_by_withe(pattern, values, Symmetry::symmetric, kind, b), expected), 1e-14);
  }
}

TEST_P(OpenRod, UnsymmetricSolversAgreeWithUmfpack) {
  const auto values = random_values(pattern, Symmetry::unsymmetric, 8);
  const auto expected = solve_by_umfpack(pattern, values, b);
  for (const SolverKind kind : {SolverKind::band, SolverKind::sparse}) {
    EXPECT_LT(greatest_difference(solve_by_withe(pattern, values, Symmetry::unsymmetric, kind, b), expected), 1e-14);
  }
}

INSTANTIATE_TEST_SUITE_P(Nodes, OpenRod, testing::Values(3, 11, 101, 1001));

}  // namespace
}  // namespace withe
