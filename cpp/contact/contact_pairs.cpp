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

/// Boxes of all edges that may touch others, on a way, grown by half of the tolerance and by `more` than that.
template <class More>
void Contact::set_boxes(const VectorX& from, const VectorX& to, const More& more) {
  boxes_.clear();
  for (int e : surfaces_.edges()) {
    const int tail = model_.edge_tail[at(e)], head = model_.edge_head[at(e)];
    const double grow = surfaces_.radius(e) + 0.5 * surfaces_.tolerance(e) + more(e);
    Box box = Box::around(local_position(model_, from, tail), local_position(model_, from, head), grow);
    if (&from != &to)
      box.include(Box::around(local_position(model_, to, tail), local_position(model_, to, head), grow));
    boxes_.push_back(box);
  }
}

/// Candidates for the way from one configuration to another, and beyond by a margin that grows with the last travel.
void Contact::find_pairs(const VectorX& from, const VectorX& to) {
  if (surfaces_.edges().empty()) return;
  current_ = false;
  double travel = 0.0;
  if (reference_.size() == to.size())
    for (int dof : model_.node_dof)
      travel = std::max(travel, (to.segment(dof, model_.dimension) - reference_.segment(dof, model_.dimension)).norm());
  const double reach = surfaces_.greatest_reach();
  margin_ = std::clamp(4.0 * travel, 0.25 * reach, 2.0 * reach);
  set_boxes(from, to, [&](int) { return 0.5 * margin_; });
  std::swap(pairs_, old_pairs_);
  find_near(pairs_);
  keep_touching();
  // Iterates go to and fro on a way whose candidates are all known.
  low_ = from.cwiseMin(to);
  high_ = from.cwiseMax(to);
  reference_ = to;
  bounds_.assign(pairs_.size(), {});
}

/// Pairs with obstacles, and those of edges whose `boxes_` overlap, sorted by key.
void Contact::find_near(std::vector<ContactPair>& pairs) {
  const std::vector<ContactPair>& fixed = surfaces_.obstacle_pairs();
  pairs.assign(fixed.begin(), fixed.end());
  for (const BroadPhase::Pair& found : broad_phase_.find(boxes_)) {
    const int a = surfaces_.edges()[at(found.a)], b = surfaces_.edges()[at(found.b)];
    if (surfaces_.may_touch(a, b)) pairs.push_back(surfaces_.pair(a, b));
  }
}

/// Candidates sorted by key follow those with obstacles, which keep their numbers.
std::size_t Contact::number_of(const std::vector<ContactPair>& pairs, const ContactKey& key) const {
  const auto first = pairs.begin() + static_cast<std::ptrdiff_t>(surfaces_.obstacle_pairs().size());
  return static_cast<std::size_t>(
      std::lower_bound(first, pairs.end(), key,
                       [](const ContactPair& pair, const ContactKey& k) { return pair.key < k; }) -
      pairs.begin());
}

/// What touches is known by the key of its pair while pairs are renumbered, from `old_pairs_` to `pairs_`. What has
/// gone out of reach within a step stays a candidate: its friction of the start still acts, and what it gives back.
void Contact::keep_touching() {
  const std::size_t fixed = surfaces_.obstacle_pairs().size();
  for (const std::vector<Touching>* kept : {&lagged_, &leaving_})
    for (const Touching& t : *kept) {
      if (at(t.pair) < fixed) continue;
      const ContactKey& key = old_pairs_[at(t.pair)].key;
      const std::size_t number = number_of(pairs_, key);
      if (number == pairs_.size() || pairs_[number].key != key)
        pairs_.insert(pairs_.begin() + static_cast<std::ptrdiff_t>(number), surfaces_.pair(key.a, key.b));
    }
  for (std::vector<Touching>* kept : {&lagged_, &leaving_})
    for (Touching& t : *kept)
      if (at(t.pair) >= fixed) t.pair = static_cast<int>(number_of(pairs_, old_pairs_[at(t.pair)].key));
  if (!foreseen_.empty()) {
    next_foreseen_.assign(pairs_.size(), {});
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
      const std::size_t number = p < fixed ? p : number_of(old_pairs_, pairs_[p].key);
      if (number < foreseen_.size() && old_pairs_[number].key == pairs_[p].key) next_foreseen_[p] = foreseen_[number];
    }
    foreseen_.swap(next_foreseen_);
  }
  for (std::size_t p = 0; p < pairs_.size(); ++p) pairs_[p].element = element_of(pairs_[p].key);
}

