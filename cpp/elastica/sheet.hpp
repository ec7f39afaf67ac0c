#pragma once
/// The suspended part of a sheet, seen from the side: a heavy elastica that leaves a flat floor and is held at its tip.
///
/// Units are the gravito-bending length Lgb = (EI / 2w)^(1/3) and the weight per length w at b = 1. The variables are
/// the arc length s from the lift-off point, the angle theta of the tangent above the floor, the moment m, and the
/// width b (`SheetWidth`):
///   theta' = m / (2 b),  m' = (R - W) cos(theta) - T sin(theta),  X' = cos(theta),  Z' = sin(theta),
///   W(s) = the weight of the part before s,  theta(0) = m(0) = X(0) = Z(0) = 0.
/// R and T are the forces of the floor on the sheet at lift-off, up and forward (the direction in which the sheet
/// leaves). The moment vanishes there because a flat floor can only push. The tip carries a given moment.
/// [Dissertation (7.6) with the missing condition m(0) = 0.]

#include <array>
#include <vector>

#include "elastica/sheet_kernels.hpp"
#include "elastica/sheet_width.hpp"
#include "elastica/shooting.hpp"

namespace withe {

struct SheetShape {
  SheetWidth width;
  double tip_moment = 0;  ///< [w Lgb^2]
};

/// Conditions at the tip besides its moment.
enum class TipTarget {
  position,              ///< x = length - X and z = Z: the tip's way back and up from where it lay in the flat sheet
  length_and_angle,      ///< suspended length, and theta at the tip
  length_and_direction,  ///< suspended length, and the angle atan2(x, z) of that way
  pose,                  ///< position and theta are given; the moment at the tip is a result
  sliding                ///< height and theta while the sheet slides, T = friction (R + weight that lies); x comes out
};

class SheetProblem {
 public:
  static constexpr int kStates = 4, kParameters = 3;  // theta, m, X, Z; R, T, length
  static constexpr int kSegments = kSheetSegments;
  using Path = ShootingPath<kStates, kParameters>;
  using System = ShootingSystem<kStates, kParameters>;

  SheetShape shape;
  TipTarget target = TipTarget::position;
  std::array<double, 3> goal{};  ///< the two or three numbers of the target in the order of its name; x, z, theta
  double friction = 0;           ///< for `sliding`: coefficient, with the sign of T
  double sheet_length = 0;       ///< for `sliding`: length of the whole sheet [Lgb]

  void linearise(const Path& path, System& system) const;
  /// Computes only the gaps. The slopes do not change.
  void put_gaps(const Path& path, System& system) const;

 private:
  void put_end(const Path& path, System& system) const;
};

/// States at the cuts of a path that is integrated from its start on.
void set_nodes(const SheetShape& shape, SheetProblem::Path& path);

/// Weight of the part of a sheet that is not lifted [w Lgb].
double lying_weight(const SheetWidth& width, const SheetProblem::Path& path, double sheet_length);

inline double tip_back(const SheetProblem::Path& path) { return path.values[2] - path.nodes.back()[2]; }
inline double tip_up(const SheetProblem::Path& path) { return path.nodes.back()[3]; }
inline double tip_angle(const SheetProblem::Path& path) { return path.nodes.back()[0]; }

/// Extremes along a solved path. Lengths in Lgb, forces in w Lgb.
struct SheetExtremes {
  double largest_curvature = 0;  ///< largest absolute curvature
  double smallest_angle = 0;
  double largest_angle = 0;
  double lowest = 0;
};
SheetExtremes sheet_extremes(const SheetShape& shape, const SheetProblem::Path& path);

}  // namespace withe
