#include "contact/face.hpp"

#include <algorithm>
#include <cmath>

namespace withe {

Face::Face(const FaceDescription& description, int normal_edge, int aside_node, double edge_length)
    : edge(normal_edge),
      aside(aside_node),
      length(edge_length),
      depth(description.depth),
      outline(description.outline) {
  for (int k = 0; k < 2; ++k) {
    low[k] = std::min(outline.col(k).minCoeff(), outline.col(k + 2).minCoeff());
    high[k] = std::max(outline.col(k).maxCoeff(), outline.col(k + 2).maxCoeff());
  }
  size = std::sqrt(outline.leftCols<2>().rowwise().squaredNorm().maxCoeff());
}

double Face::outside(double x, double y) const {
  bool inside = false;
  double square = INFINITY;
  for (Eigen::Index i = 0; i < outline.rows(); ++i) {
    const double x0 = outline(i, 0), y0 = outline(i, 1), dx = outline(i, 2) - x0, dy = outline(i, 3) - y0;
    if ((y0 > y) != (outline(i, 3) > y) && x < x0 + (y - y0) / dy * dx) inside = !inside;
    const double t = std::clamp(((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy), 0.0, 1.0);
    const double px = x - x0 - t * dx, py = y - y0 - t * dy;
    square = std::min(square, px * px + py * py);
  }
  return inside ? 0.0 : std::sqrt(square);
}

FaceAxes::FaceAxes(const Vec3d& tail, const Vec3d& head, const Vec3d& aside) : origin(tail) {
  const Vec3d up = head - tail;
  normal = (1.0 / std::sqrt(dot(up, up))) * up;
  const Vec3d way = aside - tail, along = way - dot(way, normal) * normal;
  first = (1.0 / std::sqrt(dot(along, along))) * along;
  second = cross(normal, first);
}

FaceDistance distance_from(const Face& face, const FaceAxes& axes, const Vec3d& point) {
  const Vec3d way = point - axes.origin;
  FaceDistance d;
  d.height = dot(way, axes.normal);
  d.outside = face.outside(dot(way, axes.first), dot(way, axes.second));
  d.distance = std::sqrt(d.height * d.height + d.outside * d.outside);
  return d;
}

void face_gradient(const FaceVectors<double>& v, double share, double over, double (&out)[12]) {
  for (int k = 0; k < 3; ++k) {
    const double along = over * v.edge[k], turning = over * v.point[k];
    out[k] = (1.0 - share) * along;
    out[3 + k] = share * along;
    out[6 + k] = -along - turning;
    out[9 + k] = turning;
  }
}

}  // namespace withe
