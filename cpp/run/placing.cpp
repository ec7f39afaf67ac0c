#include "run/placing.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "common/check.hpp"
#include "common/text.hpp"
#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"
#include "run/frames.hpp"
#include "run/hold.hpp"
#include "run/places.hpp"
#include "steps/ring_forces.hpp"

namespace withe {
namespace {

constexpr double kMaxHeldMove = 1e-9;      // of the scene's length, or rad: what rounding may have moved
constexpr double kMaxMisalignment = 1e-6;  // rad: directors from outside are no better

/// Moves each ring to the present place of its rod. A ring slips where it cannot hold the rod, and lets go of a rod
/// whose end has passed.
void update_rings(const Model& model, State& state) {
  for (std::size_t s = 0; s < model.supports.size(); ++s) {
    if (!model.supports[s].active || !model.supports[s].slides()) continue;
    RingState& ring = state.hands[s].ring;
    const Passage now = passage_of(model, state, static_cast<int>(s));
    ring.place = now.place;
    ring.slip += now.slipped;
    ring.left = ring.left || now.place.beyond;
  }
}

/// True if a support that was moved at once is moved now instead of in the next step, because its nodes are placed at
/// its target. `there` has the held unknowns at the target.
bool arrives(const Model& model, int support, const std::vector<bool>& given, const VectorX& q, Moving& now,
             HeldTarget& there) {
  const Support& held = model.supports[at(support)];
  SupportMotion& motion = now.motions[at(support)];
  if (held.yields() || !motion.jumps()) return false;
  const Vector3 before = motion.position;
  motion.position = motion.to_position;
  hold(model, now, poses_of(now.motions), there);
  for (const Constraint& c : model.constraints)
    for (int node : held.nodes)
      if (c.first == model.node_dof[at(node)] &&
          !(given[at(node)] && c.held_change(there.q, q).norm() <= kMaxHeldMove * model.length_scale)) {
        motion.position = before;
        return false;
      }
  return true;
}

/// Unknowns with nodes at their given positions. Throws std::invalid_argument where a held node would move.
VectorX placed(const Model& model, const std::vector<RodState>& rods, Moving& now) {
  const State& state = now.state;
  VectorX q = state.q;
  std::vector<bool> given(at(model.node_count), false);
  for (const RodState& rod : rods)
    for (Eigen::Index i = 0; i < rod.positions.rows(); ++i) {
      const int node = model.description.rods[at(rod.rod)].nodes[static_cast<std::size_t>(i)],
                dof = model.node_dof[at(node)];
      const VectorX before = q.segment(dof, model.dimension);
      put_node(model, node, rod.positions.row(i), q);
      require(
          !given[at(node)] || (before - q.segment(dof, model.dimension)).norm() <= kMaxHeldMove * model.length_scale,
          "positions of rods that share a node must agree" + place_of_node(model, node).words);
      given[at(node)] = true;
    }
  HeldTarget there;
  for (int s = 0; s < static_cast<int>(model.supports.size()); ++s) {
    const Support& support = model.supports[at(s)];
    if (!support.active) continue;
    const bool arrived = arrives(model, s, given, q, now, there), moves = state.time < now.motions[at(s)].shift.end;
    for (int node : support.nodes) {
      for (const Constraint& c : model.constraints) {
        if (c.first != model.node_dof[at(node)]) continue;
        const Vector3 moved = c.held_change(arrived ? there.q : state.q, q);
        require(moved.norm() <= kMaxHeldMove * model.length_scale,
                "positions must not move a node that a support holds, but do by " + text(moved.norm()) + " m" +
                    place_of_node(model, node).words +
                    (moves ? ": the support is on a ramp (over=), so move the support without over=, or "
                             "release it"
                           : ": move the support there first, or release it"));
        q.segment(c.first, c.size) -= moved.head(c.size);
      }
    }
  }
  for (int e = 0; e < model.edge_count; ++e) {
    const double length =
        (q.segment(model.head_dof[at(e)], model.dimension) - q.segment(model.tail_dof[at(e)], model.dimension)).norm();
    require(length > 1e-6 * model.edge_length(e),
            "positions must not give an edge zero length" + place_of_node(model, model.edge_tail[at(e)]).words);
  }
  return q;
}

/// Directors of a rod whose nodes are at q, which supports held as they were before; and the branches of its twists.
void place_directors(const Model& model, const RodState& rod, const VectorX& q, const Configuration& before,
                     const std::vector<SupportMotion>& motions, State& state) {
  for (Eigen::Index e = 0; e < rod.directors.rows(); ++e) {
    const int edge = model.rod_first_edge[at(rod.rod)] + static_cast<int>(e);
    const std::string where = place_of_node(model, model.edge_tail[at(edge)]).words;
    const Vector3 t = (q.segment<3>(model.head_dof[at(edge)]) - q.segment<3>(model.tail_dof[at(edge)])).normalized();
    const Vector3 given = rod.directors.row(e);
    require(std::abs(given.norm() - 1.0) < kMaxMisalignment && std::abs(given.dot(t)) < kMaxMisalignment,
            "directors must be unit vectors normal to their edges" + where);
    const Vector3 d1 = (given - t * t.dot(given)).normalized();
    const Vector3 now = to_eigen(before.edge[at(edge)].d1);
    for (std::size_t s = 0; s < model.supports.size(); ++s) {
      const Support& support = model.supports[s];
      const bool holds =
          support.active && std::find(support.edges.begin(), support.edges.end(), edge) != support.edges.end();
      const bool turns = state.time <= motions[s].turn.end && motions[s].rotation != motions[s].to_rotation;
      require(!holds || (d1 - now).norm() < kMaxMisalignment,
              "directors must not turn an edge that a support holds" + place_of_node(model, support.node).words +
                  (turns ? ": the support is on a ramp (over=), so call step() first, or release the "
                           "support"
                         : ": turn the support first, and call step(), or release the support"));
    }
    state.tangent[at(edge)] = to_vec3(t);
    state.director[at(edge)] = to_vec3(d1);
    state.q(model.edge_dof[at(edge)]) = 0.0;
  }
  const auto& places = model.place[at(rod.rod)];
  for (Eigen::Index s = 0; s < rod.twists.size(); ++s) {
    const StencilPlace& place = places[static_cast<std::size_t>(s)];
    if (place.bend >= 0) state.bend_tau(place.bend) = rod.twists(s) * model.bend_voronoi(place.bend);
    for (int h : place.half)
      if (h >= 0) state.half_tau(h) = rod.twists(s) * model.half_voronoi(h);
  }
}

/// True for each rod of which a node has moved.
std::vector<bool> moved_rods(const Model& model, const VectorX& before, const VectorX& now) {
  std::vector<bool> moved;
  for (const RodDescription& rod : model.description.rods)
    moved.push_back(std::any_of(rod.nodes.begin(), rod.nodes.end(), [&](int node) {
      const int dof = model.node_dof[at(node)];
      return before.segment(dof, model.dimension) != now.segment(dof, model.dimension);
    }));
  return moved;
}

}  // namespace

void check_shapes(const Model& model, const RodState& rod) {
  const int rods = static_cast<int>(model.description.rods.size());
  require(rod.rod >= 0 && rod.rod < rods, "no such rod: ", rod.rod);
  const Eigen::Index nodes = static_cast<Eigen::Index>(model.description.rods[at(rod.rod)].nodes.size()),
                     edges = model.rod_first_edge[at(rod.rod) + 1] - model.rod_first_edge[at(rod.rod)],
                     stencils = static_cast<Eigen::Index>(model.place[at(rod.rod)].size());
  const auto fits = [](const auto& values, Eigen::Index rows) {
    return (values.rows() == 0 || values.rows() == rows) && values.allFinite();
  };
  require(fits(rod.positions, nodes) && fits(rod.velocities, nodes), "positions and velocities need a row a node");
  require(fits(rod.directors, edges) && fits(rod.spins, edges), "directors and spins need a row an edge");
  require(fits(rod.twists, stencils) && (rod.twists.size() > 0 || rod.directors.rows() == 0 || stencils == 0),
          "twists need a number a stencil");
  require(rod.directors.rows() > 0 || rod.positions.rows() == 0, "positions need directors");
}

bool leaves_plane(const Model& model, const State& state, const RodState& rod) {
  if (!model.planar()) return false;
  const Plane& plane = *model.plane;
  const auto off = [&](const MatrixX3& rows, const Vector3& origin, double scale) {
    return rows.rows() > 0 && ((rows.rowwise() - origin.transpose()) * plane.normal).cwiseAbs().maxCoeff() > scale;
  };
  if (off(rod.positions, plane.origin, kMaxHeldMove * model.length_scale)) return true;
  if (rod.velocities.rows() > 0 &&
      off(rod.velocities, Vector3::Zero(), kMaxHeldMove * rod.velocities.cwiseAbs().maxCoeff()))
    return true;
  if ((rod.spins.array() != 0.0).any() || (rod.twists.array().abs() > kMaxMisalignment / model.length_scale).any())
    return true;
  // In its plane an edge turns its drawn directors about the normal.
  for (Eigen::Index e = 0; e < rod.directors.rows(); ++e) {
    const int edge = model.rod_first_edge[at(rod.rod)] + static_cast<int>(e);
    const auto& nodes = model.description.rods[at(rod.rod)].nodes;
    const auto in_space = [&](Eigen::Index i) -> Vector3 {
      if (rod.positions.rows() > 0) return rod.positions.row(i);
      return node_position(model, state.q, nodes[static_cast<std::size_t>(i)]);
    };
    const Vector3 drawn = to_eigen(model.initial_tangent[at(edge)]), d1 = to_eigen(model.initial_director[at(edge)]),
                  now = in_space((e + 1) % static_cast<Eigen::Index>(nodes.size())) - in_space(e);
    const double angle = std::atan2(drawn.cross(now).dot(plane.normal), drawn.dot(now));
    if ((rotation_exp(angle * plane.normal) * d1 - rod.directors.row(e).transpose()).norm() > kMaxMisalignment)
      return true;
  }
  return false;
}

std::vector<bool> place_rods(const Model& model, const Parameters& parameters, const std::vector<RodState>& rods,
                             Moving& now) {
  std::vector<bool> is_set(at(model.edge_count), false);
  for (const RodState& rod : rods)
    for (Eigen::Index e = 0; e < rod.directors.rows(); ++e)
      is_set[at(model.rod_first_edge[at(rod.rod)] + static_cast<int>(e))] = true;
  if (std::find(is_set.begin(), is_set.end(), true) == is_set.end()) return {};
  State& state = now.state;
  const VectorX q = placed(model, rods, now), start = state.q;
  Configuration c;
  compute_configuration(model, state, state.q, c);
  const Configuration before = c;
  compute_configuration(model, state, q, c);
  if (!model.planar()) {
    for (int e = 0; e < model.edge_count; ++e)
      require(is_set[at(e)] || dot(before.edge[at(e)].tangent, c.edge[at(e)].tangent) > -1.0 + 1e-6,
              "positions must not turn an edge of another rod by half a turn" +
                  place_of_node(model, model.edge_tail[at(e)]).words);
    const VectorX bend_tau = state.bend_tau, half_tau = state.half_tau;
    accept_configuration(model, q, c, state);
    // Frames of edges that are given are theirs; which turn a twist is in follows from what is given too.
    for (std::size_t b = 0; b < model.bend.size(); ++b) {
      const auto i = static_cast<Eigen::Index>(b);
      if (is_set[at(model.bend[b].edge[0])] || is_set[at(model.bend[b].edge[1])]) state.bend_tau(i) = 0.0;
    }
    for (std::size_t h = 0; h < model.half.size(); ++h)
      if (is_set[at(model.half[h].edge)]) state.half_tau(static_cast<Eigen::Index>(h)) = 0.0;
    for (const RodState& rod : rods) place_directors(model, rod, q, before, now.motions, state);
  } else {
    state.q = q;
  }
  relax_joints(model, parameters, is_set, state);
  compute_configuration(model, state, state.q, c);
  require(c.bend_strain.allFinite() && c.half_strain.allFinite(), "positions must not fold an edge back onto the next");
  accept_configuration(model, VectorX(state.q), c, state);
  update_rings(model, state);
  return moved_rods(model, start, state.q);
}

void set_rates(const Model& model, const std::vector<RodState>& rods, State& state) {
  std::vector<bool> is_set(at(model.edge_count), false);
  for (const RodState& rod : rods) {
    const int first = model.rod_first_edge[at(rod.rod)], end = model.rod_first_edge[at(rod.rod) + 1];
    if (rod.velocities.rows() > 0 || rod.spins.size() > 0)
      for (int e = first; e < end; ++e) is_set[at(e)] = true;
    const std::vector<int>& nodes = model.description.rods[at(rod.rod)].nodes;
    for (Eigen::Index i = 0; i < rod.velocities.rows(); ++i)
      put_node_vector(model, nodes[static_cast<std::size_t>(i)], rod.velocities.row(i), state.v);
    if (!model.planar())
      for (Eigen::Index e = 0; e < rod.spins.size(); ++e)
        state.v(model.edge_dof[at(first + static_cast<int>(e))]) = rod.spins(e);
  }
  turn_frames(model, is_set, state);
}

}  // namespace withe
