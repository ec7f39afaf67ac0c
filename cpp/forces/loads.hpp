#pragma once
/// Loads of the user: forces, moments, distributed loads, dead or following their edge, and pressure.
///
/// A moment M does the work M . (t x dt + t dpsi) on an edge, so it is a pair of nodal forces and a torque on theta. On
/// a frame it is J(w)^T M. On the turning part of a hinge with axis a it also adds M . a to the hinge. In space the
/// Jacobians are not symmetric; in a plane they are. A following moment turns with its edge or frame, dM = dphi x M,
/// where dphi is the rotation of the frame.
///
/// A pressure p n pushes an edge e by p n x e, half of it on either node. The force per present length is p, normal to
/// the edge and to n. Along a closed rod the force is minus the gradient of p times the area that the rod encloses
/// about n, so the Jacobian is symmetric. The ends of an open rod leave an antisymmetric part.

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
