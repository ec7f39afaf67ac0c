// Oracle: the same matrix, dense, solved by Eigen. Invariants: values() survive every call, negative pivots count
// negative eigenvalues, and what a solver answers depends on its current values alone.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "matrices.hpp"
#include "solvers/supernodes.hpp"

namespace withe {
namespace {

using testing::backward_error;
using testing::band_pattern;
using testing::count_negative_eigenvalues;
using testing::fill;
using testing::Matrix;
using testing::Nature;
using testing::net_pattern;
using testing::Random;
using testing::random_matrix;
using testing::random_vector;
using testing::rods_pattern;
using testing::scattered_pattern;
using testing::Vector;
using testing::view;

struct Case {
  std::string label;
  Symmetry symmetry;
  SolverKind kind;
  int half_bandwidth;  // 0: scattered, -1: of rods, -2: of a net
  int size;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.label; }

class EverySolver : public ::testing::TestWithParam<Case> {
 protected:
  SparsityPattern pattern() {
    const Case& c = GetParam();
    if (c.half_bandwidth > 0) return band_pattern(c.size, c.half_bandwidth);
    if (c.half_bandwidth == -2) return net_pattern(c.size, testing::Crossings::pinned);
    return c.half_bandwidth == 0 ? scattered_pattern(c.size, random_) : rods_pattern(c.size, random_);
  }
  std::unique_ptr<LinearSolver> make(const SparsityPattern& p) {
    return make_linear_solver(p, GetParam().symmetry, GetParam().kind);
  }
  Matrix matrix(const SparsityPattern& p, Nature nature) {
    return random_matrix(p, GetParam().symmetry, nature, random_);
  }

