#include "contact/contact_problem.hpp"

#include <algorithm>
#include <cmath>

#include "model/edge_vectors.hpp"

namespace withe {
namespace {

// Bending force of a rod, EI / L^2, for a length L of this number of radii.
constexpr double kSlender = 100.0;

/// A surface has the mass of its body, without bound where this is held.
void set_body_masses(const Model& model, const Parameters& parameters, VectorX& edge_mass) {
  VectorX of_frame = VectorX::Zero(model.frame_count);
  for (int frame : model.body_frame) of_frame(frame) = parameters.added_mass(model.frame_node[at(frame)]);
  for (const CarriedPart& part : model.carried)
    if (part.is_node() && part.slide < 0) of_frame(part.frame) += parameters.added_mass(part.node);
  for (const CarriedPart& surface : model.carried)
    if (surface.edge >= 0) edge_mass(surface.edge) = surface.is_held ? INFINITY : of_frame(surface.frame);
}

bool by_bodies(const BodyOffset& a, const BodyOffset& b) { return a.rod != b.rod ? a.rod < b.rod : a.other < b.other; }

}  // namespace

ContactParameters::ContactParameters(const Surfaces& surfaces, const Parameters& parameters)
    : version(parameters.version),
      gravity(parameters.gravity.norm()),
      pull(in_axes(surfaces.model(), parameters.gravity)),
      slip_tolerance(parameters.surfaces.slip_tolerance) {
  const Model& model = surfaces.model();
  const double given = parameters.surfaces.contact_stiffness, light = model.description.contact.least_tolerance();
  least_stiffness.setConstant(static_cast<Eigen::Index>(model.description.rods.size()), given);
  firm_stiffness.setZero(least_stiffness.size());
  edge_mass = parameters.edge_density.cwiseProduct(model.edge_arc);
  set_body_masses(model, parameters, edge_mass);
  for (int e = 0; e < model.edge_count && !(given > 0.0); ++e) {
    const double r = surfaces.scale(e);
    if (!(r > 0.0) || !std::isfinite(edge_mass(e))) continue;
    // Bodies without weight have no stiffness either. They count as slowed by a depth from the slip tolerance.
    const double slowed = model.is_surface(e) ? slip_tolerance * slip_tolerance / (2.0 * kDepth * r) : 0.0;
    const double weight = edge_mass(e) * std::max(parameters.gravity.norm(), slowed);
    const double bends = parameters.edge_bend.row(e).minCoeff() / (kSlender * kSlender * r * r);
    double& firm = firm_stiffness(model.edge_rod[at(e)]);
    firm = std::max(firm, (weight / (light * light) + bends) / (2.0 * kDepth * r));
  }
  least_stiffness += light * firm_stiffness;
}

void ContactProblem::find_offsets() {
  offsets.clear();
  if (pressing == Pressing::still) return;
  const std::vector<ContactRecord>& records = start->contacts;
  if (std::all_of(records.begin(), records.end(), [](const ContactRecord& r) { return r.yielded == 0.0; })) return;
  offsets.reserve(records.size());
  for (const ContactRecord& r : records) {
    const int other = r.key.b < 0 ? r.key.b : model().edge_rod[at(r.key.b)];
    if (r.force > 0.0) offsets.push_back({model().edge_rod[at(r.key.a)], other, r.force, r.force * r.yielded});
  }
  std::sort(offsets.begin(), offsets.end(), by_bodies);
  std::size_t last = 0;
  for (std::size_t i = 1; i < offsets.size(); ++i) {
    if (by_bodies(offsets[last], offsets[i])) {
      offsets[++last] = offsets[i];
      continue;
    }
    offsets[last].force += offsets[i].force;
    offsets[last].moment += offsets[i].moment;
  }
  if (!offsets.empty()) offsets.resize(last + 1);
}

double ContactProblem::offset(const ContactPair& pair) const {
  const BodyOffset bodies{pair.rod_a, pair.key.b < 0 ? pair.key.b : pair.rod_b};
  const auto found = std::lower_bound(offsets.begin(), offsets.end(), bodies, by_bodies);
  if (found == offsets.end() || by_bodies(bodies, *found)) return 0.0;
  return std::min(found->moment / found->force, 2.0 * kDepth * pair.scale);
}

double ContactProblem::at_own_depth(double firm, double stiffness, double power) const {
  if (stiffness >= firm) return stiffness;
  return firm * std::max(std::pow(stiffness / firm, power), description().least_tolerance());
}

double ContactProblem::stiffness_to_bear(const ContactPair& pair, double force) const {
  return at_own_depth(firm_stiffness(pair), force / (2.0 * kDepth * pair.scale), 1.0 / 2.0);
}

double ContactProblem::stiffness_to_store(const ContactPair& pair, double energy) const {
  const double depth = kDepth * pair.scale;
  return at_own_depth(firm_stiffness(pair), energy / (depth * depth), 1.0 / 3.0);
}

double ContactProblem::stiffness_to_bear_more(double firm, double stiffness, double times) const {
  const double whole = stiffness < firm ? stiffness * stiffness / firm : stiffness;
  return at_own_depth(firm, times * whole, 1.0 / 2.0);
}

double ContactProblem::tolerance(const ContactPair& pair, double stiffness) const {
  const double firm = firm_stiffness(pair);
  if (fixed(pair) || stiffness >= firm) return pair.tolerance;
  return pair.tolerance * std::max(stiffness / firm, description().least_tolerance());
}

double ContactProblem::mass_of(const ContactPair& pair) const {
  const VectorX& mass = parameters->edge_mass;
  if (pair.curve() && pair.piece.weights->edges == 2)
    return 0.5 * (mass(pair.piece.edge[0]) + mass(pair.piece.edge[1]));
  return pair.key.b < 0 ? mass(pair.key.a) : std::min(mass(pair.key.a), mass(pair.key.b));
}

void ContactProblem::add_mass_slopes(const ContactPair& pair, double by, VectorX& edge_mass) const {
  if (pair.curve() && pair.piece.weights->edges == 2) {
    for (int edge : pair.piece.edge) edge_mass(edge) += 0.5 * by;
    return;
  }
  const VectorX& mass = parameters->edge_mass;
  edge_mass(pair.key.b < 0 || mass(pair.key.a) <= mass(pair.key.b) ? pair.key.a : pair.key.b) += by;
}

bool ContactProblem::turns(const ContactPair& pair) const {
  if (pair.curve()) return false;
  if (pressing == Pressing::mean_direction) return true;
  return pressing == Pressing::mean && pair.key.b >= 0 && (!frictional() || unsymmetric());
}

ClosestPoints ContactProblem::closest_at_start(const ContactPair& pair, Vec3d (&x)[4]) const {
  bodies.end_points(pair, start->q, x);
  const Vec3d way = shift_of(pair);
  x[2] -= way;
  x[3] -= way;
  if (pair.face != nullptr) return face_points(pair, x);
  return closest_points(x[0], x[1], x[2], x[3], pair.weight_a, pair.weight_b);
}

}  // namespace withe
