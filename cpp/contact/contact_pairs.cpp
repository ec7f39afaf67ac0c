#include <algorithm>
#include <cmath>

#include "contact/contact.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// Pairs nearer than this beyond their reach, over the sum of their radii, are part of the matrix's pattern.
constexpr double kNear = 0.5;

/// How far a coordinate is outside of two bounds; NaN where it is one.
double outside(double x, double low, double high) { return x < low ? low - x : x - std::min(x, high); }

}  // namespace

/// Whether some node has left, or would leave, what the candidates were found for.
bool Contact::outgrown(const VectorX& q, const VectorX* change) const {
  if (surfaces_.edges().empty()) return false;
  if (reference_.size() != q.size()) return true;
  const double most = 0.25 * margin_ * margin_;
  for (int dof : model_.node_dof) {
    double square = 0.0, later = 0.0;
    for (int k = dof; k < dof + model_.dimension; ++k) {
      const double d = outside(q(k), low_(k), high_(k));
      square += d * d;
      if (!change) continue;
      const double then = outside(q(k) + (*change)(k), low_(k), high_(k));
      later += then * then;
    }
    if (!(std::max(square, later) <= most)) return true;
  }
  return false;
}

/// Candidates for the way from one configuration to another, and beyond by a margin that grows with the last travel.
void Contact::find_pairs(const VectorX& from, const VectorX& to) {
  if (surfaces_.edges().empty()) return;
  current_ = false;
  forget_foreseen();
  double travel = 0.0;
  if (reference_.size() == to.size())
    for (int dof : model_.node_dof)
      travel = std::max(travel, (to.segment(dof, model_.dimension) - reference_.segment(dof, model_.dimension)).norm());
  const double reach = surfaces_.greatest_reach();
  margin_ = std::clamp(4.0 * travel, 0.25 * reach, 2.0 * reach);
  boxes_.clear();
  for (int e : surfaces_.edges()) {
    const int tail = model_.edge_tail[at(e)], head = model_.edge_head[at(e)];
    const double grow = surfaces_.radius(e) + 0.5 * surfaces_.tolerance(e) + 0.5 * margin_;
    Box box = Box::around(local_position(model_, from, tail), local_position(model_, from, head), grow);
    if (&from != &to)
      box.include(Box::around(local_position(model_, to, tail), local_position(model_, to, head), grow));
    boxes_.push_back(box);
  }
  const std::size_t fixed = surfaces_.obstacle_pairs().size();
  // What touches is known by the key of its pair while pairs are renumbered; those with obstacles keep their number.
  std::vector<std::pair<Touching*, ContactKey>> renumbered;
  for (std::vector<Touching>* kept : {&lagged_, &leaving_})
    for (Touching& t : *kept)
      if (at(t.pair) >= fixed) renumbered.emplace_back(&t, pairs_[at(t.pair)].key);
  pairs_.resize(fixed);
  for (const BroadPhase::Pair& found : broad_phase_.find(boxes_)) {
    const int a = surfaces_.edges()[at(found.a)], b = surfaces_.edges()[at(found.b)];
    if (!surfaces_.may_touch(a, b)) continue;
    pairs_.push_back(surfaces_.pair(a, b));
    pairs_.back().element = element_of(pairs_.back().key);
  }
  const std::size_t found = pairs_.size();
  for (const auto& [touching, key] : renumbered) {
    const auto place = std::lower_bound(pairs_.begin() + static_cast<std::ptrdiff_t>(fixed),
                                        pairs_.begin() + static_cast<std::ptrdiff_t>(found), key,
                                        [](const ContactPair& pair, const ContactKey& k) { return pair.key < k; });
    auto number = static_cast<std::size_t>(place - pairs_.begin());
    if (number == found || pairs_[number].key != key) {
      // Gone out of reach within a step: its friction of the start still acts, and what it gives back.
      number = pairs_.size();
      pairs_.push_back(surfaces_.pair(key.a, key.b));
      pairs_.back().element = element_of(key);
    }
    touching->pair = static_cast<int>(number);
  }
  // Iterates go to and fro on a way whose candidates are all known.
  low_ = from.cwiseMin(to);
  high_ = from.cwiseMax(to);
  reference_ = to;
  bounds_.assign(pairs_.size(), {});
}

