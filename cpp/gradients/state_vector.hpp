#pragma once
/// States as vectors relative to a reference: the difference of two states, and the state at a given difference.
///
/// A vector holds the free unknowns in their places, and then their rates: displacements of nodes, rotations of an
/// edge's directors about its tangent, Cayley vectors of rotations of joint frames, and angles of hinges. The rotation
/// of directors counts from the smallest rotation that carries the tangent of the reference along. To first order,
/// these are the variables of `StateAdjoint`.

#include "forces/custom_forces.hpp"
#include "model/state.hpp"

namespace withe {

/// Orthonormal basis of the unknowns that supports leave free, of size unknowns x free unknowns.
SparseMatrix free_basis(const Model& model);

/// Returns the difference of a state and a reference.
VectorX state_difference(const Model& model, const State& reference, const State& state);

/// Adds a difference to a state. Throws std::invalid_argument, and leaves the state unchanged, if an edge would fold
/// back onto the next edge or lose its length.
void displace_state(const Model& model, const VectorX& by, State& state);

}  // namespace withe
