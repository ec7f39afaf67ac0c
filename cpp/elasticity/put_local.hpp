#pragma once
/// Converts forces on edges, directors and the frame of a stencil to rows and columns of its unknowns (see
/// elements.hpp).

#include "elasticity/bend_planar.hpp"
#include "elasticity/elements.hpp"
#include "elasticity/stretch.hpp"

namespace withe {

inline PlanarEdge<double> planar_edge(const EdgeFrame<double>& f, double sign = 1.0) {
  return {{sign * f.tangent.x, sign * f.tangent.y}, f.inverse_length};
}

/// The axial force n pulls along `direction`; see add_stretch_hessian.
inline void put_stretch(int dimension, const Vec3d& direction, const Vec3d& tangent, double force, double modulus,
                        double transverse, bool with_matrix, Local& out) {
  const int n = dimension;
  for (int i = 0; i < n; ++i) {
    out.gradient[i] = -force * direction[i];
    out.gradient[n + i] = force * direction[i];
  }
  if (!with_matrix) return;
  Mat3<double> H{};
  add_stretch_hessian(direction, tangent, modulus, transverse, H);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      out.hessian[i][j] = out.hessian[n + i][n + j] = H.row[i][j];
      out.hessian[i][n + j] = out.hessian[n + i][j] = -H.row[i][j];
    }
}

/// Bending of three nodes in a plane.
inline void put_planar_bend(const PlanarForces<double>& f, bool with_matrix, Local& out) {
  for (int k = 0; k < 2; ++k) {
    out.gradient[k] = -f.force[0][k];
    out.gradient[2 + k] = f.force[0][k] - f.force[1][k];
    out.gradient[4 + k] = f.force[1][k];
  }
  if (with_matrix) put_planar_matrix(f, out.hessian);
}

/// Bending of an edge next to a frame in a plane: the force on the edge's vector, the moment on the frame, and how they
/// change with the vector and the frame's angle.
struct PlanarHalfForces {
  Vec2<double> force;
  double moment;
  Mat2<double> edge_edge;
  Vec2<double> edge_frame, frame_edge;
  double frame_frame;
};
inline void put_planar_half(const PlanarHalfForces& f, bool with_matrix, Local& out) {
  for (int k = 0; k < 2; ++k) {
    out.gradient[k] = -f.force[k];
    out.gradient[2 + k] = f.force[k];
  }
  out.gradient[4] = f.moment;
  if (!with_matrix) return;
  for (int k = 0; k < 2; ++k) {
    for (int l = 0; l < 2; ++l) {
      out.hessian[k][l] = out.hessian[2 + k][2 + l] = f.edge_edge.row[k][l];
      out.hessian[k][2 + l] = out.hessian[2 + k][l] = -f.edge_edge.row[k][l];
    }
    out.hessian[k][4] = -f.edge_frame[k];
    out.hessian[2 + k][4] = f.edge_frame[k];
    out.hessian[4][k] = -f.frame_edge[k];
    out.hessian[4][2 + k] = f.frame_edge[k];
  }
  out.hessian[4][4] = f.frame_frame;
}

}  // namespace withe
