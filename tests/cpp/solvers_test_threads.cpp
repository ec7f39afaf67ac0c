// Sparse solvers whose work several threads share: the same bits for every number of threads.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "common/worker_pool.hpp"
#include "matrices.hpp"
#include "solvers/elimination_parts.hpp"

namespace withe {
namespace {

using testing::Crossings;
using testing::fill;
using testing::Matrix;
using testing::Nature;
using testing::net_pattern;
using testing::Random;
using testing::random_matrix;
using testing::random_vector;
using testing::rods_pattern;
using testing::Vector;
using testing::view;

SparsityPattern dense_pattern(int size) {
  std::vector<int> all(static_cast<std::size_t>(size));
  std::iota(all.begin(), all.end(), 0);
  return SparsityPattern::from_cliques(size, {all});
}

struct Case {
  std::string name;
  SparsityPattern pattern;
};

/// Nets, rods that touch, and one front alone; all are large enough to be divided.
std::vector<Case> cases() {
  Random random(3);
  return {{"pinned net", net_pattern(18, Crossings::pinned)},
          {"rigid net", net_pattern(21, Crossings::rigid)},
          {"rods", rods_pattern(3000, random)},
          {"dense", dense_pattern(345)}};
}

struct Solutions {
  Factorization factorization;
  Vector solution, transposed;
};

Solutions solve(LinearSolver& solver, const Vector& force, const Vector& shift) {
  Solutions found{solver.factorize(view(shift)), force, force};
  solver.solve(view(found.solution));
  solver.solve_transposed(view(found.transposed));
  return found;
}

TEST(SolverThreads, GiveTheSameBits) {
  Random random(5);
  for (const auto& [name, pattern] : cases()) {
    ASSERT_FALSE(divide(find_supernodes(pattern)).undivided()) << name;
    for (Symmetry symmetry : {Symmetry::symmetric, Symmetry::unsymmetric}) {
      const Nature nature = symmetry == Symmetry::symmetric ? Nature::indefinite : Nature::definite;
      const Matrix matrix = random_matrix(pattern, symmetry, nature, random);
      const Vector force = random_vector(pattern.size, random), shift = Vector::Constant(pattern.size, 0.01);
      const Matrix shifted = matrix + Matrix(shift.asDiagonal());
      const auto solver = make_linear_solver(pattern, symmetry, SolverKind::sparse);
      fill(*solver, pattern, matrix);
      const Solutions alone = solve(*solver, force, shift);
      EXPECT_LT((shifted * alone.solution - force).norm(), 1e-9 * force.norm()) << name;
      EXPECT_LT((shifted.transpose() * alone.transposed - force).norm(), 1e-9 * force.norm()) << name;
      for (int threads = 1; threads <= 4; ++threads) {
        WorkerPool workers(threads);
        solver->share_work(&workers);
        for (int repetition = 0; repetition < 3; ++repetition) {
          const Solutions shared = solve(*solver, force, shift);
          EXPECT_EQ(shared.factorization.negative_pivots, alone.factorization.negative_pivots) << name;
          EXPECT_EQ(shared.solution, alone.solution) << name << ", " << threads << " threads";
          EXPECT_EQ(shared.transposed, alone.transposed) << name << ", " << threads << " threads";
        }
        solver->share_work(nullptr);
      }
      EXPECT_EQ(solve(*solver, force, shift).solution, alone.solution) << name;
    }
  }
}

TEST(SolverThreads, FindSingularMatrices) {
  WorkerPool workers(3);
  for (const auto& [name, pattern] : cases()) {
    const auto solver = make_linear_solver(pattern, Symmetry::symmetric, SolverKind::sparse);
    solver->share_work(&workers);
    Matrix matrix = Matrix::Identity(pattern.size, pattern.size);
    fill(*solver, pattern, matrix);
    EXPECT_EQ(solver->factorize().status, FactorStatus::ok) << name;
    matrix(pattern.size / 2, pattern.size / 2) = 0.0;
    fill(*solver, pattern, matrix);
    EXPECT_EQ(solver->factorize().status, FactorStatus::singular) << name;
  }
}

TEST(EliminationParts, HaveEachSupernodeOnceAndChildrenFirst) {
  for (const auto& [name, pattern] : cases()) {
    const Supernodes nodes = find_supernodes(pattern);
    const EliminationParts parts = divide(nodes);
    // Time at which a supernode is done: in a subtree 0, above it the number of its level.
    std::vector<int> done(static_cast<std::size_t>(nodes.count()), -1);
    const auto set = [&](int s, int time) { EXPECT_EQ(std::exchange(done[static_cast<std::size_t>(s)], time), -1); };
    for (const auto& subtree : parts.subtrees) {
      for (int s = subtree.first; s < subtree.end; ++s) {
        set(s, 0);
        const int parent = nodes.parent[static_cast<std::size_t>(s)];
        if (s + 1 == subtree.end) continue;
        EXPECT_GT(parent, s) << name;
        EXPECT_LT(parent, subtree.end) << name;
      }
    }
    for (std::size_t level = 0; level < parts.levels.size(); ++level)
      for (int s : parts.levels[level].supernodes) set(s, static_cast<int>(level) + 1);
    EXPECT_EQ(std::count(done.begin(), done.end(), -1), 0) << name;
    for (int s = 0; s < nodes.count(); ++s) {
      const int parent = nodes.parent[static_cast<std::size_t>(s)];
      if (parent < 0 || done[static_cast<std::size_t>(parent)] == 0) continue;
      EXPECT_LT(done[static_cast<std::size_t>(s)], done[static_cast<std::size_t>(parent)]) << name;
    }
  }
}

TEST(EliminationParts, AreOneInSmallMatrices) {
  const EliminationParts parts = divide(find_supernodes(net_pattern(4, Crossings::rigid)));
  EXPECT_TRUE(parts.undivided());
  EXPECT_EQ(parts.subtrees.size(), 1u);
}

}  // namespace
}  // namespace withe
