#pragma once
/// Rods and nodes in messages about a run, and what may be the matter there.

#include <string>

#include "integrators/options.hpp"
#include "model/model.hpp"
#include "model/state.hpp"

namespace withe {

struct Place {
  int rod = -1, node = -1;  ///< -1: not known
  std::string words;        ///< " at node 3 of rod 'arm'", " of body 'ball'"; empty where it is not known
};

/// "rod 'arm'", or "body 'ball'" of a surface.
std::string name_of(const Model& model, int rod);
/// Place of a row of the residual.
Place place_of(const Model& model, int row);
Place place_of_node(const Model& model, int node);

/// Describes the edge that is crushed most; empty where none is.
std::string crushed_edge(const Model& model, const State& state);
/// Warning that an edge turns or twists too much against the next; empty where none does.
std::string unresolved_mesh(const Model& model, const Parameters& parameters, const State& state,
                            const Configuration& c);
/// One sentence about what may help where steps do not converge.
std::string what_to_try(const Model& model, const Options& options, const Parameters& parameters, const State& state,
                        const Configuration& c, bool slips);

}  // namespace withe
