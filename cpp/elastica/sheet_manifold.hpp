#pragma once
/// All poses in which a sheet can be held without moment: the manifold of solutions with theta >= 0, tabulated once so
/// that every other solution begins next to its answer. For one position of the tip there are several equilibria; those
/// of this manifold are one family, reached from the flat sheet without a jump.

#include <vector>

#include "elastica/sheet_solution.hpp"

namespace withe {

/// Rows are suspended lengths, columns directions atan2(x, z) of the tip's way: on a ray from the origin the distance
/// grows with the suspended length, so that a position names one row and one column.
class SheetManifold {
 public:
  static constexpr double kShortest = 0.958, kLongest = 6.84;  ///< [Lgb] suspended lengths served by position
  static constexpr double kShortestRow = 0.05;                 ///< [Lgb] and by length and angle
  static constexpr double kGreatestPull = 40.0;  ///< [w Lgb] backward force on a taut sheet that ends the table

  SheetManifold();

  /// Caller's scratch.
  struct Data {
    ShootingSolver<SheetProblem> solver;
    SheetProblem problem;
    SheetProblem::Path path, trial;
  };

  SheetSolution at_position(double x, double z, const SheetShape& shape, Data& data) const;
  SheetSolution at_length_and_angle(double length, double angle, const SheetShape& shape, Data& data) const;

 private:
  struct Cell {
    std::size_t row, column;
    double along_row, along_column;  ///< in 0..1 between two rows, two columns
  };
  const SheetProblem::Path& node(std::size_t row, std::size_t column) const {
    return nodes_[row * directions_.size() + column];
  }
  void fill_row(std::size_t row, ShootingSolver<SheetProblem>& solver);
  void fill_column(std::size_t column, std::size_t start_row, ShootingSolver<SheetProblem>& solver);
  bool find_position(double x, double z, Cell& cell) const;
  bool find_angle(double length, double angle, Cell& cell) const;
  void interpolate(const Cell& cell, SheetProblem::Path& path) const;

  std::vector<double> lengths_, directions_;
  std::vector<SheetProblem::Path> nodes_;          // empty where there is no solution, or a taut one
  std::vector<std::size_t> first_row_, last_row_;  // of each column
};

}  // namespace withe
