#include "contact/contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// The elastic give of an anchor at its limit, over the distance tolerance.
constexpr double kGive = 0.05;

}  // namespace

Contact::Contact(const Model& model) : model_(model), surfaces_(model), candidates_(model, surfaces_) {}

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
  candidates_.place(state.obstacles);
  lagged_.clear();
  forget_foreseen();
  touching_.clear();
  leaving_.clear();
  unrecorded_.clear();
  renewed_.clear();
  starting_ = true;
  update(state.q);
  starting_ = false;
  if (pressing_ != Pressing::still) renew_impacts();
  for (const Touching& t : touching_)
    if (record_of(t.pair.key) == nullptr) unrecorded_.push_back(t.pair.key);
  std::sort(unrecorded_.begin(), unrecorded_.end());
  for (const Touching& t : touching_)
    if (t.law.elastic > 0.0) leaving_.push_back(t);
  start_energy_ = energy();
  start_pressing_ = pressing_energy();
  if (!target_.empty()) move_obstacles();
  if (frictional() && freezes()) freeze();
  if (!shift_.empty() || !turn_.empty()) candidates_.place(target_);
}

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
  blocked_ = candidates_.blocked(state_->q, shift_);
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
  q1_ = q1;
  touching_ = lagged_;
  candidates_.find(q1, [&](const ContactPair& pair, const Proximity& proximity) {
    Touching& t = touching_.emplace_back(Touching{pair, proximity});
    set_force(t, record_of(pair.key));
  });
  add_leaving(lagged_.size());
  current_ = !starting_;  // what has no record begins otherwise in a step than before it
}

std::vector<ContactKey> Contact::near() {
  std::vector<ContactKey> keys = candidates_.near(q1_);
  for (const Touching& t : touching_) keys.push_back(t.pair.key);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

void Contact::unknowns(int i, int (&dofs)[kContactUnknowns]) const { surfaces_.unknowns(pair_of(i), dofs); }

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
  if (t.pair.friction > 0.0 && !freezes()) add_friction(t, with_hessian, out);
}

}  // namespace withe
