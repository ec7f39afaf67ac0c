#pragma once
/// Stretches of the skeleton along which the mask keeps its width.

#include <vector>

#include "vision/skeleton_line.hpp"

namespace withe {

struct WidthRun {
  int edge = -1;
  int first = 0;  ///< pixel of the edge
  int last = 0;
  double width = 0;  ///< width of the mask, from flank to flank [px]
  int length() const { return last - first + 1; }
};

/// Runs of every edge that is not removed, edge by edge and in order along each. Stretches shorter than one and a half
/// widths are none.
std::vector<WidthRun> find_width_runs(const SkeletonGraph& graph, const BitImage& mask);

/// The width of a single cable [px] that is narrower than `width`, if the picture has one to compare with: all long
/// runs are about one, two, ... times as wide as it. Otherwise 0.
double narrower_cable(const std::vector<WidthRun>& runs, double width);

/// Number of cables of a width that lie side by side in another one; 0 if it is not a multiple.
int count_strands(double width, double single);

}  // namespace withe
