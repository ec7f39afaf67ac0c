#pragma once
/// Colours across a wide line, which may be one cable or several.

#include <optional>
#include <vector>

#include "vision/color_image.hpp"
#include "vision/width_runs.hpp"

namespace withe {

/// Changes of hue across a run, as fractions of its width from the left. It has to along all of it: a stripe of
/// light on a cable has its hue, and a rope's twisted threads are on either side in turn.
std::vector<double> hue_borders(const ColorImage& image, const SkeletonLine& line, const WidthRun& run);

/// Share of the brightness across a run that does not fit `count` equal strands, from 0 for strands that look alike to
/// about 1 for a single round cable. Empty if the brightness varies too little to decide.
std::optional<double> shading_misfit(const ColorImage& image, const SkeletonLine& line, const WidthRun& run, int count);

}  // namespace withe