int Contact::element_of(const ContactKey& key) const {
  const auto known = std::lower_bound(elements_.begin(), elements_.end(), key);
  return known != elements_.end() && *known == key ? static_cast<int>(known - elements_.begin()) : -1;
}

bool Contact::coupled() const {
  return std::all_of(touching_.begin(), touching_.end(),
                     [&](const Touching& t) { return pairs_[at(t.pair)].element >= 0; });
}

/// What is near is looked for anew, for the candidates depend on when they were found: the same configuration gives the
/// same elements, whatever was read out before.
void Contact::couple() {
  std::vector<ContactKey> keys;
  for (const Touching& t : touching_) keys.push_back(pairs_[at(t.pair)].key);
  std::sort(keys.begin(), keys.end());
  boxes_.clear();
  if (q1_.size() > 0) set_boxes(q1_, q1_, [&](int e) { return kNear * surfaces_.radius(e); });
  std::vector<ContactPair> near;
  find_near(near);
  for (const ContactPair& pair : near) {
    if (pair.key.b >= 0 && touch(pair, q1_).distance >= pair.reach() + kNear * pair.radii()) continue;
    if (!std::binary_search(keys.begin(), keys.end(), pair.key))
      keys.insert(std::lower_bound(keys.begin(), keys.end(), pair.key), pair.key);
  }
  couple(std::move(keys));
}

void Contact::couple(std::vector<ContactKey> keys) {
  std::sort(keys.begin(), keys.end());
  elements_ = std::move(keys);
  element_unknowns_.clear();
  for (const ContactKey& key : elements_) {
    int dofs[kContactUnknowns];
    unknowns_of(key, dofs);
    element_unknowns_.insert(element_unknowns_.end(), std::begin(dofs), std::end(dofs));
  }
  for (ContactPair& pair : pairs_) pair.element = element_of(pair.key);
}

double Contact::allowed(const VectorX& q1, const VectorX& change) {
  const std::size_t obstacles = surfaces_.obstacle_pairs().size();
  if (outgrown(q1, &change)) {
    const VectorX end = q1 + change;
    find_pairs(q1, end);
  }
  double least = 1.0;
  bounds_.resize(pairs_.size());
  const double here = moved_ + (q1_.size() == q1.size() ? farthest(q1 - q1_) : INFINITY), coming = farthest(change);
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    if (p < obstacles && flat(pairs_[p])) continue;
    if (bounds_[p].open - here >= coming) continue;
    least = std::min(least, allowed_of(pairs_[p], q1, &change, Vec3d{}));
  }
  return least;
}

/// How much of a way may be made, by conservative advancement: the distance, a function of that much, falls no faster
/// than by `speed`.
template <class Distance>
double Contact::advance(const ContactPair& pair, double speed, const Distance& distance_at) {
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

/// The same of a piece of a curve.
double Contact::allowed_of_piece(const ContactPair& pair, const VectorX& q, const VectorX* change,
                                 const Vec3d& shift) const {
  Vec3d x[4], d[4] = {};
  end_points(pair, q, x);
  if (change) end_points(pair, *change, d);
  double speed = 0.0;
  for (int i = 0; i < pair.piece.weights->nodes; ++i) {
    d[i] -= shift;
    speed = std::max(speed, dot(d[i], d[i]));
  }
  // Shares of nodes in points, and of points in the distance, add up to no more than 7/6 and 5/4, each taken as
  // positive.
  speed = 1.5 * std::sqrt(speed);
  if (speed == 0.0) return 1.0;
  return advance(pair, speed, [&](double tau) {
    Vec3d moved[3];
    for (int i = 0; i < 3; ++i) moved[i] = x[i] + tau * d[i];
    return curve_distance(pair.piece, obstacle_of(pair), moved).distance;
  });
}

/// The same of straight lines, whose distance falls no faster than the ends move against each other. `change`: of q;
/// nothing: rods stay. `shift`: of the obstacle.
double Contact::allowed_of(const ContactPair& pair, const VectorX& q, const VectorX* change, const Vec3d& shift) const {
  if (pair.curve()) return allowed_of_piece(pair, q, change, shift);
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
  return advance(pair, speed, [&](double tau) {
    const ClosestPoints c = closest_points(x[0] + tau * d[0], x[1] + tau * d[1], x[2] + tau * d[2], x[3] + tau * d[3],
                                           pair.weight_a, pair.weight_b);
    return std::sqrt(dot(c.between, c.between));
  });
}

}  // namespace withe
