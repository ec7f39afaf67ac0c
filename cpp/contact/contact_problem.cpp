#include "contact/contact_problem.hpp"

#include <algorithm>
#include <cmath>

namespace withe {
ContactParameters::ContactParameters(const Surfaces& surfaces, const Parameters& parameters)
    : version(parameters.version),
      gravity(parameters.gravity.norm()),
      slip_tolerance(parameters.surfaces.slip_tolerance) {
  const Model& model = surfaces.model();
  const double given = parameters.surfaces.contact_stiffness;
  least_stiffness.setConstant(static_cast<Eigen::Index>(model.description.rods.size()), given);
  edge_mass = parameters.edge_density.cwiseProduct(model.edge_arc);
  for (int e = 0; e < model.edge_count && !(given > 0.0); ++e) {
    const double r = surfaces.radius(e);
    if (!(r > 0.0)) continue;
    const double weight = parameters.edge_density(e) * model.edge_arc(e) * parameters.gravity.norm();
    const double force = weight + 1e-4 * parameters.edge_bend.row(e).maxCoeff() / (r * r);
    double& least = least_stiffness(model.edge_rod[at(e)]);
    least = std::max(least, force / (2.0 * kDepth * r));
  }
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

CurveDistance<double> ContactProblem::curve_at_start(const ContactPair& pair, Vec3d (&x)[4]) const {
  bodies.end_points(pair, start->q, x);
  return curve_distance(pair.piece, bodies.obstacle(pair), x, shift_of(pair));
}

void ContactProblem::start_points(const ContactPair& pair, Vec3d (&x)[4]) const {
  bodies.end_points(pair, start->q, x);
  const Vec3d way = shift_of(pair);
  x[2] -= way;
  x[3] -= way;
}

}  // namespace withe
