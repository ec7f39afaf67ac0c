#pragma once
/// Order of the unknowns, and what supports take away from them.

#include "model/model.hpp"

namespace withe {

/// Numbers the unknowns rod by rod, node by node (a frame before its node, at the far end of a rod after it; an angle
/// after its node), going on to a rod that starts where the last one ended, so that chains and clamped rods stay
/// inside a band.
void lay_out_unknowns(Model& model);

/// Which unknowns each support holds.
void add_constraints(Model& model);

}  // namespace withe
