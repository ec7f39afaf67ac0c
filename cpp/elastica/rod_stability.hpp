#pragma once
/// Stability of the equilibrium of a rod that is held at both ends.

#include "elastica/rod.hpp"

namespace withe {

/// True if a solved shape is a minimum of the energy while position and rotation of both ends are held, out of every
/// plane too. `twist_stiffness` is GJ [w Lgb^2]; the shape's points should be at most 0.15 Lgb apart.
///
/// Turned by small rotation vectors f(s), with stretch eliminated, the energy and its constraint change by
///   1/2 f'.K f' - 1/2 m.(f x f') + (1 + e)/2 ((n.t) f.f - (n.f) (t.f)) - (f.(t x n) - c.t)^2 / (2 EA)
///   + (1 + e) c.(f x t)
/// per length, c the multiplier that keeps the end where it is and K = EI (1 - tt) + GJ tt. The sign of the second
/// variation under constraints is read from the inertia of the bordered matrix [Maddocks 1985].
bool rod_is_stable(const RodShape& shape, double twist_stiffness);

}  // namespace withe
