#include "contact/bodies.hpp"

#include <algorithm>
#include <cmath>

namespace withe {
namespace {

// Angle up to which a direction counts as normal to a face, and two edges as parallel [rad].
constexpr double kFlat = 0.02;

/// True if a direction, from an edge of a body to another surface, is normal to a face beside the edge, or leans over
/// that face. Points of the face then touch the other surface, and not the edge.
bool leans_over_face(const Model& model, const VectorX& q, const EdgeFaces& beside, const Vec3d& edge,
                     const Vec3d& direction) {
  const auto over = [&](const Face& face, double side) {
    const Vec3d inward = side * cross(axes_of(model, q, face).normal, edge);
    return dot(direction, inward) > -kFlat * std::sqrt(dot(edge, edge));
  };
  return over(*beside.left, 1.0) || over(*beside.right, -1.0);
}

}  // namespace

ClosestPoints face_points(const ContactPair& pair, const Vec3d (&x)[4]) {
  const FaceVectors<double> v(x, pair.point);
  const double height = dot(v.point, v.edge) / pair.face->length;
  ClosestPoints c;
  c.s = pair.point;
  c.t = 0.0;
  c.between = (height / pair.face->length) * v.edge;
  c.square = height * height;
  return c;
}

double Bodies::place(std::span<const ObstaclePlace> places) {
  double square = 0.0;
  for (std::size_t o = 0; o < places.size(); ++o) {
    const Vec3d shift = places[o].point - obstacles[o].point;
    square = std::max(square, dot(shift, shift));
    obstacles[o].point = places[o].point;
    obstacles[o].other = places[o].other;
  }
  return std::sqrt(square);
}

void Bodies::end_points(const ContactPair& pair, const VectorX& q, Vec3d (&x)[4]) const {
  if (pair.curve()) {
    for (int i = 0; i < 4; ++i)
      x[i] = i < pair.piece.weights->nodes ? local_position(*model, q, pair.piece.node[i]) : Vec3d{};
    return;
  }
  x[0] = local_vector(*model, q, model->tail_dof[at(pair.key.a)]);
  x[1] = local_vector(*model, q, model->head_dof[at(pair.key.a)]);
  if (pair.key.b >= 0) {
    x[2] = local_vector(*model, q, model->tail_dof[at(pair.key.b)]);
    x[3] = local_vector(*model, q, model->head_dof[at(pair.key.b)]);
  } else {
    const Obstacle& o = obstacle(pair);
    x[2] = o.point;
    x[3] = o.other;
  }
}

void Bodies::values(const ContactPair& pair, const VectorX& q, double (&values)[kContactUnknowns]) const {
  std::fill(std::begin(values), std::end(values), 0.0);
  if (pair.curve()) {
    for (int i = 0; i < pair.piece.weights->nodes; ++i) {
      const int first = model->node_dof[at(pair.piece.node[i])];
      for (int k = 0; k < model->dimension; ++k) values[3 * i + k] = q(first + k);
    }
    for (int b = 0; b < pair.piece.weights->edges && !model->planar(); ++b)
      values[12 + b] = q(model->edge_dof[at(pair.piece.edge[b])]);
    return;
  }
  Vec3d x[4];
  end_points(pair, q, x);
  for (int i = 0; i < 4; ++i) {
    values[3 * i] = x[i].x;
    values[3 * i + 1] = x[i].y;
    values[3 * i + 2] = x[i].z;
  }
  if (model->planar()) return;
  values[12] = q(model->edge_dof[at(pair.key.a)]);
  if (pair.key.b >= 0) values[13] = q(model->edge_dof[at(pair.key.b)]);
}

CurveDistance<double> Bodies::piece_distance(const ContactPair& pair, const VectorX& q, const Vec3d& drift) const {
  const Obstacle& o = obstacle(pair);
  if (o.kind != ObstacleKind::plane) {
    Vec3d x[4];
    end_points(pair, q, x);
    return curve_distance(pair.piece, o, x, drift);
  }
  double height[3] = {};
  for (int i = 0; i < pair.piece.weights->nodes; ++i)
    height[i] = height_above(o, local_position(*model, q, pair.piece.node[i]), drift);
  return plane_distance(pair.piece, o, height);
}

Proximity Bodies::proximity(const ContactPair& pair, const VectorX& q, bool whole) const {
  Proximity p;
  Vec3d x[4];
  if (pair.curve()) {
    const Obstacle& o = obstacle(pair);
    p.curve = piece_distance(pair, q);
    p.distance = p.curve.distance;
    p.points.s = p.curve.s;
    p.normal = o.other;
    if (o.kind == ObstacleKind::plane) return p;
    end_points(pair, q, x);
    p.normal = direction_of(o, distance_to(o, curve_point(*pair.piece.weights, x, p.curve.s)));
    return p;
  }
  end_points(pair, q, x);
  if (pair.face != nullptr) {
    p.points = face_points(pair, x);
    const FaceDistance d = distance_from(*pair.face, axes_of(*model, q, *pair.face), x[0] + pair.point * (x[1] - x[0]));
    p.distance = std::sqrt(p.points.square);
    p.outside = d.outside;
    p.beyond = d.outside > 0.0 || d.height < 0.0;
    p.normal = (1.0 / std::max(std::sqrt(p.points.square), 1e-300)) * p.points.between;
    return p;
  }
  // Far apart by their middles: no need for more.
  const Vec3d middle = 0.5 * (x[0] + x[1] - x[2] - x[3]), u = x[1] - x[0], v = x[3] - x[2];
  const double size = 0.5 * (std::sqrt(dot(u, u)) + std::sqrt(dot(v, v))) + (1.0 + kMaxPatternDistance) * pair.reach();
  if (!whole && dot(middle, middle) > size * size) {
    p.distance = std::sqrt(dot(middle, middle)) - size + (1.0 + kMaxPatternDistance) * pair.reach();  // or more
    return p;
  }
  p.points = closest_points(x[0], x[1], x[2], x[3], pair.weight_a, pair.weight_b);
  p.distance = std::sqrt(p.points.square);
  const double length = std::sqrt(dot(p.points.between, p.points.between));
  p.normal = (1.0 / std::max(length, 1e-300)) * p.points.between;
  if (pair.beside_a.left != nullptr) {
    const double along = dot(cross(u, v), cross(u, v)) / (dot(u, u) * dot(v, v));
    const bool cross_inside = p.points.s_free && p.points.t_free && along > kFlat * kFlat;
    p.beyond = !cross_inside && (leans_over_face(*model, q, pair.beside_a, u, -p.normal) ||
                                 leans_over_face(*model, q, pair.beside_b, v, p.normal));
  }
  return p;
}

}  // namespace withe
