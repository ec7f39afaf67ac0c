#pragma once
/// Static equilibrium from far away: load steps, then a descent that cannot fail to go down, then away
/// from saddles.

#include <functional>

#include "integrators/newton.hpp"

namespace withe {

struct StaticResult {
  bool converged = false;
  bool stable = false;
  NewtonResult newton;
};

/// Sets the held unknowns of q for a fraction of the way from the present supports to the wanted ones.
using Boundary = std::function<void(double fraction, const State& start, VectorX& q)>;

/// Brings `state` to equilibrium. Loads and natural shapes that are out of balance at the start are let in
/// step by step: F(q) = (1 - fraction) F(start).
StaticResult find_equilibrium(Equations& equations, const Newton& newton, const Options& options,
                              const Parameters& parameters, const Boundary& boundary, State& state,
                              NewtonWorkspace& work);

}  // namespace withe
