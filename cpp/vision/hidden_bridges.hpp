#pragma once
/// Continues strands beneath other strands, from one visible piece to the next.

#include "vision/color_image.hpp"
#include "vision/crossing_zones.hpp"
#include "vision/strand_classes.hpp"

namespace withe {

/// Pairs ends of edges between which the mask is covered by strands of other colours, by least energy. `mask` is the
/// mask before the cuts between colours. The energy of a pair is its bending energy, plus a cost if the colours differ.
/// Pairs of clearly different colours are admitted only where the ends touch, as at a stripe; they are reported as
/// doubts. The skeleton of a piece about as long as wide is replaced by its centre. Each pair receives a zone of its
/// own, which is appended to `links.zones`.
void bridge_hidden(SkeletonGraph& graph, const BitImage& mask, const ColorImage& image, const StrandClasses& classes,
                   const ZoneOptions& options, Continuations& links);

/// Extends an end that disappears beneath another strand. Its true end lies anywhere beneath: the middle of the covered
/// stretch has the least greatest error.
void extend_beneath(const BitImage& mask, const StrandClasses& classes, double half_width, std::vector<Vector2>& end);

}  // namespace withe
