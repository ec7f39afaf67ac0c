#pragma once
/// End corrections of bending that are given up while a scene runs, see `UncorrectedEnd`.

#include "elasticity/elements.hpp"
#include "model/model.hpp"
#include "model/state.hpp"

namespace withe {

/// Keeps the moments at ends that `model` no longer corrects, but `old` did: `before` has the coefficients of `old`,
/// and `c` is the present configuration. With the strains as they are, moments would jump by up to a sixth. Rest
/// strains keep them: n' = s - f K (s - n) / K', where f, which is 1 but for the change of the moment over an edge,
/// keeps the energy. They are of first order in the edge's length on either side of it, and together of second order.
void keep_moments(const Model& old, const ElasticCoefficients& before, const Configuration& c, Model& model,
                  Parameters& parameters);

}  // namespace withe
