#include "contact/contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// The elastic give of an anchor at its limit, over the distance tolerance.
constexpr double kGive = 0.05;
// Pairs farther apart than this beyond their reach, over it, are of no interest.
constexpr double kFar = 0.6;
// What rounding leaves of a distance to go.
constexpr double kSafe = 1.0 - 1e-9;

}  // namespace

Contact::Contact(const Model& model) : model_(model), surfaces_(model) {
  const ContactDescription& contact = model.description.contact;
  pairs_ = surfaces_.obstacle_pairs();
  for (const ContactPair& p : pairs_) frictional_ = frictional_ || p.friction > 0.0;
  if (contact.rods) {
    frictional_ = frictional_ || contact.friction > 0.0;
    for (const ContactPairDescription& p : contact.pairs) frictional_ = frictional_ || p.friction > 0.0;
  }
  couple();
}

const ContactPair& Contact::pair_of(int i) const { return pairs_[at(touching_[at(i)].pair)]; }

void Contact::set_parameters(const Parameters& parameters) {
  if (version_ == parameters.version) return;
  version_ = parameters.version;
  const double given = model_.description.contact.stiffness;
  const std::size_t rods = model_.description.rods.size();
  least_stiffness_.setConstant(static_cast<Eigen::Index>(rods), given);
  edge_mass_ = parameters.edge_density.cwiseProduct(model_.edge_arc);
  gravity_ = parameters.gravity.norm();
  for (int e = 0; e < model_.edge_count && !(given > 0.0); ++e) {
    const double r = surfaces_.radius(e);
    if (!(r > 0.0)) continue;
    const double weight = parameters.edge_density(e) * model_.edge_arc(e) * parameters.gravity.norm();
    const double force = weight + 1e-4 * parameters.edge_bend.row(e).maxCoeff() / (r * r);
    double& least = least_stiffness_(model_.edge_rod[at(e)]);
    least = std::max(least, force / (2.0 * kDepth * r));
  }
}

void Contact::initialise(State& state, const Parameters& parameters) {
  set_parameters(parameters);
  if (state.contact_stiffness.size() == 0) state.contact_stiffness = least_stiffness_;
}

/// What stops an edge's mass at the speed at which the ends meet, within the step or within the depth of contact; and
/// what stores its energy in that depth, where a step's force does as much work as contact stores.
double Contact::impact_stiffness(const ContactPair& pair) const {
  if (fixed(pair)) return 0.0;
  const bool obstacle = pair.key.b < 0;
  const Vec3d shift = shift_of(pair);
  double square = 0.0;
  for (int k = 0; k < (pair.curve() ? pair.piece.weights->nodes : 2); ++k) {
    const int node_a = pair.curve() ? pair.piece.node[k] : end_node(pair.key.a, k);
    const Vec3d v = local_position(model_, state_->v, node_a) - (1.0 / duration_) * shift;
    if (obstacle) {
      square = std::max(square, dot(v, v));
      continue;
    }
    for (int l = 0; l < 2; ++l) {
      const Vec3d relative = v - local_position(model_, state_->v, end_node(pair.key.b, l));
      square = std::max(square, dot(relative, relative));
    }
  }
  const double depth = kDepth * pair.small_radius(), half = 0.5 * mass_of(pair) / depth;
  const double stops = half * std::min(std::sqrt(square) / duration_, square / depth);
  if (pressing_ < Pressing::mean) return stops;
  const double speed = approach_speed(pair);
  return std::max(stops, half * speed * speed / depth);
}

/// Of a contact that begins, for a whole node.
double Contact::start_stiffness(const ContactPair& pair, const VectorX& stiffness) const {
  if (pair.stiffness > 0.0) return pair.stiffness;
  double start = stiffness(pair.rod_a);
  if (pair.rod_b >= 0) start = std::max(start, stiffness(pair.rod_b));
  if (model_.description.contact.law != ContactLaw::spillmann_teschner) return start;
  // A force 2 k d leads out of the depth d within the step.
  const double a = edge_mass_(pair.key.a);
  const double mass = pair.key.b < 0 ? a : a * edge_mass_(pair.key.b) / (a + edge_mass_(pair.key.b));
  return std::max(start, 0.5 * mass / (duration_ * duration_));
}

/// Of a contact without a record. What touches already when the step begins does not become stiffer by its speed, which
/// would put energy in.
double Contact::first_stiffness(const ContactPair& pair) const {
  const double start = start_stiffness(pair, state_->contact_stiffness);
  return met(pair) ? std::max(start, impact_stiffness(pair)) : start;
}

double Contact::tangential_stiffness(const ContactPair& pair, double stiffness) const {
  const double pressing = stiffness * 2.0 * kDepth * pair.small_radius();
  return pair.friction * pressing / (kGive * pair.tolerance);
}

