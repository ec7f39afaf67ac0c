#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include "common/text.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

/// An edge as short as this, over its length at rest, is one that the motion crushes.
constexpr double kCrushed = 0.5;
/// An edge that turns or twists by more than 120 degrees against the next is too long for the motion: a stencil that
/// twists by tau bends with cos^2(tau / 2) of its stiffness.
constexpr double kSharp = 2.0 / 3.0 * std::numbers::pi;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

/// Rod and node of a row of the residual, and how to say it; -1 and nothing where it is not known.
World::Implementation::Place World::Implementation::place_of(int row) const {
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
  return place_of_node(node);
}

World::Implementation::Place World::Implementation::place_of_node(int node) const {
  for (std::size_t k = 0; k < description.rods.size(); ++k) {
    const auto& nodes = description.rods[k].nodes;
    const auto found = std::find(nodes.begin(), nodes.end(), node);
    if (found == nodes.end()) continue;
    const int place = static_cast<int>(found - nodes.begin());
    return {static_cast<int>(k), place,
            " at node " + std::to_string(place) + " of rod '" + description.rods[k].name + "'"};
  }
  return {};
}

/// Says so where an edge is crushed; nothing elsewhere.
std::string World::Implementation::crushed() const {
  int shortest = -1;
  double least = kCrushed;
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.node_dof[at(model.edge_tail[at(e)])], b = model.node_dof[at(model.edge_head[at(e)])];
    const double length = (state.q.segment(b, model.dimension) - state.q.segment(a, model.dimension)).norm();
    if (length >= least * model.edge_length(e)) continue;
    least = length / model.edge_length(e);
    shortest = e;
  }
  if (shortest < 0) return "";
  return "; an edge is crushed to " + text(least, 2) + " of its length" +
         place_of_node(model.edge_tail[at(shortest)]).words +
         ", as by a force above E A / 2 or a blow faster than sound in the rod, sqrt(E / density)";
}

/// Says so where an edge turns or twists too much against the next; nothing elsewhere.
std::string World::Implementation::unresolved() const {
  int node = -1;
  double greatest = kSharp;
  const char* how = "";
  const auto see = [&](double angle, int where, const char* does) {
    if (!(std::abs(angle) > greatest)) return;
    greatest = std::abs(angle);
    node = where;
    how = does;
  };
  for (std::size_t b = 0; b < model.bend.size(); ++b) {
    const int* n = model.bend[b].node;
    const Vector3 middle = node_position(model, state.q, n[1]);
    const Vector3 before = middle - node_position(model, state.q, n[0]),
                  after = node_position(model, state.q, n[2]) - middle;
    see(std::atan2(before.cross(after).norm(), before.dot(after)), n[1], "turns");
    if (!model.planar()) see(state.bend_tau(static_cast<Eigen::Index>(b)), n[1], "twists");
  }
  for (std::size_t h = 0; h < (model.planar() ? 0 : model.half.size()); ++h)
    see(state.half_tau(static_cast<Eigen::Index>(h)), model.frame_node[at(model.half[h].frame)], "twists");
  if (node < 0) return "";
  return std::string("an edge ") + how + " by " + text(greatest * 180.0 / std::numbers::pi, 3) +
         " degrees against the next" + place_of_node(node).words + " (time " + text(state.time, 6) +
         " s): a mesh this coarse does not resolve the motion, and bends and twists wrongly; use more nodes";
}

/// Warns once.
void World::Implementation::check_resolution() {
  if (warning) return;
  if (std::string found = unresolved(); !found.empty()) warning = std::move(found);
}

std::string World::take_warning() {
  std::optional<std::string>& warning = implementation_->warning;
  return warning ? std::exchange(*warning, {}) : "";
}

void World::Implementation::fail(const NewtonResult& r, double dt, const std::string& what) const {
  const Place place = place_of(r.worst_row);
  throw ConvergenceFailure(what + " (time " + text(state.time, 6) + " s, step " + text(dt) + " s, residual " +
                               text(r.residual) + " N" + place.words + ")" + crushed() +
                               "; the world is left in its last accepted state",
                           state.time, dt, place.rod, place.node, r.residual);
}

}  // namespace withe
