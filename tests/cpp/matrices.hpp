#pragma once
/// Random matrices with the patterns that scenes have, and how well a solver solves them.

#include <Eigen/Dense>
#include <algorithm>
#include <random>
#include <span>
#include <vector>

#include "solvers/linear_solver.hpp"

namespace withe::testing {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using Random = std::mt19937_64;

inline std::span<double> view(Vector& x) { return {x.data(), static_cast<std::size_t>(x.size())}; }
inline std::span<const double> view(const Vector& x) { return {x.data(), static_cast<std::size_t>(x.size())}; }

inline double uniform(Random& random) { return std::uniform_real_distribution<double>(-1.0, 1.0)(random); }

inline Vector random_vector(int size, Random& random) {
  return Vector::NullaryExpr(size, [&random](Eigen::Index) { return uniform(random); });
}

inline SparsityPattern band_pattern(int size, int half_bandwidth) {
  std::vector<std::vector<int>> cliques;
  for (int i = 0; i < size; ++i) {
    std::vector<int> clique;
    for (int j = i; j < std::min(size, i + half_bandwidth + 1); ++j) clique.push_back(j);
    cliques.push_back(clique);
  }
  return SparsityPattern::from_cliques(size, cliques);
}

inline SparsityPattern scattered_pattern(int size, Random& random) {
  std::uniform_int_distribution<int> unknown(0, size - 1);
  std::vector<std::vector<int>> cliques;
  for (int i = 0; i < size; ++i) cliques.push_back({unknown(random), unknown(random), unknown(random)});
  return SparsityPattern::from_cliques(size, cliques);
}

/// Rods of 60 unknowns with half bandwidth 10, joined to the first one and touching one another at random.
inline SparsityPattern rods_pattern(int size, Random& random) {
  std::uniform_int_distribution<int> place(0, size - 6);
  std::vector<std::vector<int>> cliques;
  for (int i = 0; i < size; ++i) {
    if (i % 60 == 0) cliques.push_back({0, 1, 2, i});
    std::vector<int> clique;
    for (int j = i; j <= std::min(size - 1, i + 10) && j / 60 == i / 60; ++j) clique.push_back(j);
    cliques.push_back(clique);
  }
  for (int contact = 0; contact < size / 20; ++contact) {
    const int a = place(random), b = place(random);
    cliques.push_back({a, a + 1, a + 2, a + 3, a + 4, a + 5, b, b + 1, b + 2, b + 3, b + 4, b + 5});
  }
  return SparsityPattern::from_cliques(size, cliques);
}

enum class Crossings { pinned, rigid };

/// A square net of cords, with a node at each crossing. Rigid crossings have a frame, to which each edge is bent; at
/// pinned ones each cord is bent on its own.
inline SparsityPattern net_pattern(int cords, Crossings crossings) {
  const int nodes = cords * cords, own = crossings == Crossings::rigid ? 6 : 3;  // of a node: position, and frame
  const auto node = [&](int cord, int place, bool across) {
    return across ? place * cords + cord : cord * cords + place;
  };
  const auto angle = [&](int cord, int place, bool across) {
    return own * nodes + (across * cords + cord) * (cords - 1) + place;
  };
  std::vector<std::vector<int>> cliques;
  for (bool across : {false, true}) {
    for (int cord = 0; cord < cords; ++cord) {
      for (int place = 0; place + 1 < cords; ++place) {
        const int first = node(cord, place, across), second = node(cord, place + 1, across);
        std::vector<int> clique{angle(cord, place, across)};
        for (int i = 0; i < 3; ++i) clique.insert(clique.end(), {own * first + i, own * second + i});
        for (int i = 3; i < own; ++i) {  // two half stencils
          cliques.push_back(clique);
          for (int k = 3; k < own; ++k) cliques.back().push_back(own * (i == 3 ? first : second) + k);
        }
        if (own == 3 && place + 2 < cords) {
          clique.push_back(angle(cord, place + 1, across));
          for (int i = 0; i < 3; ++i) clique.push_back(own * node(cord, place + 2, across) + i);
        }
        cliques.push_back(clique);
      }
    }
  }
  return SparsityPattern::from_cliques(own * nodes + 2 * cords * (cords - 1), cliques);
}

enum class Nature { definite, indefinite };

/// Random entries; off-diagonal ones at most 1, diagonal ones large enough for elimination without pivoting, or
/// (unsymmetric and indefinite) about as small as the others, so that pivoting is needed.
inline Matrix random_matrix(const SparsityPattern& pattern, Symmetry symmetry, Nature nature, Random& random) {
  Matrix matrix = Matrix::Zero(pattern.size, pattern.size);
  for (int column = 0; column < pattern.size; ++column) {
    const int count = pattern.column_starts[column + 1] - pattern.column_starts[column];
    for (int p = pattern.column_starts[column]; p < pattern.column_starts[column + 1]; ++p) {
      const int row = pattern.row_indices[p];
      if (row == column) {
        const bool negative = nature == Nature::indefinite && uniform(random) < 0.0;
        matrix(row, row) = (negative ? -1.0 : 1.0) * count;
        if (symmetry == Symmetry::unsymmetric && nature == Nature::indefinite) matrix(row, row) = uniform(random);
      } else if (symmetry == Symmetry::unsymmetric) {
        matrix(row, column) = uniform(random);
      } else if (row > column) {
        matrix(row, column) = matrix(column, row) = uniform(random);
      }
    }
  }
  return matrix;
}

inline void fill(LinearSolver& solver, const SparsityPattern& pattern, const Matrix& matrix) {
  for (int column = 0; column < pattern.size; ++column) {
    for (int p = pattern.column_starts[column]; p < pattern.column_starts[column + 1]; ++p) {
      const int row = pattern.row_indices[p];
      if (solver.symmetry() == Symmetry::symmetric && row < column) continue;
      solver.values()[solver.offset(row, column)] = matrix(row, column);
    }
  }
}

inline int count_negative_eigenvalues(const Matrix& matrix) {
  const Vector eigenvalues = Eigen::SelfAdjointEigenSolver<Matrix>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
  return static_cast<int>((eigenvalues.array() < 0.0).count());
}

inline double backward_error(const Matrix& matrix, const Vector& x, const Vector& b) {
  return (matrix * x - b).lpNorm<Eigen::Infinity>() /
         (matrix.cwiseAbs().rowwise().sum().maxCoeff() * x.lpNorm<Eigen::Infinity>());
}

/// Greatest over the rows, each measured by its own terms.
inline double backward_error_by_rows(const Matrix& matrix, const Vector& x, const Vector& b) {
  return ((matrix * x - b).cwiseAbs().array() / (matrix.cwiseAbs() * x.cwiseAbs() + b.cwiseAbs()).array()).maxCoeff();
}

}  // namespace withe::testing
