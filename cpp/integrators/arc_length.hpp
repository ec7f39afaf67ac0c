#pragma once
/// Paths of equilibria through limit points, by pseudo-arc-length continuation. The factor s is an unknown too, and a
/// step ends in the plane normal to the path's tangent (t, t_s) that lies an arc d away:
///   F(q, s) = 0,    t . W (q - q0) + w t_s (s - s0) = d,
/// solved with two right-hand sides of K = dF/dq [Riks 1979; Crisfield 1981; Keller 1977]. W weighs displacements over
/// the length of the scene, and angles, by the share of the rods that they belong to.

#include "integrators/homotopy.hpp"

namespace withe {

struct ArcOptions {
  double start = 0, end = 1;  ///< factors at which the path begins and ends
  int most_points = 1000;     ///< greatest number of points
  double turn = 0.1;          ///< greatest turn of an edge between two points, by the tangent [rad]
};

struct ArcPoint {
  double factor = 0;
  bool stable = false;  ///< true if no direction has negative stiffness at this factor
  bool limit = false;   ///< true if the factor has an extremum here
};

/// Function that is called at each point, with `state` at that point; see below for its result.
using ArcVisitor = std::function<void(const ArcPoint& point)>;

struct ArcResult {
  bool finished = false;  ///< true if the path reached its end, or the requested number of points
  double factor = 0;      ///< factor of the last point
  NewtonResult newton;
};

/// Follows the path from `state`, which is in equilibrium at the first factor.
ArcResult follow_arc(Equations& equations, const Newton& newton, const Options& options, Homotopy& path,
                     const ArcOptions& arc, State& state, NewtonWorkspace& work, const ArcVisitor& visit);

}  // namespace withe
