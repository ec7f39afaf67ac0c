#pragma once
/// States as vectors, beside another one: how a state differs from a reference, and what is reached from there.
///
/// A vector has what supports leave free, in the places of the unknowns: displacements of nodes, turns of an edge's
/// directors about its tangent (beyond the smallest turn that takes the tangent of the reference along), Cayley vectors
/// of the turns of joints' frames, and angles of hinges; then the rates of all these. To first order it is what
/// `StateAdjoint` has derivatives by.

#include "forces/custom_forces.hpp"
#include "model/state.hpp"

namespace withe {

/// Columns: an orthonormal basis of what supports leave free, all unknowns x free unknowns.
SparseMatrix free_basis(const Model& model);

/// From a reference to a state.
VectorX state_difference(const Model& model, const State& reference, const State& state);

/// Adds such a vector to a state. Throws std::invalid_argument, with the state as it was, where an edge would be folded
/// back onto the next or lose its length.
void displace_state(const Model& model, const VectorX& by, State& state);

}  // namespace withe
