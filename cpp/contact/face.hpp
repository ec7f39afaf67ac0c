#pragma once
/// Contact of points with the faces of rigid bodies.
///
/// A face is a region of a plane, a little below the surface that touches. The body carries an edge along the normal of
/// the face. It goes from a point b0 of the plane to b1, and has the length L. The distance of a point p from the plane
/// is then bilinear in the points,
///   D = |(p - b0) . (b1 - b0)| / L.
/// Its change in a step is exactly G . (x1 - x0), where G has the means of both factors. With n = (b1 - b0) / L and
/// y = p - b0 in the middle of the step, the forces along G are n on p, -n - y / L on b0 and y / L on b1. Their sum and
/// the sum of their moments are zero. Pressing along G therefore keeps energy, momentum and angular momentum.
///
/// A point touches the face while its foot lies inside the outline of the face. Elsewhere the edges of the body touch.

#include <vector>

#include "common/dual.hpp"
#include "geometry/vec3.hpp"
#include "model/model.hpp"

namespace withe {

struct Face {
  int edge = -1;                     ///< the edge along the normal
  int aside = -1;                    ///< node of the body that shows the direction of the first axis of the outline
  double length = 0;                 ///< L [m]
  double depth = 0;                  ///< of the plane below the surface [m]
  double size = 0;                   ///< greatest distance of the outline from b0 [m]
  MatrixX4 outline;                  ///< segments x0, y0, x1, y1 in the axes of the face about b0 [m]
  double low[2] = {}, high[2] = {};  ///< bounds of the outline [m]

  Face(const FaceDescription& description, int normal_edge, int aside_node, double edge_length);
  /// Distance of a point of the plane from the outline; 0: inside [m].
  double outside(double x, double y) const;
};

/// The faces on both sides of an edge of a body, as it is seen from outside.
struct EdgeFaces {
  const Face *left = nullptr, *right = nullptr;
};

/// Axes of a face in space.
struct FaceAxes {
  Vec3d origin, first, second, normal;

  /// b0, b1, and the place of the node aside.
  FaceAxes(const Vec3d& tail, const Vec3d& head, const Vec3d& aside);
};

/// A point beside a face.
struct FaceDistance {
  double height = 0;    ///< above the plane; negative below [m]
  double outside = 0;   ///< distance of its foot from the outline [m]
  double distance = 0;  ///< from the face [m]
};
FaceDistance distance_from(const Face& face, const FaceAxes& axes, const Vec3d& point);

/// End points of an edge and its point p = x0 + share (x1 - x0), b0 and b1, as vectors p - b0 and b1 - b0.
template <class Scalar>
struct FaceVectors {
  Vec3<Scalar> point, edge;

  FaceVectors(const Vec3<Scalar> (&x)[4], double share)
      : point(x[0] + share * (x[1] - x[0]) - x[2]), edge(x[3] - x[2]) {}
  /// The side on which the point is, over L.
  double over(const Face& face) const { return (value_of(dot(point, edge)) < 0.0 ? -1.0 : 1.0) / face.length; }
};

/// Gradient of D over the four end points, from the two vectors, or from their means in a step.
void face_gradient(const FaceVectors<double>& v, double share, double over, double (&out)[12]);
/// Adds `factor` times the second derivative of D, which is constant.
template <int Stride>
void add_face_hessian(double share, double factor, double (&out)[Stride][Stride]) {
  const double w[4] = {1.0 - share, share, -1.0, 0.0}, e[4] = {0.0, 0.0, -1.0, 1.0};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      for (int k = 0; k < 3; ++k) out[3 * i + k][3 * j + k] += factor * (w[i] * e[j] + e[i] * w[j]);
}

}  // namespace withe