/// Ends of edges, or of an obstacle; of a piece of a curve its nodes, and nothing.
void Contact::end_points(const ContactPair& pair, const VectorX& q, Vec3d (&x)[4]) const {
  if (pair.curve()) {
    for (int i = 0; i < 4; ++i)
      x[i] = i < pair.piece.weights->nodes ? local_position(model_, q, pair.piece.node[i]) : Vec3d{};
    return;
  }
  x[0] = local_vector(model_, q, model_.tail_dof[at(pair.key.a)]);
  x[1] = local_vector(model_, q, model_.head_dof[at(pair.key.a)]);
  if (pair.key.b >= 0) {
    x[2] = local_vector(model_, q, model_.tail_dof[at(pair.key.b)]);
    x[3] = local_vector(model_, q, model_.head_dof[at(pair.key.b)]);
  } else {
    const Obstacle& o = obstacle_of(pair);
    x[2] = o.point;
    x[3] = o.other;
  }
}

/// The longest way of a node; NaN where one is.
double Contact::farthest(const VectorX& change) const {
  double most = 0.0;
  for (int dof : model_.node_dof) {
    double square = 0.0;
    for (int k = 0; k < model_.dimension; ++k) square += change(dof + k) * change(dof + k);
    if (std::isnan(square)) return square;
    most = std::max(most, square);
  }
  return std::sqrt(most);
}

Contact::Touching Contact::touch(const ContactPair& pair, const VectorX& q, bool whole) const {
  Touching t;
  Vec3d x[4];
  end_points(pair, q, x);
  if (pair.curve()) {
    const Obstacle& o = obstacle_of(pair);
    const CurveDistance<double> d = curve_distance(pair.piece, o, x);
    t.distance = d.distance;
    t.points.s = d.s;
    t.normal = distance_to(o, curve_point(*pair.piece.weights, x, d.s)).normal;
    return t;
  }
  // Far apart by their middles: no need for more.
  const Vec3d middle = 0.5 * (x[0] + x[1] - x[2] - x[3]), u = x[1] - x[0], v = x[3] - x[2];
  const double size = 0.5 * (std::sqrt(dot(u, u)) + std::sqrt(dot(v, v))) + (1.0 + kFar) * pair.reach();
  if (!whole && dot(middle, middle) > size * size) {
    t.distance = std::sqrt(dot(middle, middle)) - size + (1.0 + kFar) * pair.reach();  // or more
    return t;
  }
  t.points = closest_points(x[0], x[1], x[2], x[3], pair.weight_a, pair.weight_b);
  t.distance = std::sqrt(t.points.square);
  const double length = std::sqrt(dot(t.points.between, t.points.between));
  t.normal = (1.0 / std::max(length, 1e-300)) * t.points.between;
  return t;
}

const ContactRecord* Contact::record_of(const ContactKey& key) const {
  const ContactRecord* renewed = renewed_.empty() ? nullptr : find_record(renewed_, key);
  return renewed ? renewed : find_record(state_->contacts, key);
}

void Contact::begin(const State& state, const Parameters& parameters, double duration, Pressing pressing) {
  set_parameters(parameters);
  pressing_ = pressing;
  restart(state, duration);
}

void Contact::restart(const State& state, double duration) {
  current_ = false;
  state_ = &state;
  duration_ = duration;
  eased_ = 1.0;
  shift_.clear();
  turn_.clear();
  blocked_ = false;
  place_obstacles(state.obstacles);
  lagged_.clear();
  forget_foreseen();
  if (outgrown(state.q, nullptr)) find_pairs(state.q, state.q);
  touching_.clear();
  leaving_.clear();
  unrecorded_.clear();
  renewed_.clear();
  starting_ = true;
  update(state.q);
  starting_ = false;
  if (pressing_ != Pressing::still) renew_impacts();
  for (const Touching& t : touching_)
    if (record_of(pairs_[at(t.pair)].key) == nullptr) unrecorded_.push_back(pairs_[at(t.pair)].key);
  std::sort(unrecorded_.begin(), unrecorded_.end());
  for (const Touching& t : touching_)
    if (t.law.elastic > 0.0) leaving_.push_back(t);
  start_energy_ = energy();
  start_pressing_ = pressing_energy();
  if (!target_.empty()) move_obstacles();
  if (frictional_ && freezes()) freeze();
  if (!shift_.empty() || !turn_.empty()) place_obstacles(target_);
}

void Contact::place_obstacles(const std::vector<ObstaclePlace>& places) { moved_ += 2.0 * surfaces_.place(places); }

/// Finds the ways of obstacles. Rods follow once these are at their ends: a step in which one would pass through a
/// centreline that stays is too long.
void Contact::move_obstacles() {
  double most = 0.0, most_turn = 0.0;
  for (std::size_t o = 0; o < target_.size(); ++o) {
    shift_.push_back(target_[o].point - state_->obstacles[o].point);
    turn_.push_back(target_[o].turn - state_->obstacles[o].turn);
    most = std::max(most, dot(shift_.back(), shift_.back()));
    most_turn = std::max(most_turn, dot(turn_.back(), turn_.back()));
  }
  if (most_turn == 0.0) turn_.clear();
  if (most == 0.0) {
    shift_.clear();
    return;
  }
  for (const ContactPair& pair : surfaces_.obstacle_pairs())
    if (!flat(pair) && allowed_of(pair, state_->q, nullptr, shift_of(pair)) < 1.0) blocked_ = true;
}

