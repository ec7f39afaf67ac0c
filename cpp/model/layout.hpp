#pragma once
/// Order of the unknowns, and the unknowns that supports hold.

#include "model/model.hpp"

namespace withe {

/// Numbers the unknowns rod by rod and node by node. The unknowns of a frame come before its node, at the far end of a
/// rod after it; an angle comes after its node. A rod that starts at the end of the last rod follows it, so that chains
/// and clamped rods stay inside a band.
void lay_out_unknowns(Model& model);

/// Adds the unknowns that each support holds.
void add_constraints(Model& model);

}  // namespace withe
