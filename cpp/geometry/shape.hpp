#pragma once
/// Solids of any shape. A new one is a class with a distance, its constructor in `bindings/bind_model.cpp`, a class of
/// `withe.solids`, and a line of `parts/obstacle_shapes.py`.

#include "geometry/vec3.hpp"

namespace withe {

/// Distance of a point from a solid, and its first two derivatives.
struct ShapeDistance {
  double distance = 0;    ///< [m]
  Vec3d normal{};         ///< its gradient, which is continuous near the surface [-]
  Mat3<double> change{};  ///< its second derivative [1/m]
};

/// A solid in axes of its own. Its surface is where the distance is its radius.
class Shape {
 public:
  virtual ~Shape() = default;
  virtual ShapeDistance distance(const Vec3d& x) const = 0;
  /// Radius of the solid about its middle surface; 0 if distances are from the surface, and negative inside [m].
  virtual double radius() const = 0;
  /// Radius of the channel in which rods lie; infinite if there is none [m].
  virtual double channel() const = 0;
};

}  // namespace withe
