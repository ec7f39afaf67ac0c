// Code that must not allocate: solvers after the first factorisation.

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "allocation_counter.hpp"
#include "solvers/linear_solver.hpp"

namespace withe {
namespace {

TEST(AllocationCounter, SeesAVector) {
  const std::size_t before = allocation_count;
  const std::vector<double> numbers(100, 1.0);
  EXPECT_GT(allocation_count, before);
  EXPECT_EQ(numbers.size(), 100u);
}

TEST(LinearSolver, DoesNotAllocateAfterTheFirstFactorisation) {
  const int size = 300;
  std::vector<std::vector<int>> cliques;
  for (int i = 0; i + 10 < size; ++i) cliques.push_back({i, i + 3, i + 7, i + 10});
  const SparsityPattern pattern = SparsityPattern::from_cliques(size, cliques);
  const std::vector<double> shift(size, 1.0);
  for (Symmetry symmetry : {Symmetry::symmetric, Symmetry::unsymmetric}) {
    for (SolverKind kind : {SolverKind::band, SolverKind::sparse}) {
      const auto solver = make_linear_solver(pattern, symmetry, kind);
      // Every third unknown is measured in another unit, as angles are beside positions.
      const auto unit = [](double change, int i) { return i % 3 ? 1.0 : change; };
      const auto set = [&](double diagonal, double change) {
        for (double& value : solver->values()) value = 0.0;
        for (int column = 0; column < size; ++column) {
          for (int p = pattern.column_starts[column]; p < pattern.column_starts[column + 1]; ++p) {
            const int row = pattern.row_indices[p];
            if (symmetry == Symmetry::symmetric && row < column) continue;
            const double value = row == column ? diagonal : 0.5 + 0.01 * (row % 7);
            solver->values()[solver->offset(row, column)] = value * unit(change, row) * unit(change, column);
          }
        }
      };
      std::vector<double> x(size, 1.0), y(size, 0.0);
      set(20.0, 1.0);
      ASSERT_EQ(solver->factorize().status, FactorStatus::ok);
      const std::size_t before = allocation_count;
      for (auto [diagonal, change] : {std::pair{30.0, 1.0}, {-25.0, 1.0}, {30.0, 1e-6}, {30.0, 1e6}}) {
        set(diagonal, change);
        solver->factorize();
        solver->solve(x);
        solver->factorize(shift);
        solver->solve_transposed(x);
        solver->multiply(x, y);
      }
      EXPECT_EQ(allocation_count, before) << solver->name();
    }
  }
}

}  // namespace
}  // namespace withe
