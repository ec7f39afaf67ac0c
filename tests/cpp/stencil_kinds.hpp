#pragma once
/// Kinds of elastic stencils, their number in a model, and their unknowns.

#include "states.hpp"

namespace withe::testing {

enum class Kind { stretch, bend, half };
constexpr Kind kKinds[] = {Kind::stretch, Kind::bend, Kind::half};
inline const char* name_of(Kind kind) {
  return kind == Kind::stretch ? "stretch" : kind == Kind::bend ? "bend-twist" : "half stencils";
}

inline void append(std::vector<int>& dofs, int first, int count) {
  for (int i = 0; i < count; ++i) dofs.push_back(first + i);
}

/// Unknowns of a stencil in the order that elements.hpp gives; -1 for a hinge that is not there.
inline std::vector<int> dofs_of(const Model& m, Kind kind, int i) {
  std::vector<int> dofs;
  const auto node = [&](int n) { append(dofs, m.node_dof[at(n)], m.dimension); };
  const auto angle = [&](int edge) {
    if (!m.planar()) dofs.push_back(m.edge_dof[at(edge)]);
  };
  if (kind == Kind::stretch) {
    node(m.edge_tail[at(i)]);
    node(m.edge_head[at(i)]);
  } else if (kind == Kind::bend) {
    const BendStencil& s = m.bend[at(i)];
    node(s.node[0]);
    angle(s.edge[0]);
    node(s.node[1]);
    angle(s.edge[1]);
    node(s.node[2]);
  } else {
    const FrameStencil& s = m.half[at(i)];
    node(m.edge_tail[at(s.edge)]);
    angle(s.edge);
    node(m.edge_head[at(s.edge)]);
    append(dofs, m.frame_dof[at(s.frame)], m.frame_size());
    if (!m.planar()) dofs.push_back(s.hinge < 0 ? -1 : m.hinges[at(s.hinge)].dof);
  }
  return dofs;
}

inline int count_of(const Model& m, Kind kind) {
  return kind == Kind::stretch ? m.edge_count : static_cast<int>(kind == Kind::bend ? m.bend.size() : m.half.size());
}

}  // namespace withe::testing
