#pragma once
/// Loads that a user puts on: forces, moments, distributed loads, dead or following their edge.
///
/// A moment M does the work M . (t x dt + t dpsi) on an edge, so it is a pair of nodal forces and a torque
/// on theta; on a frame it is J(w)^T M. In space neither has a symmetric Jacobian; in a plane both do.

#include "elasticity/elements.hpp"

namespace withe {

enum class LoadShape { dead_node, follower, edge_moment, frame_moment };

/// One piece of a load: what it acts on, and how much of the load's value it is.
struct LoadPiece {
  LoadShape shape;
  int load;       ///< index of the load
  double weight;  ///< [-], or a length [m] for distributed loads
  int node = -1;
  int edge = -1;  ///< that carries a follower or takes a moment
  int frame = -1;
};

struct Loads {
  std::vector<LoadPiece> pieces;
  std::vector<Vector3> values;  ///< per load, world axes of the drawn scene [N], [N m], [N/m]
  bool unsymmetric = false;
};

/// Resolves the loads of a description: which node, edge or frame each acts on.
Loads resolve_loads(const Model& model);

/// Unknowns of a piece in the order of its Local; -1 where there is none.
int load_dofs(const Model& model, const LoadPiece& piece, int (&dofs)[kMaxLocal]);

/// Minus the generalised force, and minus its Jacobian (not symmetric in space).
void load_local(const Model& model, const State& state, const VectorX& q, const Configuration& c, const Loads& loads,
                const LoadPiece& piece, Local& out);

}  // namespace withe
