#pragma once
/// Rods that are joined in a row: in line, so that each is bent against the next one as if they were one rod.

#include "model/model.hpp"

namespace withe {

/// Returns the edge of the next rod in a row that continues after the last edge of a rod (`behind`), or the edge of the
/// previous rod before its first edge. Returns -1 if there is none, or if more than two rods meet.
inline int next_in_row(const Model& model, int edge, bool behind) {
  const auto e = static_cast<std::size_t>(edge);
  const int node = behind ? model.edge_head[e] : model.edge_tail[e];
  int stencils = 0, found = -1;
  for (const int b : model.bend_across) {
    const BendStencil& s = model.bend[static_cast<std::size_t>(b)];
    if (s.node[1] != node) continue;
    ++stencils;
    if (s.edge[behind ? 0 : 1] == edge && s.sign[0] > 0 && s.sign[1] > 0) found = s.edge[behind ? 1 : 0];
  }
  return stencils == 1 ? found : -1;
}

}  // namespace withe
