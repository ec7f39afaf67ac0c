/// Hands: what they hold as they grasp, where they put it, and their wrench.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include "common/check.hpp"
#include "geometry/frames.hpp"
#include "model/edge_vectors.hpp"
#include "steps/hand_forces.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

Vector3 point_on(const Model& model, const VectorX& q, int edge, double place) {
  return (1.0 - place) * node_position(model, q, model.edge_tail[at(edge)]) +
         place * node_position(model, q, model.edge_head[at(edge)]);
}

Vector3 curve_point(const Model& model, const VectorX& q, const RodCurve& curve, const SplinePlace& place) {
  const auto position = [&](int node) { return node_position(model, q, node); };
  return to_eigen(point_at(curve, place, position, Vector3::Zero()).across);
}

}  // namespace

bool World::Implementation::has_hands() const {
  return std::any_of(model.supports.begin(), model.supports.end(),
                     [](const Support& s) { return s.active && s.is_hand(); });
}

bool World::Implementation::has_rings() const {
  return std::any_of(model.supports.begin(), model.supports.end(),
                     [](const Support& s) { return s.active && s.slides(); });
}

std::vector<SupportPose> World::Implementation::support_poses() const {
  std::vector<SupportPose> poses;
  for (const SupportMotion& m : motions) poses.push_back(m.pose());
  return poses;
}

/// Whether one that yields does.
bool World::Implementation::hands_move(const std::vector<SupportMotion>& from,
                                       const std::vector<SupportMotion>& to) const {
  for (std::size_t s = 0; s < to.size(); ++s)
    if (model.supports[s].active && model.supports[s].yields() &&
        (from[s].position != to[s].position || from[s].rotation != to[s].rotation || to[s].roll != Vector3::Zero() ||
         from[s].fed != to[s].fed))
      return true;
  return false;
}

double World::Implementation::hand_energy_of(int hand) const {
  return hand_energy(model, parameters.measure, state, configuration(), hand);
}

/// A hand takes what it touches as it is now.
void World::Implementation::grasp(int hand) {
  const Support& s = model.supports[at(hand)];
  SupportMotion& m = motions[at(hand)];
  const Configuration& c = configuration();
  const HandDescription& own = description.supports[at(hand)].hand;
  m = SupportMotion{};
  const RingState ring = s.slides() ? RingState{s.curve.place(own.at), own.at, 0.0, 0.0, false} : RingState{};
  const Vector3 taken =
      s.slides() ? curve_point(model, state.q, s.curve, ring.place) : point_on(model, state.q, s.at_edge, s.at_place);
  m.position = own.posed ? own.position : taken;
  m.feed_rate = own.feed_rate;
  m.feeds_since = state.time;
  m.rotation = own.posed ? own.rotation : edge_directors(model, c, s.at_edge);
  m.from_position = m.to_position = m.position;
  m.from_rotation = m.to_rotation = m.rotation;
  m.shift = m.turn = {state.time, state.time};
  HandState& held = state.hands[at(hand)];
  held = HandState{m.position, m.rotation, {}, {}, {}, {}, ring};
  const Matrix3 into = m.rotation.transpose();
  for (const TouchedEdge& touched : s.touched) held.edges.push_back(into * edge_directors(model, c, touched.edge));
  if (!s.yields()) {
    for (int node : s.span) held.points.push_back(into * (node_position(model, state.q, node) - m.position));
    return;
  }
  if (s.slides()) {
    held.points = {into * (taken - m.position)};
    return;
  }
  for (const TouchedEdge& touched : s.touched)
    held.points.push_back(into * (point_on(model, state.q, touched.edge, touched.place) - m.position));
  held.slip.assign(s.touched.size(), Vector3::Zero());
  held.twist.setZero(static_cast<Eigen::Index>(s.touched.size()));
}

/// A hand that comes to hold a node that another has held between them takes it where it is now.
void World::Implementation::regrip(const std::vector<std::vector<int>>& held_before) {
  for (std::size_t h = 0; h < model.supports.size(); ++h) {
    const Support& s = model.supports[h];
    if (!s.active || !s.is_hand() || state.hands[h].points.size() != s.span.size() || h >= held_before.size()) continue;
    for (int node : s.nodes) {
      if (std::find(held_before[h].begin(), held_before[h].end(), node) != held_before[h].end()) continue;
      const auto i = std::find(s.span.begin(), s.span.end(), node) - s.span.begin();
      state.hands[h].points[static_cast<std::size_t>(i)] =
          motions[h].rotation.transpose() * (node_position(model, state.q, node) - motions[h].position);
    }
  }
}

/// Edges after all nodes: one between two hands has a node of either.
void World::Implementation::hold_hands(const std::vector<SupportPose>& supports, HeldTarget& target) const {
  for (std::size_t h = 0; h < model.supports.size(); ++h) {
    const Support& s = model.supports[h];
    for (std::size_t i = 0; s.active && i < s.span.size(); ++i)
      if (std::find(s.nodes.begin(), s.nodes.end(), s.span[i]) != s.nodes.end())
        put_node(model, s.span[i], supports[h].position + supports[h].rotation * state.hands[h].points[i], target.q);
  }
  for (std::size_t h = 0; h < model.supports.size(); ++h) {
    const Support& s = model.supports[h];
    if (s.active && s.is_hand() && !s.yields() && !hold_edges(static_cast<int>(h), supports[h].rotation, target.q))
      target.reachable = false;
  }
}

