#pragma once
/// Reactions of supports from the residual of the last solve.

#include "run/running.hpp"

namespace withe {

/// Turns rows of frames that supports hold from forces on Cayley increments into moments. `turn`: share of the step's
/// turn at which the forces act. The residual of a frame's unknowns is J(w)^T moment, w the turn there.
void make_frame_moments(const Model& model, const VectorX& held, double turn, Found& found);

/// Reaction of a support on the rod in the last evaluation: about its node, that of a hand about the origin. `held`:
/// the rows of the residual that supports hold.
Wrench reaction_of(const Model& model, const Found& found, int support, const VectorX& held);

}  // namespace withe
