#pragma once
/// Stability of an equilibrium of the suspended sheet: sign of the second variation of its energy.

#include "elastica/sheet.hpp"

namespace withe {

/// True if the equilibrium is stable for the given pose of the tip: if the second variation of the energy,
///   integral of 2 b eta'^2 - ((R - W) sin(theta) + T cos(theta)) eta^2,
/// is positive for all admissible eta. These vanish at both ends, and the integrals of eta sin(theta) and
/// eta cos(theta) vanish. The elements are linear. For a stable equilibrium their matrix, bordered by the two
/// constraints, has exactly two negative eigenvalues [Maddocks 1985].
bool sheet_is_stable(const SheetShape& shape, const SheetProblem::Path& path);

}  // namespace withe
