#pragma once
/// Poses in which a straight line is laid: a rod that leaves the floor flat, without curvature, and hangs in one
/// upright plane. A gripper at a given position may bend it; its rotation then follows from the floor, which gives no
/// moment.

#include <array>
#include <optional>
#include <vector>

#include "elastica/rod.hpp"

namespace withe {

using HeldProblem = RodProblem<RodEnd::plane_of_xz>;

/// All for one suspended length. Lengths in Lgb, forces in w Lgb.
class StraightRod {
 public:
  /// Finds both poses that need no force along the floor and no moment at the jaw; at most kLongest.
  StraightRod(double suspended, double stretch_stiffness);
  static constexpr double kShortest = 0.3, kLongest = 50.0;

  /// The solution with small bending, and the folded solution, if it stays above the floor.
  const HeldProblem::Path& gentle() const { return gentle_; }
  const std::optional<HeldProblem::Path>& folded() const { return folded_; }

  /// The equilibrium that is reached from the nearer optimum without a jump; none where it meets the floor elsewhere or
  /// the floor would have to pull.
  std::optional<RodShape> at_position(double x, double z) const;

  /// Outline of such positions, seen from the lift-off point in rays: on each the nearest and the farthest.
  std::vector<std::array<double, 4>> outline(double angle_step) const;

  RodShape shape(const HeldProblem::Path& path) const;

 private:
  bool follow_to(double x, double z, HeldProblem::Path& path, HeldProblem& problem) const;
  bool allowed(const HeldProblem& problem, const HeldProblem::Path& path) const;
  double extent(HeldProblem problem, HeldProblem::Path path, double angle, double outwards) const;

  HeldProblem problem_;
  HeldProblem::Path gentle_;
  std::optional<HeldProblem::Path> folded_;
};

}  // namespace withe
