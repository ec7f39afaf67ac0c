// Rounding error of a residual, which no iteration removes. Positions, angles and strains have errors of a few eps.
// Stiffness, or inertia in a short step, converts these errors into forces.

#include "steps/rounding.hpp"

#include <cmath>
#include <initializer_list>

#include "steps/elastic_forces.hpp"

namespace withe {
namespace {

void add_to_node(const Model& model, int node, double bound, VectorX& floor) {
  const int dof = model.node_dof[at(node)];
  for (int k = dof; k < dof + model.dimension; ++k) floor(k) += bound;
}

/// Rounding error of inertia. A part that has spun for a long time has turned by many radians. Sets the greatest
/// coordinate, and returns the greatest angle, one radian at least.
double set_inertial_bounds(const StepProblem& problem, const StepData& data, RoundingBounds& out) {
  const Model& model = problem.model;
  VectorX& floor = out.rows;
  floor = data.z.cwiseAbs();
  out.reach = 0.0;
  for (int dof : model.node_dof)
    for (int k = dof; k < dof + model.dimension; ++k) {
      out.reach = std::max(out.reach, floor(k));
      floor(k) = 0.0;
    }
  const double turned = std::max(1.0, floor.maxCoeff());
  floor.setConstant(turned);
  for (int dof : model.node_dof)
    for (int k = dof; k < dof + model.dimension; ++k) floor(k) = std::max(out.reach, 1e-300);
  const double rounding = problem.moves() ? kRounding / (problem.interval * problem.interval) : 0.0;
  floor.array() *= rounding * problem.mass.rows.array();
  if (!problem.moves() || model.planar()) return turned;
  for (int e = 0; e < model.edge_count; ++e) {
    // add_spin_couple: bounded by `spin` times the torque, and twice that for the couple.
    const Vec3d& spin = data.configuration.edge[at(e)].spin;
    const double couple = 3.0 * rounding * turned * problem.parameters->edge_inertia[e] * std::sqrt(dot(spin, spin));
    add_to_node(model, model.edge_tail[at(e)], couple, floor);
    add_to_node(model, model.edge_head[at(e)], couple, floor);
  }
  return turned;
}

}  // namespace

/// The rounding error of a strain is about eps (|x| / l + |theta|). Its stiffness converts it into a force that no
/// iteration removes. The curvature 2 tan(phi / 2) and its slope grow by a factor 2 / (1 + cos phi) per radian.
void set_rounding_bounds(const StepProblem& problem, StepData& data) {
  const ElasticCoefficients& k = acting_coefficients(problem, data);
  RoundingBounds& out = data.rounding;
  out.number = problem.number;
  const double turned = set_inertial_bounds(problem, data, out);
  VectorX& floor = out.rows;
  out.relative = kRounding * (out.reach / problem.model.shortest_length + turned);
  out.axial.resize(problem.model.edge_count);
  for (int e = 0; e < problem.model.edge_count; ++e)
    out.axial(e) = kRounding * k.stretch_stiffness(e) * (out.reach / problem.model.edge_length(e) + 1.0);
  const auto moment_of = [&](double stiffness, double length, const Vec3d& before, const Vec3d& after) {
    const double grown = 2.0 / (1.0 + dot(before, after));
    return 2.0 * kRounding * stiffness * (out.reach / length + turned) * grown * grown;
  };
  const auto bend_add = [&](double moment, double length, std::initializer_list<int> nodes,
                            std::initializer_list<int> angles) {
    const double force = moment / length;
    for (int node : nodes) add_to_node(problem.model, node, force, floor);
    if (!problem.model.planar())
      for (int edge : angles) floor(problem.model.edge_dof[at(edge)]) += moment;
  };
  for (std::size_t b = 0; b < problem.model.bend.size(); ++b) {
    const BendStencil& s = problem.model.bend[b];
    const auto i = static_cast<Eigen::Index>(b);
    const double length = std::min(problem.model.edge_length(s.edge[0]), problem.model.edge_length(s.edge[1]));
    const Vec3d before = static_cast<double>(s.sign[0] * s.sign[1]) * data.configuration.edge[at(s.edge[0])].tangent;
    const double stiffness = k.bend_stiffness.row(i).maxCoeff();
    bend_add(moment_of(stiffness, length, before, data.configuration.edge[at(s.edge[1])].tangent), length,
             {s.node[0], s.node[1], s.node[2]}, {s.edge[0], s.edge[1]});
  }
  for (std::size_t h = 0; h < problem.model.half.size(); ++h) {
    const FrameStencil& s = problem.model.half[h];
    const double length = problem.model.edge_length(s.edge);
    const double moment =
        moment_of(k.half_stiffness.row(static_cast<Eigen::Index>(h)).maxCoeff(), length,
                  data.configuration.attached[h].tangent, data.configuration.edge[at(s.edge)].tangent);
    bend_add(moment, length, {problem.model.edge_tail[at(s.edge)], problem.model.edge_head[at(s.edge)]}, {s.edge});
    for (int i = 0; i < problem.model.frame_size(); ++i) floor(problem.model.frame_dof[at(s.frame)] + i) += moment;
    if (s.hinge >= 0) floor(problem.model.hinges[at(s.hinge)].dof) += moment;
  }
}

}  // namespace withe
