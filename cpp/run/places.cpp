#include "run/places.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

#include "common/text.hpp"
#include "model/edge_vectors.hpp"

namespace withe {
namespace {

/// An edge as short as this, over its length at rest, is one that the motion crushes.
constexpr double kMinLength = 0.5;
/// An edge that turns by more than 120 degrees against the next, or is twisted so far from its natural twist, is too
/// long for the motion.
constexpr double kMaxTurn = 2.0 / 3.0 * std::numbers::pi;
/// Natural turns between edges [rad], and differences of the two stiffnesses over the greater one, that count.
constexpr double kMinNaturalTurn = 0.02, kMinAnisotropy = 0.01;
/// Stiffnesses of rods that differ by more leave few digits to the soft ones.
constexpr double kMaxStiffnessRatio = 1e6;

}  // namespace

Place place_of(const Model& model, int row) {
  if (row < 0) return {};
  const auto holds = [&](int first, int count) { return first <= row && row < first + count; };
  int node = -1;
  for (int i = 0; i < model.node_count; ++i)
    if (holds(model.node_dof[at(i)], model.dimension)) node = i;
  for (int f = 0; f < model.frame_count; ++f)
    if (holds(model.frame_dof[at(f)], model.frame_size())) node = model.frame_node[at(f)];
  for (const Hinge& hinge : model.hinges)
    if (holds(hinge.dof, 1)) node = model.frame_node[at(hinge.frame)];
  for (std::size_t e = 0; e < model.edge_dof.size(); ++e)
    if (holds(model.edge_dof[e], 1)) node = model.edge_tail[e];
  return place_of_node(model, node);
}

std::string name_of(const Model& model, int rod) {
  const RodDescription& of = model.description.rods[at(rod)];
  return (of.is_surface() ? "body '" : "rod '") + of.name + "'";
}

Place place_of_node(const Model& model, int node) {
  const std::vector<RodDescription>& rods = model.description.rods;
  for (std::size_t k = 0; k < rods.size(); ++k) {
    const auto& nodes = rods[k].nodes;
    const auto found = std::find(nodes.begin(), nodes.end(), node);
    if (found == nodes.end()) continue;
    const int place = static_cast<int>(found - nodes.begin());
    const std::string of = " of " + name_of(model, static_cast<int>(k));
    return {static_cast<int>(k), place, (rods[k].is_surface() ? "" : " at node " + std::to_string(place)) + of};
  }
  return {};
}

std::string crushed_edge(const Model& model, const State& state) {
  int shortest = -1;
  double least = kMinLength;
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.node_dof[at(model.edge_tail[at(e)])], b = model.node_dof[at(model.edge_head[at(e)])];
    const double length = (state.q.segment(b, model.dimension) - state.q.segment(a, model.dimension)).norm();
    if (length >= least * model.edge_length(e)) continue;
    least = length / model.edge_length(e);
    shortest = e;
  }
  if (shortest < 0) return "";
  return "; an edge is crushed to " + text(least, 2) + " of its length" +
         place_of_node(model, model.edge_tail[at(shortest)]).words +
         ", for example by a force above E A / 2 or an impact faster than sound in the "
         "rod, sqrt(E / density)";
}

