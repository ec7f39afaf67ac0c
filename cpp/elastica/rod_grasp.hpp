#pragma once
/// Grasps that lay a rod: for a suspended length and the curvature at lift-off, where a gripper holds it that bends
/// nothing, while the floor gives no force along the rod, or a given one.

#include <vector>

#include "elastica/rod.hpp"

namespace withe {

using GraspProblem = RodProblem<RodEnd::no_moment>;

/// Question about a grasp. Lengths in Lgb, forces in w Lgb.
struct GraspQuestion {
  double suspended = 1, curvature = 0;  ///< of either sign
  double stretch_stiffness = 1e9;       ///< EA
  double axial_force = 0;               ///< of the floor on the rod, along x
  double base_angle = 0;  ///< of the tangent at the floor above x, where a free end stands there: then no curvature
  double lever = 0;       ///< of the floor's force below the centreline, the radius of a rod that rests on its surface
  double twist_stiffness = 4.0 / 3.0;  ///< GJ, by default that of a round rod of incompressible material
};

/// Result of one grasp. Lengths in Lgb, forces in w Lgb.
struct RodGrasp {
  RodPoint tip{};  ///< its rotation with the twist
  RodVector floor_force{};
  double residual = 0;
  bool solved = false;  ///< and above the floor, which pushes
  bool stable = false;
};

/// Solutions over suspended length and curvature, tabulated once, so that every other solution begins next to its
/// answer. Beyond kLongestRow the shape near the floor no longer depends on the length, and what hangs above is a
/// catenary.
class GraspTable {
 public:
  static constexpr double kShortest = 0.1, kLongest = 100.0;  ///< [Lgb] suspended lengths that are served
  static constexpr double kGreatestCurvature = 6.0;           ///< [1/Lgb]
  static constexpr double kLongestRow = 7.2;                  ///< [Lgb]

  GraspTable();

  /// Caller's scratch.
  struct Data {
    ShootingSolver<GraspProblem> solver;
    GraspProblem problem;
    GraspProblem::Path path, trial;
    int iterations = 0;
  };

  /// Leaves the solved path in `data`.
  bool solve(const GraspQuestion& asked, Data& data) const { return solve(asked, rod_cuts(asked.suspended), data); }
  bool solve(const GraspQuestion& asked, const std::vector<double>& cuts, Data& data) const;

  RodGrasp grasp(const GraspQuestion& asked, Data& data) const;

 private:
  void guess(double suspended, double curvature, const std::vector<double>& cuts, GraspProblem::Path& path) const;

  std::vector<double> lengths_, curvatures_;
  std::vector<GraspProblem::Path> nodes_;
};

}  // namespace withe
