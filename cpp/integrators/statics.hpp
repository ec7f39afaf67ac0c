#pragma once
/// Static equilibrium: along the path of equilibria that leads on from the present one; where that ends, by a descent
/// that cannot fail to go down; then away from saddles.

#include "integrators/homotopy.hpp"

namespace withe {

struct StaticResult {
  bool converged = false;
  bool stable = false;
  bool branch_changed = false;  ///< no path of equilibria without a jump or a saddle leads there
  bool restless = false;        ///< where none was found: loads without a potential still drive the scene round
  NewtonResult newton;
};

/// Brings `state` to equilibrium, with supports where `boundary` has them at 1. Loads that are out of
/// balance at the start, natural shapes, tensions and the motion of supports are let in as `Homotopy` has it, in steps
/// in which no edge turns far. Stiffness of contacts follows their forces, also those that are found: where surfaces
/// are too deep in each other they are in balance no more (`Contact::presses_alike`). `before`: actuation that the
/// state came with, if it has changed since.
StaticResult find_equilibrium(Equations& equations, const Newton& newton, const Options& options,
                              Parameters& parameters, const Actuation* before, const Boundary& boundary,
                              Saddles saddles, State& state, NewtonWorkspace& work);

}  // namespace withe
