#include "steps/terms.hpp"

#include <algorithm>
#include <utility>

#include "steps/body_forces.hpp"
#include "steps/elastic_forces.hpp"
#include "steps/inertia.hpp"
#include "steps/joint_forces.hpp"
#include "steps/load_forces.hpp"
#include "steps/spring_forces.hpp"
#include "steps/tendon_forces.hpp"
#include "steps/torsion_forces.hpp"

namespace withe {

/// Inertia must follow the terms whose rows of frames it converts.
Terms make_terms(const Model& model, const Loads& loads, StepRule rule, bool exact) {
  const SceneDescription& scene = model.description;
  const bool moves = rule != StepRule::statics;
  Terms terms;
  const auto add = [&]<class Kind>(std::unique_ptr<Kind> term) {
    Kind* const out = term.get();
    terms.all.push_back(std::move(term));
    return out;
  };
  add(std::make_unique<ElasticForces>(model));
  const LoadForces* applied = nullptr;
  if (!loads.pieces.empty()) applied = add(std::make_unique<LoadForces>(model, loads));
  if (!scene.springs.empty()) add(std::make_unique<SpringForces>(model));
  if (!model.joint_angles.empty()) add(std::make_unique<JointForces>(model));
  if (!scene.tendons.empty()) add(std::make_unique<TendonForces>(model));
  if (!scene.torsions.empty()) add(std::make_unique<TorsionForces>(model));
  if (std::any_of(model.supports.begin(), model.supports.end(),
                  [](const Support& s) { return s.active && s.yields(); }))
    terms.hands = add(std::make_unique<HandForces>(model));
  if (moves && scene.fluid.model == FluidModel::resistive) add(std::make_unique<ResistiveForces>(model));
  if (scene.contact.any()) terms.contact = add(std::make_unique<ContactForces>(model));
  add(std::make_unique<Inertia>(model, exact));
  if (!model.loops.empty()) terms.loops = add(std::make_unique<LoopForces>(model));
  add(std::make_unique<Drag>());
  add(std::make_unique<Gravity>());
  if (scene.has_custom_force) terms.custom = add(std::make_unique<CustomTerm>(applied));
  if (moves && scene.fluid.model == FluidModel::stokeslets)
    terms.stokeslets = add(std::make_unique<StokesletForces>(model));
  return terms;
}

void for_each_stored(const Model& model, const PartNumbers& numbers, const VectorX& q, const Configuration& c,
                     const std::function<void(int, double)>& add) {
  for (std::size_t s = 0; s < model.description.springs.size(); ++s)
    add(model.description.springs[s].nodes[0], spring_energy(model, numbers, q, static_cast<int>(s)));
  for (std::size_t j = 0; j < model.joint_angles.size(); ++j)
    add(model.joint_angles[j].node, joint_energy(model, numbers, q, static_cast<int>(j)));
  for (std::size_t s = 0; s < model.description.torsions.size(); ++s) {
    const TorsionDescription& d = model.description.torsions[s];
    add(model.edge_tail[at(model.rod_first_edge[at(d.rods[0])] + d.edges[0])],
        torsion_energy(model, numbers, c, static_cast<int>(s)));
  }
}

double stored_energy(const Model& model, const PartNumbers& numbers, const VectorX& q, const Configuration& c) {
  double energy = 0.0;
  for_each_stored(model, numbers, q, c, [&](int, double stored) { energy += stored; });
  return energy;
}

namespace {

void add_asymmetries(const ContactForces* term, StepRule rule, std::vector<std::string>& found) {
  if (!term) return;
  const Contact& contact = term->contact();
  if (rule == StepRule::midpoint && !contact.surfaces().edges().empty() && !contact.frictional())
    found.emplace_back("contact of rods in midpoint steps");
  if (contact.unsymmetric()) found.emplace_back("implicit friction");
}

void add_asymmetries(const HandForces* hands, bool exact, std::vector<std::string>& found) {
  if (!hands) return;
  if (exact && hands->slips()) found.emplace_back("hands that slip");
  if (!exact && hands->rings().slips()) found.emplace_back("rings that rub or slip");
}

}  // namespace

std::vector<std::string> asymmetries_of(const Model& model, const Loads& loads, const Terms& terms, StepRule rule,
                                        bool exact) {
  const SceneDescription& scene = model.description;
  std::vector<std::string> found;
  if (scene.custom_implicit || (scene.has_custom_force && rule == StepRule::statics))
    found.emplace_back("custom forces that are solved for");
  if (loads.unsymmetric) found.emplace_back("follower loads or moments in 3D");
  if (rule == StepRule::energy_momentum) found.emplace_back("energy-momentum steps");
  if (rule == StepRule::midpoint && !model.carried.empty()) found.emplace_back("points of bodies in midpoint steps");
  add_asymmetries(terms.contact, rule, found);
  if (scene.fluid.model == FluidModel::resistive && rule != StepRule::statics)
    found.emplace_back("resistive-force theory");
  add_asymmetries(terms.hands, exact, found);
  if (!model.loops.empty()) found.emplace_back("closed loops of joints");
  if (exact && rule != StepRule::statics && (!model.planar() || rule != StepRule::backward_euler))
    found.emplace_back("every derivative of inertia and viscosity");
  return found;
}

}  // namespace withe
