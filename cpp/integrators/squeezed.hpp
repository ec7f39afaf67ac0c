#pragma once
/// Surfaces that are pressed into each other by what does not yield: a held node and an obstacle, two held nodes. No
/// stiffness of contact moves them, so that its force says nothing.

#include "steps/equations.hpp"

namespace withe {

/// Of the contacts of the present set the first that is deeper than a step may end with, and whose distance no unknown
/// that is free can change; -1: none. `scratch` has a number for each unknown.
int squeezed_contact(const Equations& equations, VectorX& scratch);

}  // namespace withe