/// Minus the force on the nodes beside an obstacle, and so that on it [N].
Vec3d Contact::force_on_nodes(const ContactPair& pair, const ContactLocal& local) {
  Vec3d sum{};
  for (int i = 0; i < (pair.curve() ? 9 : 6); i += 3)
    sum += Vec3d{local.gradient[i], local.gradient[i + 1], local.gradient[i + 2]};
  return sum;
}

double Contact::obstacle_work() const {
  double work = 0.0;
  if (!turn_.empty())
    for (const Touching& t : touching_) work += turning_work(t);
  ContactLocal local;
  for (int i = 0; i < count() && !shift_.empty(); ++i) {
    const Vec3d shift = shift_of(pair_of(i));
    if (dot(shift, shift) == 0.0) continue;
    this->local(i, false, local);
    work -= dot(shift, force_on_nodes(pair_of(i), local));
  }
  return work;
}

void Contact::update(const VectorX& q1) {
  if (current_ && q1 == q1_) return;
  moved_ += q1_.size() == q1.size() ? farthest(q1 - q1_) : INFINITY;
  if (outgrown(q1, nullptr)) find_pairs(q1, q1);
  if (!std::isfinite(moved_)) {
    moved_ = 0.0;
    bounds_.clear();
  }
  q1_ = q1;
  bounds_.resize(pairs_.size());
  touching_ = lagged_;
  for (int p = 0; p < static_cast<int>(pairs_.size()); ++p) {
    if (bounds_[at(p)].clear > moved_) continue;
    const ContactPair& pair = pairs_[at(p)];
    Touching t = touch(pair, q1);
    t.pair = p;
    // A distance changes by no more than both edges move.
    const auto above = [&](double least) { return moved_ + kSafe * 0.5 * (t.distance - least); };
    // The weights of closest_points make it greater than that of the points themselves.
    const double weights = 0.25 * (pair.weight_a + pair.weight_b);
    bounds_[at(p)] = {above(pair.reach()), above(std::sqrt(pair.nearest() * pair.nearest() + weights))};
    if (t.distance >= pair.reach()) continue;
    set_force(t, record_of(pair.key));
    touching_.push_back(t);
  }
  add_leaving(lagged_.size());
  current_ = !starting_;  // what has no record begins otherwise in a step than before it
}

void Contact::unknowns(int i, int (&dofs)[kContactUnknowns]) const { unknowns_of(pair_of(i), dofs); }

void Contact::unknowns_of(const ContactPair& pair, int (&dofs)[kContactUnknowns]) const {
  if (!pair.curve()) {
    unknowns_of_edges(pair.key, dofs);
    return;
  }
  std::fill(std::begin(dofs), std::end(dofs), -1);
  const CurveWeights& w = *pair.piece.weights;
  for (int i = 0; i < w.nodes; ++i)
    for (int k = 0; k < model_.dimension; ++k) dofs[3 * i + k] = model_.node_dof[at(pair.piece.node[i])] + k;
  for (int b = 0; b < w.edges && frictional_ && !model_.planar(); ++b)
    dofs[12 + b] = model_.edge_dof[at(pair.piece.edge[b])];
}

void Contact::unknowns_of(const ContactKey& key, int (&dofs)[kContactUnknowns]) const {
  if (key.b < 0)
    unknowns_of(surfaces_.obstacle_pair(key), dofs);
  else
    unknowns_of_edges(key, dofs);
}

void Contact::unknowns_of_edges(const ContactKey& key, int (&dofs)[kContactUnknowns]) const {
  std::fill(std::begin(dofs), std::end(dofs), -1);
  const bool obstacle = key.b < 0;
  for (int side = 0; side < (obstacle ? 1 : 2); ++side) {
    const auto edge = at(side == 0 ? key.a : key.b);
    for (int k = 0; k < model_.dimension; ++k) {
      dofs[6 * side + k] = model_.tail_dof[edge] + k;
      dofs[6 * side + 3 + k] = model_.head_dof[edge] + k;
    }
    if (frictional_ && !model_.planar()) dofs[12 + side] = model_.edge_dof[edge];
  }
}

void Contact::local(int i, bool with_hessian, ContactLocal& out) const {
  const Touching& t = touching_[at(i)];
  std::fill(std::begin(out.gradient), std::end(out.gradient), 0.0);
  if (with_hessian)
    for (auto& row : out.hessian) std::fill(std::begin(row), std::end(row), 0.0);
  if (t.frozen >= 0) {
    add_frozen_friction(t, with_hessian, out);
    return;
  }
  press(t, with_hessian, out);
  if (pairs_[at(t.pair)].friction > 0.0 && !freezes()) add_friction(t, with_hessian, out);
}

}  // namespace withe
