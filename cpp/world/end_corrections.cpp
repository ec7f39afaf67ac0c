/// End corrections of bending that are given up while a scene runs, see `UncorrectedEnd`.

#include <algorithm>
#include <cmath>

#include "world/implementation.hpp"

namespace withe {
namespace {

/// A stencil that becomes stiffer or softer.
struct Changed {
  std::size_t end;  ///< among the model's uncorrected ones
  bool at_frame;
  Vector3 strain, stiffness, natural, moment_before, stiffness_before;
};

bool is_end(const UncorrectedEnd& a, const UncorrectedEnd& b) {
  return a.edge == b.edge && a.frame_first == b.frame_first;
}

/// Where a list has what is looked for, or -1.
template <class List, class Is>
Eigen::Index find_row(const List& list, const Is& is) {
  const auto found = std::find_if(list.begin(), list.end(), is);
  return found == list.end() ? -1 : found - list.begin();
}

/// In the axes of a rod's directors.
Vector3 in_space(const Model& model, int edge, const Vector3& strain) {
  if (!model.planar()) return strain;
  const Vector2 bent = strain(0) * model.planar_components[at(model.edge_rod[at(edge)])];
  return {bent(0), bent(1), 0.0};
}

}  // namespace

/// With the strains as they are, moments would jump by up to a sixth. Rest strains keep them: n' = s - f K (s - n) /
/// K', where f, which is 1 but for the change of the moment over an edge, keeps the energy. They are of first order in
/// the edge's length to either side of it, together of second.
void World::Implementation::keep_moments(const Model& old, const ElasticCoefficients& before) {
  std::vector<UncorrectedEnd>& ends = model.description.uncorrected_ends;
  const Configuration& c = configuration();
  std::vector<Changed> changed;
  const auto add = [&](std::size_t end, bool at_frame, const Columns3& strain, const MatrixX3& stiffness,
                       const MatrixX3& natural, Eigen::Index row, const Columns3& stiffness_before,
                       const Columns3& natural_before, Eigen::Index row_before) {
    const Vector3 s = measured(parameters.measure, strain.row(row)), k = stiffness_before.row(row_before),
                  n = natural_before.row(row_before);
    changed.push_back({end, at_frame, s, stiffness.row(row), natural.row(row), k.cwiseProduct(s - n), k});
  };
  std::vector<int> bends;  // of which one may lie between two ends
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto& known = old.description.uncorrected_ends;
    if (find_row(known, [&](const UncorrectedEnd& end) { return is_end(end, ends[i]); }) >= 0) continue;
    const auto [half, bend] = model.uncorrected_ends[i];
    const Eigen::Index old_half = find_row(old.half, [&](const FrameStencil& s) {
      return s.edge == ends[i].edge && s.frame_first == ends[i].frame_first;
    });
    const int* edge = model.bend[at(bend)].edge;
    const Eigen::Index old_bend =
        find_row(old.bend, [&](const BendStencil& s) { return s.edge[0] == edge[0] && s.edge[1] == edge[1]; });
    if (old_half < 0 || old_bend < 0) continue;
    add(i, true, c.half_strain, parameters.half_stiffness, parameters.half_natural, half, before.half_stiffness,
        before.half_natural, old_half);
    if (std::find(bends.begin(), bends.end(), bend) != bends.end()) continue;
    bends.push_back(bend);
    add(i, false, c.bend_strain, parameters.bend_stiffness, parameters.bend_natural, bend, before.bend_stiffness,
        before.bend_natural, old_bend);
  }
  Vector3 stored = Vector3::Zero(), kept = stored;
  const auto energy = [](const Vector3& moment, const Vector3& stiffness, int k) {
    return stiffness(k) > 0.0 ? moment(k) * moment(k) / stiffness(k) : 0.0;
  };
  for (const Changed& stencil : changed)
    for (int k = 0; k < 3; ++k) {
      stored(k) += energy(stencil.moment_before, stencil.stiffness_before, k);
      kept(k) += energy(stencil.moment_before, stencil.stiffness, k);
    }
  for (const Changed& stencil : changed) {
    Vector3 shift = Vector3::Zero();
    for (int k = 0; k < 3; ++k) {
      if (!(stencil.stiffness(k) > 0.0 && kept(k) > 0.0)) continue;
      const double moment = std::sqrt(stored(k) / kept(k)) * stencil.moment_before(k);
      shift(k) = stencil.strain(k) - stencil.natural(k) - moment / stencil.stiffness(k);
    }
    UncorrectedEnd& end = ends[stencil.end];
    shift = in_space(model, end.edge, shift);
    (stencil.at_frame ? end.at_frame : end.at_next) += shift;
    const Vector3 none = Vector3::Zero();
    add_offsets(model, stencil.end, stencil.at_frame ? shift : none, stencil.at_frame ? none : shift);
  }
  if (!changed.empty()) update_natural(model, parameters);
}

}  // namespace withe
