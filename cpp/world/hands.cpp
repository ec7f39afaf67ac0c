/// Hands and rings of a running scene.

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/check.hpp"
#include "steps/hand_forces.hpp"
#include "world/implementation.hpp"

namespace withe {
double World::Implementation::hand_energy_of(int hand) const {
  return hand_energy(model, parameters.measure, state, configuration(), hand);
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
  self.ledger.actuation_work += self.hand_energy_of(support) - before;
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

/// True if there were any. Called at the end of each time step, so that the run does not depend on who asks.
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
