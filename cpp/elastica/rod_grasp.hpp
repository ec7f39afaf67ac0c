#pragma once
/// Grasps that lay a rod. For a suspended length and the curvature at lift-off, they give the pose of a gripper that
/// exerts no moment. The force of the floor along the rod is zero, or given.

#include <vector>

#include "elastica/rod.hpp"

namespace withe {

using GraspProblem = RodProblem<RodEnd::no_moment>;

/// Question about a grasp. Lengths in Lgb, forces in w Lgb.
struct GraspQuestion {
  double suspended = 1, curvature = 0;  ///< the curvature has either sign
  double stretch_stiffness = 1e9;       ///< EA
  double axial_force = 0;               ///< force of the floor on the rod, along x
  double base_angle = 0;  ///< angle of the tangent at the floor above x if a free end stands there; then no curvature
  double lever = 0;       ///< distance of the floor's force below the centreline: the radius of the rod
  double twist_stiffness = 4.0 / 3.0;  ///< GJ; the default is for a round rod of incompressible material
};

/// Result of one grasp. Lengths in Lgb, forces in w Lgb.
struct RodGrasp {
  RodPoint tip{};  ///< its rotation includes the twist
  RodVector floor_force{};
  double residual = 0;
  bool solved = false;  ///< and above the floor, which pushes
  bool stable = false;
};

/// Solutions over suspended length and curvature, tabulated once. Every other solution begins from a tabulated one
/// nearby. Beyond kLongestRow the shape near the floor no longer depends on the length, and the part above it is a
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
