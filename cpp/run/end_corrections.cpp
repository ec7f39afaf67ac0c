#include "run/end_corrections.hpp"

#include <algorithm>
#include <cmath>

#include "model/edge_vectors.hpp"
#include "run/transfer.hpp"

namespace withe {
namespace {

/// A stencil that becomes stiffer or softer.
struct Changed {
  std::size_t end;  ///< among the model's uncorrected ones
  bool at_frame;
  Vector3 strain, stiffness, natural, moment_before, stiffness_before;
};

/// In the axes of a rod's directors.
Vector3 in_space(const Model& model, int edge, const Vector3& strain) {
  if (!model.planar()) return strain;
  const Vector2 bent = strain(0) * model.planar_components[at(model.edge_rod[at(edge)])];
  return {bent(0), bent(1), 0.0};
}

/// True if a scene has given up the correction of an end already.
bool is_uncorrected(const SceneDescription& scene, const UncorrectedEnd& end) {
  return std::any_of(scene.uncorrected_ends.begin(), scene.uncorrected_ends.end(),
                     [&](const UncorrectedEnd& e) { return e.is_of(end.edge, end.frame_first); });
}

/// Twice the energy of a component of the strain, from its moment.
double energy(const Vector3& moment, const Vector3& stiffness, int k) {
  return stiffness(k) > 0.0 ? moment(k) * moment(k) / stiffness(k) : 0.0;
}

/// Change of the rest strain that keeps the moment, for energies `stored` before and `kept` with the same moments.
Vector3 shift_of(const Changed& stencil, const Vector3& stored, const Vector3& kept) {
  Vector3 shift = Vector3::Zero();
  for (int k = 0; k < 3; ++k) {
    if (!(stencil.stiffness(k) > 0.0 && kept(k) > 0.0)) continue;
    const double moment = std::sqrt(stored(k) / kept(k)) * stencil.moment_before(k);
    shift(k) = stencil.strain(k) - stencil.natural(k) - moment / stencil.stiffness(k);
  }
  return shift;
}

}  // namespace

void keep_moments(const Model& old, const ElasticCoefficients& before, const Configuration& c, Model& model,
                  Parameters& parameters) {
  std::vector<UncorrectedEnd>& ends = model.description.uncorrected_ends;
  std::vector<Changed> changed;
  const auto add = [&](std::size_t end, bool at_frame, Eigen::Index row, Eigen::Index row_before) {
    const Vector3 s = measured(parameters.measure, (at_frame ? c.half_strain : c.bend_strain).row(row)),
                  k = (at_frame ? before.half_stiffness : before.bend_stiffness).row(row_before),
                  n = (at_frame ? before.half_natural : before.bend_natural).row(row_before);
    changed.push_back({end, at_frame, s, (at_frame ? parameters.half_stiffness : parameters.bend_stiffness).row(row),
                       (at_frame ? parameters.half_natural : parameters.bend_natural).row(row), k.cwiseProduct(s - n),
                       k});
  };
  std::vector<int> bends;  // of which one may lie between two ends
  for (std::size_t i = 0; i < ends.size(); ++i) {
    if (is_uncorrected(old.description, ends[i])) continue;
    const auto [half, bend] = model.uncorrected_ends[i];
    const Eigen::Index half_before = same_stencil(old, model.half[at(half)]),
                       bend_before = same_stencil(old, model.bend[at(bend)]);
    if (half_before < 0 || bend_before < 0) continue;
    add(i, true, half, half_before);
    if (std::find(bends.begin(), bends.end(), bend) != bends.end()) continue;
    bends.push_back(bend);
    add(i, false, bend, bend_before);
  }
  Vector3 stored = Vector3::Zero(), kept = stored;
  for (const Changed& stencil : changed)
    for (int k = 0; k < 3; ++k) {
      stored(k) += energy(stencil.moment_before, stencil.stiffness_before, k);
      kept(k) += energy(stencil.moment_before, stencil.stiffness, k);
    }
  for (const Changed& stencil : changed) {
    UncorrectedEnd& end = ends[stencil.end];
    const Vector3 shift = in_space(model, end.edge, shift_of(stencil, stored, kept));
    (stencil.at_frame ? end.at_frame : end.at_next) += shift;
    const Vector3 none = Vector3::Zero();
    add_offsets(model, stencil.end, stencil.at_frame ? shift : none, stencil.at_frame ? none : shift);
  }
  if (!changed.empty()) update_natural(model, parameters);
}

}  // namespace withe
