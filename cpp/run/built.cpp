#include "run/built.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "model/edge_vectors.hpp"
#include "run/grips.hpp"

namespace withe {
namespace {

/// Notes where rods are not drawn as they are free of stress, or tendons pull from the start.
void note_drawn_actuation(const Model& model, const Configuration& c, Settings& settings) {
  constexpr double kRounded = 1e-9;  // [rad] of a stencil
  const Actuation now = actuation_of(settings.parameters);
  settings.actuation_before = relaxed_actuation(model, settings.parameters, c);
  double apart = 0.0;
  for (std::size_t r = 0; r < now.curvature.size(); ++r) {
    if (now.twist[r].size() == 0) continue;
    const VectorX& voronoi = model.rod_voronoi[r];
    const MatrixX2 bent = now.curvature[r] - settings.actuation_before.curvature[r];
    const VectorX twisted = now.twist[r] - settings.actuation_before.twist[r];
    apart = std::max({apart, (voronoi.asDiagonal() * bent).cwiseAbs().maxCoeff(),
                      voronoi.cwiseProduct(twisted).cwiseAbs().maxCoeff()});
  }
  settings.actuation_changed = apart > kRounded || !now.tension.isZero(0.0);
}

}  // namespace

Built built_of(SceneDescription scene, const Options& options) {
  // Explicit steps would have to be shorter for the narrow contact of light loads.
  if (options.integrator == Integrator::verlet) scene.contact.light = 1.0;
  Built built;
  built.description = std::move(scene);
  built.drawn_contact = built.description.contact;
  built.options = options;
  return built;
}

Model model_of_active(Built& built, bool running) {
  const SceneDescription& description = built.description;
  const Model& model = built.model;
  SceneDescription active = description;
  active.supports.clear();
  std::vector<std::size_t> index;
  for (std::size_t s = 0; s < description.supports.size(); ++s) {
    if (s < model.supports.size() && !model.supports[s].active) continue;
    active.supports.push_back(description.supports[s]);
    index.push_back(s);
  }
  Model fresh = build_model(active, built.spatial ? std::optional<bool>(false) : built.options.planar);
  if (running && !model.planar() && fresh.planar()) {
    built.spatial = true;  // what kept the drawing from being planar is gone, but the state need not be in the plane
    fresh = build_model(active, false);
  }
  std::vector<Support> all(description.supports.size());
  for (std::size_t s = 0; s < all.size(); ++s) all[s].description = description.supports[s];
  for (std::size_t k = 0; k < index.size(); ++k) all[index[k]] = fresh.supports[k];
  fresh.supports = all;
  return fresh;
}

void begin_as_drawn(const Built& built, Running& running, Configuration& c) {
  const auto& [description, drawn_contact, options, model, spatial, left_by, separated, stable] = built;
  State& state = running.state;
  running.parameters = initial_parameters(model);
  running.parameters.lumped = options.integrator == Integrator::verlet;
  state = initial_state(model);
  running.ramps.natural.assign(description.rods.size(), NaturalRamp{});
  running.motions.assign(description.supports.size(), SupportMotion{});
  running.custom_force = MatrixX3::Zero(model.node_count, 3);
  running.custom_moments = MatrixX3::Zero(description.custom_moments ? model.node_count : 0, 3);
  compute_configuration(model, state, state.q, c);
  for (std::size_t s = 0; s < running.motions.size(); ++s) {
    SupportMotion& motion = running.motions[s];
    motion.position = motion.from_position = motion.to_position = node_position(model, state.q, model.supports[s].node);
    if (model.supports[s].is_hand()) grasp(model, c, static_cast<int>(s), state, running.motions);
  }
  note_drawn_actuation(model, c, running);
}

}  // namespace withe
