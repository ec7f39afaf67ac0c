#pragma once
/// State of a scene under another model of the same scene: a support was added or released, or the scene left its
/// plane.

#include "model/model.hpp"
#include "model/state.hpp"

namespace withe {

/// Row of a stencil in another model of the same scene, or -1.
Eigen::Index same_stencil(const Model& model, const BendStencil& stencil);
Eigen::Index same_stencil(const Model& model, const FrameStencil& stencil);
/// Half stencil in another model of the same scene at the end of an edge that is attached to a frame without a hinge; a
/// node may have several frames. -1: there is none.
Eigen::Index known_half(const Model& model, int frame, const Model& other);

/// The state under another model. Frames that the old model lacks are as drawn.
State transferred(const Model& old, const State& from, const Model& model);

}  // namespace withe