std::string unresolved_mesh(const Model& model, const Parameters& parameters, const State& state,
                            const Configuration& c) {
  int node = -1;
  double greatest = kMaxTurn;
  const char* how = "";
  const auto see = [&](double angle, int where, const char* does) {
    if (!(std::abs(angle) > greatest)) return;
    greatest = std::abs(angle);
    node = where;
    how = does;
  };
  const auto see_twist = [&](double tau, const auto& kappa, double natural, int where) {
    const double x = kappa(0) * kappa(0) + kappa(1) * kappa(1);
    see(bend_factor(parameters.measure, x).value * tau - natural, where, "twists");
  };
  const auto angle = [](const Vec3d& a, const Vec3d& b) {
    return std::atan2(to_eigen(a).cross(to_eigen(b)).norm(), dot(a, b));
  };
  // True if natural curvature, or a section that bends more easily one way, turns with the natural twist. A single
  // stencil may be a motor.
  const auto winds = [&](std::size_t b) {
    const auto row = static_cast<Eigen::Index>(b);
    if (!(std::abs(parameters.bend_natural(row, 2)) > kMaxTurn)) return false;
    const auto stiffness = parameters.edge_bend.row(model.bend[b].edge[0]);
    return parameters.bend_natural.row(row).head<2>().norm() > kMinNaturalTurn ||
           std::abs(stiffness(0) - stiffness(1)) > kMinAnisotropy * stiffness.maxCoeff();
  };
  for (std::size_t b = 0; b < model.bend.size(); ++b) {
    const BendStencil& s = model.bend[b];
    const auto row = static_cast<Eigen::Index>(b);
    see(angle(s.sign[0] * c.edge[at(s.edge[0])].tangent, s.sign[1] * c.edge[at(s.edge[1])].tangent), s.node[1],
        "turns");
    if (model.planar()) continue;
    see_twist(state.bend_tau(row), c.bend_strain.row(row), parameters.bend_natural(row, 2), s.node[1]);
    if (winds(b) && b > 0 && winds(b - 1) && model.bend_owner[b].first == model.bend_owner[b - 1].first)
      see(parameters.bend_natural(row, 2), s.node[1], "is naturally twisted");
  }
  for (std::size_t h = 0; h < (model.planar() ? 0 : model.half.size()); ++h) {
    const FrameStencil& s = model.half[h];
    const auto row = static_cast<Eigen::Index>(h);
    see_twist(state.half_tau(row), c.half_strain.row(row), parameters.half_natural(row, 2),
              model.frame_node[at(s.frame)]);
  }
  if (node < 0) return "";
  return std::string("an edge ") + how + " by " + text(greatest * 180.0 / std::numbers::pi, 3) +
         " degrees against the next," + place_of_node(model, node).words + " (time " + text(state.time, 6) +
         " s): the mesh is too coarse for the motion, so that bending and twisting are "
         "not accurate. Use more nodes";
}

std::string what_to_try(const Model& model, const Options& options, const Parameters& parameters, const State& state,
                        const Configuration& c, bool slips) {
  if (options.integrator == Integrator::verlet)
    return "Try a smaller time_step, or an implicit integrator, which takes longer ones";
  if (!unresolved_mesh(model, parameters, state, c).empty()) return "Try more nodes there, or a gentler load or motion";
  if (!crushed_edge(model, state).empty())
    return "Try a smaller load, a slower motion, or a rod that stretches less easily";
  if (!options.adaptive && !options.tolerance) return "Try adaptive=True, or a smaller time_step";
  const VectorX& stretch = parameters.edge_stretch;
  Eigen::Index soft = 0, stiff = 0;
  const double least = stretch.minCoeff(&soft), greatest = stretch.maxCoeff(&stiff);
  if (greatest > kMaxStiffnessRatio * least)
    return "Try more similar stiffnesses: the stretching stiffnesses of rods '" +
           model.description.rods[at(model.edge_rod[at(static_cast<int>(soft))])].name + "' and '" +
           model.description.rods[at(model.edge_rod[at(static_cast<int>(stiff))])].name + "' differ by " +
           text(greatest / least, 2) + " times";
  if (options.integrator == Integrator::statics)
    return "Try a smaller change of load or motion per step, or "
           "integrator='backward_euler' with viscosity, which comes to rest after a jump";
  if (slips) return "Try a smaller time_step, or a greater slip_tolerance of enable_contact";
  if (options.integrator == Integrator::implicit_midpoint)
    return "Try integrator='energy_momentum', which conserves energy at any time_step, or "
           "'backward_euler', which damps motion that is too fast for the step";
  if (!parameters.viscous && options.integrator != Integrator::backward_euler)
    return "Try a smaller time_step, viscosity of the material, or "
           "integrator='backward_euler', which damps motion that is too fast for the step";
  return "Try a smaller time_step, or more max_halvings";
}

}  // namespace withe