  Random random_{20240917};
};

std::vector<Case> cases() {
  std::vector<Case> result;
  for (Symmetry symmetry : {Symmetry::symmetric, Symmetry::unsymmetric}) {
    const std::string prefix = symmetry == Symmetry::symmetric ? "Symmetric" : "Unsymmetric";
    for (int half_bandwidth : {1, 3, 5, 7, 10, 11, 16, 17, 24, 31}) {
      for (int size : {half_bandwidth + 1, 97}) {
        result.push_back({prefix + "Band" + std::to_string(half_bandwidth) + "Size" + std::to_string(size), symmetry,
                          SolverKind::band, half_bandwidth, size});
      }
    }
    result.push_back({prefix + "BandOfScattered", symmetry, SolverKind::band, 0, 40});
    result.push_back({prefix + "BandOfSizeOne", symmetry, SolverKind::band, 1, 1});
    result.push_back({prefix + "SparseOfSizeOne", symmetry, SolverKind::sparse, 1, 1});
    result.push_back({prefix + "SparseOfBand", symmetry, SolverKind::sparse, 10, 97});
    result.push_back({prefix + "SparseOfWideBand", symmetry, SolverKind::sparse, 60, 150});
    result.push_back({prefix + "SparseOfFull", symmetry, SolverKind::sparse, 69, 70});
    result.push_back({prefix + "SparseOfScattered", symmetry, SolverKind::sparse, 0, 120});
    result.push_back({prefix + "SparseOfRods", symmetry, SolverKind::sparse, -1, 300});
  }
  result.push_back({"SymmetricSparseOfNet", Symmetry::symmetric, SolverKind::sparse, -2, 9});
  return result;
}

INSTANTIATE_TEST_SUITE_P(LinearSolver, EverySolver, ::testing::ValuesIn(cases()),
                         [](const auto& instance) { return instance.param.label; });

TEST_P(EverySolver, AgreesWithDenseOnDefiniteAndIndefiniteMatrices) {
  const SparsityPattern p = pattern();
  const auto solver = make(p);
  for (int repetition = 0; repetition < 6; ++repetition) {
    const Nature nature = repetition % 2 ? Nature::indefinite : Nature::definite;
    const Matrix a = matrix(p, nature);
    fill(*solver, p, a);
    const Factorization factorization = solver->factorize();
    ASSERT_EQ(factorization.status, FactorStatus::ok);
    if (GetParam().symmetry == Symmetry::symmetric) {
      EXPECT_EQ(factorization.negative_pivots, count_negative_eigenvalues(a));
    }
    const Vector b = random_vector(p.size, random_);
    Vector x = b;
    solver->solve(view(x));
    EXPECT_LT(backward_error(a, x, b), 1e-13);
    EXPECT_LT((x - a.partialPivLu().solve(b)).norm(),
              1e-10 * x.norm() * std::max(1.0, 1e-3 / a.partialPivLu().rcond()));
    Vector transposed = b;
    solver->solve_transposed(view(transposed));
    EXPECT_LT(backward_error(a.transpose(), transposed, b), 1e-13);
  }
}

TEST_P(EverySolver, AddsTheShiftToTheDiagonalAndKeepsValues) {
  const SparsityPattern p = pattern();
  const auto solver = make(p);
  const Matrix a = matrix(p, Nature::definite);
  fill(*solver, p, a);
  const std::vector<double> before(solver->values().begin(), solver->values().end());
  const Vector shift = (3.0 * random_vector(p.size, random_)).array().abs();
  ASSERT_EQ(solver->factorize(view(shift)).status, FactorStatus::ok);
  const Vector b = random_vector(p.size, random_);
  Vector shifted = b;
  solver->solve(view(shifted));
  EXPECT_LT(backward_error(a + Matrix(shift.asDiagonal()), shifted, b), 1e-14);
  EXPECT_TRUE(std::equal(before.begin(), before.end(), solver->values().begin(), solver->values().end()));

  ASSERT_EQ(solver->factorize().status, FactorStatus::ok);
  Vector unshifted = b;
  solver->solve(view(unshifted));
  EXPECT_LT(backward_error(a, unshifted, b), 1e-14);
  const std::vector<double> wrong_length(p.size + 1, 0.0);
  EXPECT_THROW(solver->factorize(wrong_length), std::invalid_argument);
}

TEST_P(EverySolver, MultipliesWithTheUnshiftedMatrix) {
  const SparsityPattern p = pattern();
  const auto solver = make(p);
  const Matrix a = matrix(p, Nature::indefinite);
  fill(*solver, p, a);
  solver->factorize();
  const Vector x = random_vector(p.size, random_);
  Vector y = Vector::Constant(p.size, 7.0);
  solver->multiply(view(x), view(y));
  EXPECT_LT((y - a * x).lpNorm<Eigen::Infinity>(), 1e-13);
  Vector same = x;
  EXPECT_THROW(solver->multiply(view(same), view(same)), std::invalid_argument);
}

TEST_P(EverySolver, ReportsSingularAndRecovers) {
  const SparsityPattern p = pattern();
  const auto solver = make(p);
  const Matrix a = matrix(p, Nature::definite);
  const double infinity = std::numeric_limits<double>::infinity();
  for (int row : {0, p.size / 2, p.size - 1}) {
    Matrix decoupled = a;
    decoupled.row(row).setZero();
    decoupled.col(row).setZero();
    fill(*solver, p, decoupled);
    EXPECT_EQ(solver->factorize().status, FactorStatus::singular);
    Vector x = Vector::Ones(p.size);
    EXPECT_THROW(solver->solve(view(x)), std::logic_error);
    EXPECT_THROW(solver->solve_transposed(view(x)), std::logic_error);

    for (double bad : {infinity, -infinity, std::numeric_limits<double>::quiet_NaN()}) {
      for (int q = p.column_starts[row]; q < p.column_starts[row + 1]; ++q) {
        Matrix poisoned = a;
        poisoned(p.row_indices[q], row) = poisoned(row, p.row_indices[q]) = bad;
        fill(*solver, p, poisoned);
        EXPECT_EQ(solver->factorize().status, FactorStatus::singular) << "at " << p.row_indices[q] << ", " << row;
      }
    }
  }
  fill(*solver, p, a);
  EXPECT_EQ(solver->factorize().status, FactorStatus::ok);
}

TEST_P(EverySolver, AnswersByItsCurrentValuesAlone) {
  const SparsityPattern p = pattern();
  const auto solver = make(p);
  const auto fresh = make(p);
  const Matrix a = matrix(p, Nature::definite);
  for (Nature nature : {Nature::indefinite, Nature::definite}) {
    fill(*solver, p, matrix(p, nature));
    solver->factorize();
  }
  fill(*solver, p, a);
  fill(*fresh, p, a);
  solver->factorize();
  fresh->factorize();
  const Vector b = random_vector(p.size, random_);
  Vector x = b, y = b;
  solver->solve(view(x));
  fresh->solve(view(y));
  EXPECT_EQ(x, y);
}

TEST_P(EverySolver, CloneHasTheSameFactorsAndThenGoesItsOwnWay) {
  const SparsityPattern p = pattern();
  std::unique_ptr<LinearSolver> solver = make(p);
  const Matrix a = matrix(p, Nature::indefinite);
  fill(*solver, p, a);
  const Vector shift = Vector::Constant(p.size, 0.25);
  ASSERT_EQ(solver->factorize(view(shift)).status, FactorStatus::ok);
  const Vector b = random_vector(p.size, random_);
  Vector expected = b;
  solver->solve(view(expected));

  const auto clone = solver->clone();
  EXPECT_EQ(clone->name(), solver->name());
  const Matrix other = matrix(p, Nature::definite);
  fill(*solver, p, other);
  ASSERT_EQ(solver->factorize().status, FactorStatus::ok);
  Vector x = b;
  clone->solve(view(x));
  EXPECT_EQ(x, expected);
  Vector product(p.size);
  clone->multiply(view(b), view(product));
  EXPECT_LT((product - a * b).lpNorm<Eigen::Infinity>(), 1e-13);

  solver.reset();
  ASSERT_EQ(clone->factorize(view(shift)).status, FactorStatus::ok);
  x = b;
  clone->solve(view(x));
  EXPECT_EQ(x, expected);
}

TEST_P(EverySolver, RefusesEntriesOutsideThePattern) {
  const SparsityPattern p = pattern();
  const auto solver = make(p);
  const Matrix inside = matrix(p, Nature::definite);
  for (int row = 0; row < p.size; ++row) {
    for (int column = 0; column < p.size; ++column) {
      const bool upper = GetParam().symmetry == Symmetry::symmetric && row < column;
      if (inside(row, column) == 0.0 || upper) {
        EXPECT_THROW(solver->offset(row, column), std::invalid_argument);
      } else {
        EXPECT_NO_THROW(solver->offset(row, column));
      }
    }
  }
  EXPECT_THROW(solver->offset(-1, 0), std::invalid_argument);
  EXPECT_THROW(solver->offset(p.size, 0), std::invalid_argument);
  EXPECT_THROW(solver->offset(p.size, p.size), std::invalid_argument);
}

TEST_P(EverySolver, RefusesToSolveBeforeItFactorised) {
  const SparsityPattern p = pattern();
  const auto solver = make(p);
  Vector x = Vector::Ones(p.size);
  EXPECT_THROW(solver->solve(view(x)), std::logic_error);
  fill(*solver, p, matrix(p, Nature::definite));
  solver->factorize();
  Vector longer = Vector::Ones(p.size + 1);
  EXPECT_THROW(solver->solve(view(longer)), std::invalid_argument);
}

TEST(SparsityPattern, CouplesEveryCliqueSkipsNegativesAndKeepsTheDiagonal) {
  const SparsityPattern p = SparsityPattern::from_cliques(5, {{3, 1, -1}, {1, 3}, {0, -7}});
  EXPECT_EQ(p.size, 5);
  EXPECT_EQ(p.column_starts, (std::vector<int>{0, 1, 3, 4, 6, 7}));
  EXPECT_EQ(p.row_indices, (std::vector<int>{0, 1, 3, 2, 1, 3, 4}));
  EXPECT_EQ(p.half_bandwidth(), 2);
  EXPECT_EQ(SparsityPattern::from_cliques(3, {}).half_bandwidth(), 0);
  EXPECT_THROW(SparsityPattern::from_cliques(3, {{3}}), std::invalid_argument);
  EXPECT_THROW(SparsityPattern::from_cliques(0, {}), std::invalid_argument);
}

TEST(MakeLinearSolver, TakesTheBandUpToHalfBandwidth24) {
  const SparsityPattern narrow = band_pattern(60, 24);
  const SparsityPattern wide = band_pattern(60, 25);
  EXPECT_EQ(make_linear_solver(narrow, Symmetry::symmetric)->name(), "band LDLT (half bandwidth 24)");
  EXPECT_EQ(make_linear_solver(narrow, Symmetry::unsymmetric)->name(), "band LU");
  EXPECT_EQ(make_linear_solver(wide, Symmetry::symmetric)->name(), "sparse LDLT");
  EXPECT_EQ(make_linear_solver(wide, Symmetry::unsymmetric)->name(), "sparse LU");
  EXPECT_EQ(make_linear_solver(wide, Symmetry::symmetric, SolverKind::band)->name(), "band LDLT (half bandwidth 25)");
}

TEST(MakeLinearSolver, SolvesADiagonalMatrix) {
  const SparsityPattern p = SparsityPattern::from_cliques(4, {});
  for (Symmetry symmetry : {Symmetry::symmetric, Symmetry::unsymmetric}) {
    for (SolverKind kind : {SolverKind::band, SolverKind::sparse}) {
      const auto solver = make_linear_solver(p, symmetry, kind);
      for (int i = 0; i < 4; ++i) solver->values()[solver->offset(i, i)] = i - 1.5;
      const Factorization factorization = solver->factorize();
      ASSERT_EQ(factorization.status, FactorStatus::ok);
      EXPECT_EQ(factorization.negative_pivots, symmetry == Symmetry::symmetric ? 2 : 0);
      std::vector<double> x(4, 3.0);
      solver->solve(x);
      EXPECT_EQ(x, (std::vector<double>{-2.0, -6.0, 6.0, 2.0}));
    }
  }
}

TEST(MakeLinearSolver, RefusesADamagedPattern) {
  const SparsityPattern good = band_pattern(4, 1);
  SparsityPattern unsymmetric{2, {0, 2, 3}, {0, 1, 1}};
  SparsityPattern no_diagonal{2, {0, 1, 1}, {0}};
  SparsityPattern unsorted{2, {0, 2, 4}, {1, 0, 0, 1}};
  SparsityPattern outside{2, {0, 2, 3}, {0, 2, 1}};
  SparsityPattern truncated = good;
  truncated.row_indices.pop_back();
  for (const SparsityPattern& bad : {SparsityPattern{}, unsymmetric, no_diagonal, unsorted, outside, truncated}) {
    EXPECT_THROW(make_linear_solver(bad, Symmetry::symmetric), std::invalid_argument);
  }
  EXPECT_NO_THROW(make_linear_solver(good, Symmetry::symmetric));
}

TEST(Supernodes, HaveRoomForTheMatrixAndWhatTheirChildrenLeave) {
  Random random(3);
  for (int size : {1, 2, 40, 120}) {
    const SparsityPattern p = size % 40 == 0 ? scattered_pattern(size, random) : band_pattern(size, size - 1);
    const Supernodes nodes = find_supernodes(p);
    std::vector<int> place(size, -1), stack;
    for (int k = 0; k < size; ++k) place[nodes.order[k]] = k;
    EXPECT_EQ(std::count(place.begin(), place.end(), -1), 0);
    ASSERT_EQ(nodes.column_starts.back(), size);
    const auto front = [&](int s) {
      std::set<int> rows(nodes.rows.begin() + nodes.row_starts[s], nodes.rows.begin() + nodes.row_starts[s + 1]);
      for (int c = nodes.column_starts[s]; c < nodes.column_starts[s + 1]; ++c) rows.insert(c);
      return rows;
    };
    for (int s = 0; s < nodes.count(); ++s) {
      const std::set<int> rows = front(s);
      EXPECT_EQ(*rows.begin(), nodes.column_starts[s]);
      EXPECT_TRUE(
          std::is_sorted(nodes.rows.begin() + nodes.row_starts[s], nodes.rows.begin() + nodes.row_starts[s + 1]));
      for (int c = nodes.column_starts[s]; c < nodes.column_starts[s + 1]; ++c)
        for (int q = p.column_starts[nodes.order[c]]; q < p.column_starts[nodes.order[c] + 1]; ++q)
          EXPECT_TRUE(place[p.row_indices[q]] < c || rows.count(place[p.row_indices[q]]));
      // Children wait on top of a stack.
      while (!stack.empty() && nodes.parent[stack.back()] == s) {
        for (int r = nodes.row_starts[stack.back()]; r < nodes.row_starts[stack.back() + 1]; ++r)
          EXPECT_TRUE(rows.count(nodes.rows[r]));
        stack.pop_back();
      }
      EXPECT_EQ(nodes.parent[s] < 0, nodes.rest(s) == 0);
      if (nodes.parent[s] >= 0) stack.push_back(s);
    }
    EXPECT_TRUE(stack.empty());
  }
}

TEST(Supernodes, OfAnOpenRodHoldLittleMoreThanItsBand) {
  const SparsityPattern p = band_pattern(400, 10);
  const Supernodes nodes = find_supernodes(p);
  EXPECT_LT(nodes.entries(), 1.6 * 400 * 11);
}

}  // namespace
}  // namespace withe
