#pragma once
/// Shapes of rods free of stress, and ways from one to another.

#include <vector>

#include "model/model.hpp"
#include "model/state.hpp"

namespace withe {

/// Rods free of stress: what `natural_curvature`, `natural_twist` and `edge_natural_stretch` say.
struct NaturalShape {
  std::vector<MatrixX2> curvature;  ///< per rod and stencil [1/m]
  std::vector<VectorX> twist;       ///< likewise [rad/m]
  VectorX stretch;                  ///< per edge [-]
};
NaturalShape natural_shape(const Parameters& parameters);
/// Strains (kappa1, kappa2, tau) of the stencils of a rod as it is drawn, by its edges' tangents and first directors.
MatrixX3 drawn_strains(const MatrixX3& tangents, const MatrixX3& directors, bool closed);
/// That of rods free of stress in a configuration, as far as what they are joined by lets it be told.
NaturalShape relaxed_shape(const Model& model, const Parameters& parameters, const Configuration& configuration);
/// One between two; derived numbers follow.
void set_natural_between(const Model& model, const NaturalShape& from, const NaturalShape& to, double fraction,
                         Parameters& parameters);

}  // namespace withe
