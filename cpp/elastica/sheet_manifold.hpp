#pragma once
/// All poses in which a gripper holds a sheet of one width without moment: the manifold of solutions with theta >= 0.
/// A table with cubic interpolation gives every solve a start near its solution. One position of the tip has several
/// equilibria. This manifold is the family that is reached from the flat sheet without a jump.

#include <array>
#include <optional>
#include <vector>

#include "elastica/sheet_solution.hpp"

namespace withe {

/// Rows are suspended lengths, columns directions atan2(x, z) of the tip's way: on a ray from the origin the distance
/// grows with the suspended length, so that a position names one row and one column.
class SheetManifold {
 public:
  static constexpr double kShortest = 0.958, kLongest = 6.84;  ///< [Lgb] suspended lengths served by position
  static constexpr double kShortestRow = 0.05;                 ///< [Lgb] and by length and angle
  static constexpr double kGreatestPull = 40.0;                ///< [w Lgb] backward force on a taut sheet that ends the
                                                               ///< table; w that of its narrower end

  explicit SheetManifold(const SheetWidth& width = {});

  /// Caller's scratch.
  struct Data {
    ShootingSolver<SheetProblem> solver;
    SheetProblem problem;
    SheetProblem::Path path, trial;
  };

  SheetSolution at_position(double x, double z, double tip_moment, Data& data) const;
  SheetSolution at_length_and_angle(double length, double angle, double tip_moment, Data& data) const;

 private:
  /// Between two rows and two columns; the first of each.
  struct Cell {
    std::size_t row, column;
  };
  static constexpr std::size_t kPoints = 4;
  using Weights = std::array<double, kPoints>;
  /// Rows and columns around a cell that all have solutions (4 by 4, or only those of the cell), and their weights.
  struct Patch {
    Cell first;
    std::size_t points;  ///< each way
    Weights rows, columns;
  };
  const SheetProblem::Path& node(std::size_t row, std::size_t column) const {
    return nodes_[row * directions_.size() + column];
  }
  std::optional<SheetProblem::Path> first_path(double length, ShootingSolver<SheetProblem>& solver) const;
  void fill_row(std::size_t row, ShootingSolver<SheetProblem>& solver);
  void fill_column(std::size_t column, std::size_t start_row, ShootingSolver<SheetProblem>& solver);
  std::optional<Cell> find_position(double direction, double distance) const;
  std::optional<Cell> find_angle(double length, double angle) const;
  Patch patch_around(const Cell& cell) const;
  Patch patch_at_position(const Cell& cell, double direction, double distance) const;
  Patch patch_at_angle(const Cell& cell, double length, double angle) const;
  void interpolate(const Patch& patch, SheetProblem::Path& path) const;
  bool solve(double tip_moment, Data& data) const;

  SheetWidth width_;
  std::vector<double> lengths_, directions_;
  std::vector<SheetProblem::Path> nodes_;          // empty if there is no solution, or a taut one
  std::vector<std::size_t> first_row_, last_row_;  // per column
};

}  // namespace withe
