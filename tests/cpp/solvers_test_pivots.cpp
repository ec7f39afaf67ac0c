// Pivots: where a diagonal entry is none, and that negative ones count eigenvalues.

#include <gtest/gtest.h>

#include "matrices.hpp"

namespace withe {
namespace {

using testing::backward_error;
using testing::backward_error_by_rows;
using testing::band_pattern;
using testing::fill;
using testing::Matrix;
using testing::Nature;
using testing::Random;
using testing::random_matrix;
using testing::random_vector;
using testing::rods_pattern;
using testing::Vector;
using testing::view;

TEST(UnsymmetricSolvers, PivotWhereTheDiagonalIsZeroOrTiny) {
  for (double diagonal : {0.0, 1e-18, 1e-9}) {
    for (SolverKind kind : {SolverKind::band, SolverKind::sparse}) {
      Random random(7);
      const SparsityPattern p = band_pattern(60, 6);
      Matrix a = random_matrix(p, Symmetry::unsymmetric, Nature::indefinite, random);
      a.diagonal().setConstant(diagonal);
      const auto solver = make_linear_solver(p, Symmetry::unsymmetric, kind);
      fill(*solver, p, a);
      ASSERT_EQ(solver->factorize().status, FactorStatus::ok);
      const Vector b = random_vector(p.size, random);
      Vector x = b;
      solver->solve(view(x));
      EXPECT_LT(backward_error(a, x, b), 1e-13) << solver->name() << ", diagonal " << diagonal;
    }
  }
}

TEST(UnsymmetricSolvers, PivotWhereOneDiagonalEntryIsZeroOrTinyWhateverTheUnits) {
  Random random(8);
  for (const SparsityPattern& p : {rods_pattern(180, random), band_pattern(180, 10)}) {
    const auto solver = make_linear_solver(p, Symmetry::unsymmetric);
    for (double diagonal : {0.0, 1e-18, 1e-14, 1e-10, 1e-6}) {
      for (double unit : {1.0, 1e-7, 1e7}) {
        Vector units = Vector::Ones(p.size);
        for (int i = 0; i < p.size; i += 3) units[i] = unit;
        for (int where : {0, 59, 60, 101, 179}) {
          Matrix a = random_matrix(p, Symmetry::unsymmetric, Nature::definite, random);
          a(where, where) = diagonal;
          a = Matrix(units.asDiagonal() * a * units.asDiagonal());
          fill(*solver, p, a);
          ASSERT_EQ(solver->factorize().status, FactorStatus::ok);
          const Vector b = units.cwiseProduct(random_vector(p.size, random));
          Vector x = b, transposed = b;
          solver->solve(view(x));
          solver->solve_transposed(view(transposed));
          SCOPED_TRACE(::testing::Message() << "diagonal " << diagonal << " at " << where << ", unit " << unit);
          EXPECT_LT(backward_error_by_rows(a, x, b), 1e-11);
          EXPECT_LT(backward_error_by_rows(a.transpose(), transposed, b), 1e-11);
        }
      }
    }
  }
}

TEST(UnsymmetricSolvers, SolveNetsWithAndWithoutPivotsOffTheDiagonal) {
  Random random(10);
  const SparsityPattern p = testing::net_pattern(12, testing::Crossings::pinned);
  const auto solver = make_linear_solver(p, Symmetry::unsymmetric);
  for (bool zeros : {false, true}) {
    Matrix a = random_matrix(p, Symmetry::unsymmetric, Nature::definite, random);
    for (int i = 0; zeros && i < p.size; i += 50) a(i, i) = 0.0;
    const double greatest_error = zeros ? 1e-13 : 1e-14;
    fill(*solver, p, a);
    ASSERT_EQ(solver->factorize().status, FactorStatus::ok);
    const Vector b = random_vector(p.size, random);
    Vector x = b, transposed = b;
    solver->solve(view(x));
    solver->solve_transposed(view(transposed));
    EXPECT_LT(backward_error(a, x, b), greatest_error);
    EXPECT_LT(backward_error(a.transpose(), transposed, b), greatest_error);
  }
}

TEST(UnsymmetricSolvers, ForgetThatAnEarlierMatrixNeededPivots) {
  Random random(9);
  for (const SparsityPattern& p : {rods_pattern(180, random), band_pattern(180, 10)}) {
    const Matrix plain = random_matrix(p, Symmetry::unsymmetric, Nature::definite, random);
    Matrix zero_diagonal = random_matrix(p, Symmetry::unsymmetric, Nature::definite, random);
    zero_diagonal.diagonal().setZero();
    const Vector b = random_vector(p.size, random);
    const auto solution = [&](LinearSolver& solver, const Matrix& a) {
      fill(solver, p, a);
      EXPECT_EQ(solver.factorize().status, FactorStatus::ok);
      Vector x = b;
      solver.solve(view(x));
      return x;
    };
    const auto make = [&] { return make_linear_solver(p, Symmetry::unsymmetric); };
    const auto solver = make();
    for (bool pivots : {false, true, false, true}) {
      const Matrix& a = pivots ? zero_diagonal : plain;
      const Vector x = solution(*solver, a);
      EXPECT_EQ(x, solution(*make(), a));
      const auto clone = solver->clone();
      Vector again = b;
      clone->solve(view(again));
      EXPECT_EQ(again, x);
      EXPECT_EQ(solution(*clone, plain), solution(*make(), plain));
    }
  }
}

TEST(SymmetricSolvers, CountTheNegativePivotsOfAShiftedMatrix) {
  Random random(11);
  const SparsityPattern p = band_pattern(80, 10);
  const Matrix a = random_matrix(p, Symmetry::symmetric, Nature::definite, random);
  const Vector eigenvalues = Eigen::SelfAdjointEigenSolver<Matrix>(a).eigenvalues();
  for (SolverKind kind : {SolverKind::band, SolverKind::sparse}) {
    const auto solver = make_linear_solver(p, Symmetry::symmetric, kind);
    fill(*solver, p, a);
    for (int below : {0, 1, 17, 40, 79, 80}) {
      const double left = below == 0 ? eigenvalues[0] - 1.0 : eigenvalues[below - 1];
      const double right = below == 80 ? eigenvalues[79] + 1.0 : eigenvalues[below];
      const Vector shift = Vector::Constant(p.size, -0.5 * (left + right));
      const Factorization factorization = solver->factorize(view(shift));
      EXPECT_EQ(factorization.status, FactorStatus::ok);
      EXPECT_EQ(factorization.negative_pivots, below) << solver->name();
    }
  }
}

}  // namespace
}  // namespace withe
