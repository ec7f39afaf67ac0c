#pragma once
/// Actuation: the stress-free shapes of rods and the tensions of tendons, and linear interpolation between two of them.

#include <vector>

#include "model/model.hpp"
#include "model/state.hpp"

namespace withe {

/// Values of `natural_curvature`, `natural_twist`, `edge_natural_stretch` and `tendon_tension`.
struct Actuation {
  std::vector<MatrixX2> curvature;  ///< per rod and stencil [1/m]
  std::vector<VectorX> twist;       ///< per rod and stencil [rad/m]
  VectorX stretch;                  ///< per edge [-]
  VectorX tension;                  ///< per tendon [N]
};
Actuation actuation_of(const Parameters& parameters);
/// Strains (kappa1, kappa2, tau) of the stencils of a drawn rod, from its edges' tangents and first directors.
MatrixX3 drawn_strains(const MatrixX3& tangents, const MatrixX3& directors, bool closed);
/// Actuation under which a configuration is free of stress, as far as joints let it be found; tendons are slack.
Actuation relaxed_actuation(const Model& model, const Parameters& parameters, const Configuration& configuration);
/// Sets one between two; derived numbers follow.
void set_actuation_between(const Model& model, const Actuation& from, const Actuation& to, double fraction,
                           Parameters& parameters);

}  // namespace withe
