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

/// One piece of a load: the node, edge or frame on which it acts, and its value.
struct LoadPiece {
  LoadShape shape;
  int load;       ///< row of `Parameters::loads`; -1: a custom moment on the node
  double weight;  ///< share of the value [-], or length over which it acts [m]
  int node = -1;
  int edge = -1;  ///< edge that carries a follower load or receives a moment
  int frame = -1;
  int hinge = -1;         ///< in space: hinge of the frame about which the loaded part turns
  bool follower = false;  ///< true if a moment turns with its edge or frame
  bool along = false;     ///< true if the weight is a part of the length of the edge (load along a rod)
};

struct Loads {
  std::vector<LoadPiece> pieces;
  int node_moments = 0;  ///< nodes that custom moments may act on
  bool unsymmetric = false;
};

/// Resolves the loads of a description: finds the node, edge or frame on which each acts.
Loads resolve_loads(const Model& model);

/// True if the forces of this piece, with all such pieces along the rod, are minus the gradient of a potential.
bool has_potential(const Model& model, const LoadPiece& piece);

/// Unknowns of a piece in the order of its Local; -1 where there is none.
int load_dofs(const Model& model, const LoadPiece& piece, int (&dofs)[kMaxLocal]);

/// Minus the generalised force of a piece for the value `load`, and minus its Jacobian (not symmetric in space). The
/// energy is only that of a pressure, whose sum along closed rods is a potential. For other loads it is zero.
void load_local(const Model& model, const State& state, const VectorX& q, const Configuration& c,
                const LoadPiece& piece, const Vector3& load, Local& out);

}  // namespace withe
