#pragma once
/// Rods put elsewhere while a scene runs: positions, frames and rates from outside.

#include <vector>

#include "run/running.hpp"

namespace withe {

/// State that a rod is to take; what is empty stays as it is.
struct RodState {
  int rod = 0;
  MatrixX3 positions;   ///< per node [m]
  MatrixX3 directors;   ///< first ones, per edge; given where positions are
  VectorX twists;       ///< per stencil [rad/m]: which of the angles that fit the directors; given where they are
  MatrixX3 velocities;  ///< per node [m/s]
  VectorX spins;        ///< per edge, angular velocity about the tangent [rad/s]
};

/// Throws std::invalid_argument unless the tables have the shapes of the rod.
void check_shapes(const Model& model, const RodState& rod);
/// True if a state of a rod leaves the plane of a planar scene.
bool leaves_plane(const Model& model, const State& state, const RodState& rod);
/// Sets nodes, frames and the branches of twists. Returns whether a node of each rod has moved; empty if no positions
/// were given. Throws std::invalid_argument where a support holds a node that would move, or an edge has no length.
std::vector<bool> place_rods(const Model& model, const Parameters& parameters, const std::vector<RodState>& rods,
                             Moving& now);
void set_rates(const Model& model, const std::vector<RodState>& rods, State& state);

}  // namespace withe
