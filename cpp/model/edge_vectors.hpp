#pragma once
/// Vectors of edges among the unknowns, in space.

#include "geometry/vec3.hpp"
#include "model/model.hpp"

namespace withe {

/// From the tail of an edge to its head; of a configuration, of velocities, or of what multiplies rows.
inline Vec3d edge_vector(const Model& model, const VectorX& q, int edge) {
  const double *tail = &q[model.tail_dof[at(edge)]], *head = &q[model.head_dof[at(edge)]];
  return {head[0] - tail[0], head[1] - tail[1], head[2] - tail[2]};
}

/// Adds to the rows of an edge's head, and takes from those of its tail.
inline void add_to_edge(const Model& model, int edge, const Vec3d& force, VectorX& rows) {
  double *tail = &rows[model.tail_dof[at(edge)]], *head = &rows[model.head_dof[at(edge)]];
  const double component[3] = {force.x, force.y, force.z};
  for (int i = 0; i < 3; ++i) {
    head[i] += component[i];
    tail[i] -= component[i];
  }
}

}  // namespace withe
