#pragma once
/// Messages about rods that are pressed by things that do not yield.

#include <string>

#include "integrators/dynamics.hpp"
#include "integrators/squeezed.hpp"

namespace withe {

/// Warning of two obstacles that press on both sides of a rod while no stiffness of contact is given; empty where there
/// are none.
std::string squeeze_warning(const Model& model, const Parameters& parameters, const Equations& system,
                            const State& state, StepWorkspace& work);

/// Throws ConvergenceFailure with the names of what is pressed.
[[noreturn]] void fail_squeezed(const Model& model, const Equations& system, const State& state,
                                const Squeezed& squeezed, double dt);

}  // namespace withe