bool World::Implementation::hold_edges(int hand, const Matrix3& rotation, VectorX& q) const {
  if (model.planar()) return true;
  const Support& s = model.supports[at(hand)];
  for (std::size_t i = 0; i < s.touched.size(); ++i) {
    const int edge = s.touched[i].edge;
    const auto e = at(edge);
    const Matrix3 frame = rotation * state.hands[at(hand)].edges[i];
    Vec3d t = to_vec3(frame.col(2)), d = to_vec3(frame.col(0));
    const auto own = [&](int node) { return std::find(s.nodes.begin(), s.nodes.end(), node) != s.nodes.end(); };
    if (!own(model.edge_tail[e]) || !own(model.edge_head[e])) {
      // Its node towards a neighbour that is held too is where that is.
      const Vec3d across = edge_vector(model, q, edge);
      const Vec3d now = (1.0 / std::sqrt(dot(across, across))) * across;
      if (dot(t, now) < -0.5) return false;
      d = parallel_transport(d, t, now);
      t = now;
    }
    if (dot(state.tangent[e], t) < -0.5) return false;
    const double angle = signed_angle(parallel_transport(state.director[e], state.tangent[e], t), d, t);
    const int dof = model.edge_dof[e];
    q(dof) = state.q(dof) + std::remainder(angle - state.q(dof), 2.0 * std::numbers::pi);
  }
  return true;
}

/// Of a hand on the rod in the last evaluation, about the origin; see `reaction_of`.
Wrench World::Implementation::hand_reaction(int hand, const VectorX& held) const {
  const Support& s = model.supports[at(hand)];
  if (s.yields()) return hand_wrenches[at(hand)];
  const VectorX& q = reaction_place;
  Wrench out;
  for (int node : s.nodes) {
    const Vector3 force = node_vector(model, held, node);
    out.force += force;
    out.moment += node_position(model, q, node).cross(force);
  }
  for (int edge : s.edges)
    if (!model.planar())
      out.moment += held(model.edge_dof[at(edge)]) * to_eigen(edge_vector(model, q, edge)).normalized();
  return out;
}

void World::feed(int support, double rate) {
  Implementation& self = *implementation_;
  require(support >= 0 && support < static_cast<int>(self.model.supports.size()) &&
              self.model.supports[at(support)].active && self.model.supports[at(support)].description.hand.feeds,
          "no such ring that feeds, or it is released: " + std::to_string(support));
  require(std::isfinite(rate), "feed_rate must be finite");
  SupportMotion& m = self.motions[at(support)];
  m.fed_before = m.fed;
  m.feeds_since = self.state.time;
  m.feed_rate = rate;
}

void World::set_ring_friction(int support, double friction) {
  require(support >= 0 && support < static_cast<int>(implementation_->model.supports.size()) &&
              implementation_->model.supports[at(support)].active &&
              implementation_->model.supports[at(support)].slides(),
          "no such ring, or it is released: " + std::to_string(support));
  Implementation& self = accounted();
  HandDescription& hand = self.model.supports[at(support)].description.hand;
  require(!hand.feeds, "a ring with a drive has no friction: use force_limit instead");
  require(std::isfinite(friction) && friction >= 0.0, "friction of a ring must be finite and not negative");
  const double before = self.hand_energy_of(support);
  const bool held = hand.friction > 0.0, holds = friction > 0.0;
  self.description.supports[at(support)].hand.friction = hand.friction = friction;
  RingState& ring = self.state.hands[at(support)].ring;
  const Passage now = passage_of(self.model, self.state, support);
  if (held)
    ring.slip += now.slipped;
  else
    ring.slip = ring.origin - ring.fed - now.at;  // it is held from where it is now on
  self.actuation_work += self.hand_energy_of(support) - before;
  if (held != holds)
    self.rebuild(Rebuild::running);
  else
    self.reaction_current = false;
}

RingPassage World::passage(int support) const {
  const Implementation& self = *implementation_;
  require(support >= 0 && support < static_cast<int>(self.model.supports.size()) &&
              self.model.supports[at(support)].active && self.model.supports[at(support)].slides(),
          "no such ring, or it is released: " + std::to_string(support));
  if (self.state.hands[at(support)].ring.left) return {};
  const Passage found = passage_of(self.model, self.state, support);
  const RodCurve& curve = self.model.supports[at(support)].curve;
  // A closed rod goes round for ever.
  const double along = curve.closed ? found.at - curve.whole * std::floor(found.at / curve.whole) : found.at;
  return {true, along, found.pull, self.model.supports[at(support)].description.hand.stiffness[0] * found.across.norm(),
          self.motions[at(support)].feed_rate};
}

std::vector<LeftRing> World::take_left_rings() { return std::exchange(implementation_->left_rings, {}); }

/// Whether there were any. To be called where a time step ends, so that what follows is the same whoever asks for it.
bool World::Implementation::release_left_rings() {
  const std::size_t before = left_rings.size();
  for (std::size_t s = 0; s < model.supports.size(); ++s)
    if (model.supports[s].active && state.hands[s].ring.left) left_rings.push_back({static_cast<int>(s), state.time});
  if (left_rings.size() == before) return false;
  for (std::size_t k = before; k < left_rings.size(); ++k) model.supports[at(left_rings[k].support)].active = false;
  rebuild(Rebuild::running);
  return true;
}

Deflection World::deflection(int support) const {
  Implementation& self = *implementation_;
  require(support >= 0 && support < static_cast<int>(self.model.supports.size()) &&
              self.model.supports[at(support)].active && self.model.supports[at(support)].is_hand(),
          "no such hand, or it is released: " + std::to_string(support));
  if (!self.model.supports[at(support)].yields()) return {};
  const HandDeflection found = hand_deflection(self.model, self.state, self.configuration(), support);
  return {found.shift, found.turn, found.slip};
}

}  // namespace withe
