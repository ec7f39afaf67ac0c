#pragma once
/// Static equilibrium: along the path of equilibria that leads on from the present one; where that ends, by a descent
/// that cannot fail to go down; then away from saddles.

#include "integrators/homotopy.hpp"

namespace withe {

struct StaticResult {
  bool converged = false;
  bool stable = false;
  bool branch_changed = false;  ///< no path of equilibria without a jump or a saddle leads there
  bool restless = false;        ///< true if the search failed because loads without a potential drive the scene
  NewtonResult newton;
};

/// Brings `state` to equilibrium, with supports at their positions of `boundary` at 1. `Homotopy` applies forces out of
/// balance, natural shapes, tensions and the motion of supports, in steps in which no edge turns far. The stiffness of
/// contacts follows their forces, also the forces of the solution. Surfaces that are too deep in each other are then no
/// longer in balance (`Contact::presses_alike`). `before` is the previous actuation, if it has changed.
StaticResult find_equilibrium(Equations& equations, const Newton& newton, const Options& options,
                              Parameters& parameters, const Actuation* before, const Boundary& boundary,
                              Saddles saddles, State& state, NewtonWorkspace& work);

}  // namespace withe
