#pragma once
/// Loads that a user puts on: forces, moments, distributed loads, dead or following their edge, and pressure.
///
/// A moment M does the work M . (t x dt + t dpsi) on an edge, so it is a pair of nodal forces and a torque
/// on theta; on a frame it is J(w)^T M, and on what turns about a hinge's axis a of it M . a on the hinge too. In space
/// neither has a symmetric Jacobian; in a plane both do. One that follows turns with the edge or frame that it acts on,
/// dM = dphi x M with dphi that frame's turn.
///
/// A pressure p n pushes an edge e by p n x e, half of it on either node: per present length p, normal to the edge and
/// to n. Along a closed rod that is minus the gradient of p times the area that it goes round about n, so that the
/// Jacobian is symmetric; the ends of an open one leave an antisymmetric part.

#include "elasticity/elements.hpp"

namespace withe {

enum class LoadShape { dead_node, follower, edge_moment, frame_moment, edge_pressure };

/// One piece of a load: what it acts on, and its value.
struct LoadPiece {
  LoadShape shape;
  int load;       ///< row of `Parameters::loads`; -1: a custom moment on the node
  double weight;  ///< how much of the value it is [-], or over which length [m]
  int node = -1;
  int edge = -1;  ///< that carries a follower or takes a moment
  int frame = -1;
  int hinge = -1;         ///< in space: of the frame, that what a moment acts on turns about
  bool follower = false;  ///< of a moment: whether it turns with its edge or frame
  bool along = false;     ///< of a load along a rod: whether its weight is a part of the edge's length
};

struct Loads {
  std::vector<LoadPiece> pieces;
  int node_moments = 0;  ///< nodes that custom moments may act on
  bool unsymmetric = false;
};

/// Resolves the loads of a description: which node, edge or frame each acts on.
Loads resolve_loads(const Model& model);

/// True if the forces of a piece and its like along the rod are minus the gradient of a potential.
bool has_potential(const Model& model, const LoadPiece& piece);

/// Unknowns of a piece in the order of its Local; -1 where there is none.
int load_dofs(const Model& model, const LoadPiece& piece, int (&dofs)[kMaxLocal]);

/// Minus the generalised force of a piece of a load of that value, and minus its Jacobian (not symmetric in space). The
/// energy is that of a pressure, which sums to a potential along closed rods; of others it is zero.
void load_local(const Model& model, const State& state, const VectorX& q, const Configuration& c,
                const LoadPiece& piece, const Vector3& load, Local& out);

}  // namespace withe