int Contact::element_of(const ContactKey& key) const {
  const auto known = std::lower_bound(elements_.begin(), elements_.end(), std::pair(key, -1));
  return known != elements_.end() && known->first == key ? known->second : -1;
}

bool Contact::coupled() const {
  return std::all_of(touching_.begin(), touching_.end(),
                     [&](const Touching& t) { return pairs_[at(t.pair)].element >= 0; });
}

void Contact::couple() {
  elements_.clear();
  element_unknowns_.clear();
  std::vector<bool> now(pairs_.size(), false);
  for (const Touching& t : touching_) now[at(t.pair)] = true;
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    ContactPair& pair = pairs_[p];
    pair.element = -1;
    const bool near =
        pair.key.b < 0 || now[p] ||
        (q1_.size() > 0 && touch(static_cast<int>(p), q1_).distance < pair.reach() + kNear * pair.radii());
    if (!near) continue;
    pair.element = static_cast<int>(elements_.size());
    elements_.emplace_back(pair.key, pair.element);
    int dofs[kContactUnknowns];
    unknowns_of(pair, dofs);
    element_unknowns_.insert(element_unknowns_.end(), std::begin(dofs), std::end(dofs));
  }
  std::sort(elements_.begin(), elements_.end());
}

double Contact::allowed(const VectorX& q1, const VectorX& change) {
  const std::size_t planes_only = surfaces_.obstacle_pairs().size();
  if (outgrown(q1, &change)) {
    const VectorX end = q1 + change;
    find_pairs(q1, end);
  }
  double least = 1.0;
  bounds_.resize(pairs_.size());
  const double here = moved_ + (q1_.size() == q1.size() ? farthest(q1 - q1_) : INFINITY), coming = farthest(change);
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    if (p < planes_only && pairs_[p].plane()) continue;
    if (bounds_[p].open - here >= coming) continue;
    least = std::min(least, allowed_of(pairs_[p], q1, &change, Vec3d{}));
  }
  return least;
}

/// Conservative advancement along straight lines: the distance falls no faster than the ends move against each other.
/// `change`: of q; nothing: rods stay. `shift`: of the obstacle.
double Contact::allowed_of(const ContactPair& pair, const VectorX& q, const VectorX* change, const Vec3d& shift) const {
  Vec3d x[4], d[4] = {Vec3d{}, Vec3d{}, shift, shift};
  end_points(pair, q, x);
  const int edges[2] = {pair.key.a, pair.key.b};
  for (int side = 0; change && side < (pair.key.b < 0 ? 1 : 2); ++side) {
    d[2 * side] = local_vector(model_, *change, model_.tail_dof[at(edges[side])]);
    d[2 * side + 1] = local_vector(model_, *change, model_.head_dof[at(edges[side])]);
  }
  double speed = 0.0;
  for (int a = 0; a < 2; ++a)
    for (int b = 2; b < 4; ++b) speed = std::max(speed, dot(d[a] - d[b], d[a] - d[b]));
  speed = std::sqrt(speed);
  const Vec3d middle = 0.5 * (x[0] + x[1] - x[2] - x[3]), u = x[1] - x[0], v = x[3] - x[2];
  const double bound =
      std::sqrt(dot(middle, middle)) - 0.5 * (std::sqrt(dot(u, u)) + std::sqrt(dot(v, v))) - pair.nearest();
  if (speed <= bound) return 1.0;
  const auto distance_at = [&](double tau) {
    const ClosestPoints c = closest_points(x[0] + tau * d[0], x[1] + tau * d[1], x[2] + tau * d[2], x[3] + tau * d[3],
                                           pair.weight_a, pair.weight_b);
    return std::sqrt(dot(c.between, c.between));
  };
  const double start = distance_at(0.0);
  const double least = std::min(kNearest * start, pair.nearest());
  double tau = 0.0, distance = start;
  for (int k = 0; k < 100; ++k) {
    tau += (distance - 0.99 * least) / speed;
    if (tau >= 1.0) return 1.0;
    distance = distance_at(tau);
    if (distance <= least) break;
  }
  return tau;
}

}  // namespace withe
