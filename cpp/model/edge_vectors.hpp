#pragma once
/// Vectors of nodes, frames and edges among the unknowns.

#include "geometry/vec3.hpp"
#include "model/model.hpp"

namespace withe {

/// A vector in space, in the axes of the unknowns of nodes: in a plane its two, and zero.
inline Vec3d in_axes(const Model& model, const Vector3& v) {
  if (model.planar()) return {v.dot(model.plane->first), v.dot(model.plane->second), 0.0};
  return to_vec3(v);
}

/// Vector of a node, in the axes of space: velocities, or multipliers of rows; in a plane positions are from its
/// origin.
inline Vector3 node_vector(const Model& model, const VectorX& v, int node) {
  const int dof = model.node_dof[at(node)];
  if (!model.planar()) return v.segment<3>(dof);
  return v(dof) * model.plane->first + v(dof + 1) * model.plane->second;
}

/// Vector of a frame, in the axes of space: its spin, of velocities, or its angular momentum.
inline Vector3 frame_vector(const Model& model, const VectorX& v, int frame) {
  const int dof = model.frame_dof[at(frame)];
  return model.planar() ? Vector3(v(dof) * model.plane->normal) : Vector3(v.segment<3>(dof));
}

/// Position of a node in space, from any configuration vector.
inline Vector3 node_position(const Model& model, const VectorX& q, int node) {
  const Vector3 place = node_vector(model, q, node);
  return model.planar() ? Vector3(model.plane->origin + place) : place;
}

/// Sets the rows of a node to a vector in the axes of space.
inline void put_node_vector(const Model& model, int node, const Vector3& vector, VectorX& rows) {
  const int dof = model.node_dof[at(node)];
  if (model.planar())
    rows.segment<2>(dof) << vector.dot(model.plane->first), vector.dot(model.plane->second);
  else
    rows.segment<3>(dof) = vector;
}

/// Puts a node to a position in space, in any configuration vector.
inline void put_node(const Model& model, int node, const Vector3& position, VectorX& q) {
  put_node_vector(model, node, model.planar() ? Vector3(position - model.plane->origin) : position, q);
}

/// Adds a vector in the axes of space to the rows of a node.
inline void add_to_node(const Model& model, int node, const Vector3& by, VectorX& rows) {
  const int dof = model.node_dof[at(node)];
  if (model.planar())
    rows.segment<2>(dof) += Vector2(by.dot(model.plane->first), by.dot(model.plane->second));
  else
    rows.segment<3>(dof) += by;
}

/// Vector from the tail of an edge to its head; in a plane in the axes of the plane, as tangents are. The argument is a
/// configuration, velocities, or a multiplier of rows.
inline Vec3d edge_vector(const Model& model, const VectorX& q, int edge) {
  const double *tail = &q[model.tail_dof[at(edge)]], *head = &q[model.head_dof[at(edge)]];
  return {head[0] - tail[0], head[1] - tail[1], model.planar() ? 0.0 : head[2] - tail[2]};
}

/// Adds a vector to the rows of an edge's head, and subtracts it from those of its tail; in a plane in its axes.
inline void add_to_edge(const Model& model, int edge, const Vec3d& force, VectorX& rows) {
  double *tail = &rows[model.tail_dof[at(edge)]], *head = &rows[model.head_dof[at(edge)]];
  const double component[3] = {force.x, force.y, force.z};
  for (int i = 0; i < (model.planar() ? 2 : 3); ++i) {
    head[i] += component[i];
    tail[i] -= component[i];
  }
}

}  // namespace withe
