#include "run/plan.hpp"

#include "common/instruction_set.hpp"
#include "common/text.hpp"
#include "run/step_watch.hpp"

namespace withe {
namespace {

/// Warns of rods whose edges are longer than the rod is thick: in contact they are chains of straight pieces.
void add_coarse_notes(const Model& model, std::vector<std::string>& notes) {
  for (std::size_t r = 0; r < model.description.rods.size(); ++r) {
    const VectorX& radius = model.description.rods[r].contact_radius;
    if (radius.size() == 0 || !(radius.minCoeff() > 0.0)) continue;
    const int first = model.rod_first_edge[r];
    const double ratio = (model.edge_length.segment(first, radius.size()).array() / (2.0 * radius.array())).maxCoeff();
    if (ratio <= 1.0 + 1e-9) continue;
    notes.push_back("warning: edges of rod '" + model.description.rods[r].name + "' are " + text(ratio) +
                    " times as long as the rod is thick, and touch as straight pieces: more nodes "
                    "make contact smooth");
  }
}

void add_contact_notes(const Model& model, const Options& options, const Contact* touching, double separated,
                       std::vector<std::string>& notes) {
  const ContactDescription& contact = model.description.contact;
  if (!contact.any()) {
    notes.emplace_back("no contact: no broad phase");
    return;
  }
  if (!contact.obstacles.empty())
    notes.push_back(std::to_string(contact.obstacles.size()) +
                    " obstacle(s): their terms stay between neighbouring nodes");
  notes.push_back(contact.rods ? "rods touch each other: they are coupled only where they are near"
                               : "rods do not touch each other: no broad phase");
  if (contact.rods) add_coarse_notes(model, notes);
  if (separated > 0.0)
    notes.push_back("rods that overlapped as drawn were moved apart, by up to " + std::to_string(separated) +
                    " m: they are stressed there");
  if (!touching->frictional()) notes.emplace_back("no friction: contact stays symmetric");
  if (options.integrator == Integrator::verlet && touching->regularises())
    notes.emplace_back(
        "static friction limits explicit steps to about slip_tolerance / (7.5 mu) "
        "times the mass of a node over its contact force, which is unknown before the "
        "run");
}

std::string fluid_note(const Model& model) {
  switch (model.description.fluid.model) {
    case FluidModel::resistive:
      return "fluid: resistive-force theory, implicit; rods do not interact through the "
             "fluid";
    case FluidModel::stokeslets:
      return "fluid: regularized Stokeslet segments couple all " + std::to_string(model.node_count) +
             " nodes, once a step by conjugate gradients; the matrix of the steps does not "
             "change";
    case FluidModel::none:
      break;
  }
  return "no fluid: its terms are left out";
}

}  // namespace

Plan plan_of(const Model& model, const Options& options, const Parameters& parameters, const Equations& scheme,
             const PlanHistory& history) {
  Plan plan;
  plan.stable_step = history.stable_step;
  plan.planar = model.planar();
  plan.unknowns = model.dof_count;
  plan.solver = options.integrator == Integrator::verlet ? "none (explicit)" : scheme.assembler().solver().name();
  auto& notes = plan.notes;
  if (model.planar()) {
    plan.plane_normal = model.plane->normal;
    notes.push_back(
        "planar: 2 unknowns per node, no twist; a scene that could buckle out of its "
        "plane stays in its plane (build(planar=False) to force 3D)");
  } else {
    notes.push_back("3D: " + (options.planar.has_value() && !*options.planar ? std::string("planar=False")
                              : history.left_plane                           ? std::string("the scene left its plane")
                                                                             : model.plane_reason));
  }
  if (!history.plane_left_by.empty()) notes.push_back("left the plane while running: " + history.plane_left_by);
  for (const std::string& reason : scheme.asymmetries()) notes.push_back("unsymmetric Jacobian: " + reason);
  if (parameters.held_lumped)
    notes.emplace_back(
        "fourth order, and a support has moved: the mass of edges that supports hold sits at their nodes");
  if (!parameters.dragged) notes.push_back("no drag: its terms are left out");
  notes.push_back(fluid_note(model));
  if (!parameters.viscous) notes.push_back("no viscosity: its terms are left out");
  for (const std::string& note : scheme.notes()) notes.push_back(note);
  if (model.description.loads.empty()) notes.push_back("no loads but gravity");
  add_contact_notes(model, options, scheme.contact(), history.separated, notes);
  for (const std::string& note : step_notes(model, options, parameters)) notes.push_back(note);
  notes.push_back("kernels: " + std::string(name_of(instruction_set())) +
                  (instruction_set() == InstructionSet::baseline ? ", 2 numbers at once" : ", 4 numbers at once"));
  return plan;
}

}  // namespace withe
