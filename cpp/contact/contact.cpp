#include "contact/contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/contact_friction.hpp"
#include "contact/contact_work.hpp"
#include "contact/impacts.hpp"
#include "contact/plane_contact.hpp"

namespace withe {
namespace {

/// Sets a problem to the start of a step, before its touching pairs are known.
void set_start(const State& state, double duration, ContactProblem& problem) {
  problem.start = &state;
  problem.duration = duration;
  problem.bodies.place(state.obstacles);
  problem.shift.clear();
  problem.turn.clear();
  problem.velocity.clear();
  problem.renewed.clear();
  problem.unrecorded.clear();
  problem.leaving.clear();
  problem.striking.clear();
  problem.lagged.clear();
  problem.lagged_friction.clear();
  problem.find_offsets();
}

/// Distance of a straight edge from an obstacle [m].
double edge_distance(const Obstacle& o, const Vec3d& tail, const Vec3d& head) {
  if (o.kind == ObstacleKind::plane) return std::min(height_above(o, tail), height_above(o, head));
  if (o.kind == ObstacleKind::shape)
    return std::min(
        {distance_to(o, tail).distance, distance_to(o, head).distance, distance_to(o, 0.5 * (tail + head)).distance});
  constexpr double kStrictlyConvex = 1e-12;  // share of the squared edge length: closest points of parallel edges
  const Vec3d way = head - tail;
  const double weight = kStrictlyConvex * dot(way, way);
  const Vec3d between = closest_points(tail, head, o.point, o.other, weight, weight).between;
  return std::sqrt(dot(between, between));
}

ContactReport report_of(const ContactProblem& problem, const Touching& t) {
  const ContactPair& pair = t.pair;
  ContactReport r;
  r.key = pair.key;
  r.distance = t.proximity.distance;
  r.gap = r.edge_gap = t.proximity.distance - pair.radii();
  r.s = t.proximity.points.s;
  r.t = t.proximity.points.t;
  r.normal = t.proximity.normal;
  // Forces that acted, if known: contact that has yielded may press harder from here on.
  const ContactRecord* record = problem.record_of(pair.key);
  r.force = record && record->force > 0.0 && t.energy.first < 0.0 ? record->force : -t.energy.first;
  Vec3d x[4];
  t.end_points(x);
  Vec3d on_a = x[0] + r.s * (x[1] - x[0]);
  if (pair.curve()) {
    on_a = curve_point(*pair.piece.weights, x, t.proximity.points.s);
    const int edge = pair.piece.weights->edges > 1 && r.s > 0.0 ? 1 : 0;
    r.key.a = pair.piece.edge[edge];
    if (!problem.fixed(pair))  // else the curve presses by its whole depth from the start
      r.edge_gap = edge_distance(problem.bodies.obstacle(pair), x[edge], x[edge + 1]) - pair.radii();
    r.s = pair.piece.weights->along(t.proximity.points.s);
  }
  r.point = on_a - (pair.radius_a + 0.5 * r.gap) * r.normal;
  if (pair.curve()) {
    // Total force on the nodes: beside a round obstacle, the normals of the three distances diverge.
    const CurveSlopes slopes = curve_slopes(pair.piece, t.proximity.curve);
    Vec3d sum{};
    for (int i = 0; i < pair.piece.weights->nodes; ++i)
      sum += Vec3d{slopes.distance[3 * i], slopes.distance[3 * i + 1], slopes.distance[3 * i + 2]};
    const double size = std::sqrt(dot(sum, sum));
    r.force *= size;
    r.normal = (1.0 / size) * sum;
  }
  if (record) {
    r.friction = record->friction;
    r.sticking = record->sticking;
  }
  return r;
}

}  // namespace

void Contact::find_at_rest(const State& state, const Parameters& parameters, ContactAtRest& rest) const {
  const bool known = parameters_.version == parameters.version;
  if (!known && rest.own.version != parameters.version) rest.own = ContactParameters(surfaces_, parameters);
  ContactProblem& problem = rest.problem;
  problem.surfaces = &surfaces_;
  problem.parameters = known ? &parameters_ : &rest.own;
  problem.bodies = problem_.bodies;
  set_start(state, 1.0, problem);
  problem.starting = true;
  rest.set.find(problem, state.q,
                [&](const auto& add) { candidates_.find(state.q, problem.bodies, rest.search, add); });
  ContactStiffness(problem).renew(rest.set, rest.records);
  problem.renewed.swap(rest.records);
}

Contact::Contact(const Model& model) : surfaces_(model), candidates_(model, surfaces_) {
  problem_.surfaces = &surfaces_;
  problem_.parameters = &parameters_;
  problem_.bodies = {&model, surfaces_.obstacles()};
}

bool Contact::regularises() const { return frictional() && regularises_friction(problem_.model()); }

void Contact::set_parameters(const Parameters& parameters) {
  if (surfaces_.set_parameters(parameters.surfaces)) candidates_.renew_parameters();
}

void Contact::take_given_stiffness(State& state, const Parameters& parameters) const {
  const Model& model = problem_.model();
  state.contact_stiffness = ContactParameters(surfaces_, parameters).least_stiffness;
  for (ContactRecord& record : state.contacts) {
    const int other = record.key.b < 0 ? record.key.b : model.edge_rod[at(record.key.b)];
    const double given = surfaces_.given_stiffness(model.edge_rod[at(record.key.a)], other);
    if (!(given > 0.0)) continue;
    if (anchored()) record.friction = (given / record.stiffness) * record.friction;
    record.stiffness = given;
    record.yielded = record.force = 0.0;  // no step has computed its present force
  }
}

void Contact::begin(const State& state, const Parameters& parameters, double duration, Pressing pressing,
                    std::span<const ObstaclePlace> target) {
  if (parameters_.version != parameters.version) {
    set_parameters(parameters);
    parameters_ = ContactParameters(surfaces_, parameters);
  }
  problem_.pressing = pressing;
  target_ = target;
  restart(state, duration);
}

void Contact::restart(const State& state, double duration) {
  current_ = false;
  blocked_ = false;
  set_start(state, duration, problem_);
  for (std::size_t o = 0; o < target_.size(); ++o)
    problem_.velocity.push_back((1.0 / duration) * (target_[o].point - state.obstacles[o].point));
  problem_.starting = true;
  find(state.q);
  problem_.starting = false;
  ContactStiffness(problem_).renew(set_, scratch_.records);
  problem_.renewed.swap(scratch_.records);
  OrderedLookup records;
  for (const Touching& t : set_) {
    if (problem_.record_of(t.pair.key, records) == nullptr) problem_.unrecorded.push_back(t.pair.key);
    if (t.law.elastic > 0.0) problem_.leaving.push_back(t);
  }
  std::sort(problem_.unrecorded.begin(), problem_.unrecorded.end());
  problem_.start_energy = set_.kept_energy(problem_);
  problem_.start_pressing = set_.pressing_energy();
  if (!target_.empty()) move_obstacles();
  if (frictional() && problem_.lags()) lag_friction();
  if (!problem_.shift.empty() || !problem_.turn.empty()) problem_.bodies.place(target_);
}

/// Finds the ways of obstacles. Rods follow once these are at their ends: a step in which one would pass through a
/// centreline that stays is too long.
void Contact::move_obstacles() {
  std::vector<Vec3d>&shift = problem_.shift, &turn = problem_.turn;
  const std::vector<ObstaclePlace>& from = problem_.start->obstacles;
  double most = 0.0, most_turn = 0.0;
  for (std::size_t o = 0; o < target_.size(); ++o) {
    shift.push_back(target_[o].point - from[o].point);
    turn.push_back(target_[o].turn - from[o].turn);
    most = std::max(most, dot(shift.back(), shift.back()));
    most_turn = std::max(most_turn, dot(turn.back(), turn.back()));
  }
  if (most_turn == 0.0) turn.clear();
  if (most == 0.0) {
    shift.clear();
    return;
  }
  blocked_ = candidates_.blocked(problem_.start->q, problem_.bodies, shift);
}

/// Friction with J of the start for all that presses there.
void Contact::lag_friction() {
  for (const Touching& t : set_) {
    if (!(t.pair.friction > 0.0) || !(-t.energy.first > 0.0)) continue;
    Touching& lagged = problem_.lagged.emplace_back(t);
    lagged.lagged = static_cast<int>(problem_.lagged_friction.size());
    lagged.energy = ContactEnergy{};
    problem_.lagged_friction.push_back(withe::lag_friction(problem_, t));
  }
}

void Contact::update(const VectorX& q1) {
  if (current_ && q1 == set_.q()) return;
  find(q1);
  current_ = true;
}

/// Impacts that have been found act for all later ends of the step, or Newton's method would lose them where surfaces
/// are apart.
void Contact::find(const VectorX& q) {
  set_.find(problem_, q, [&](const auto& add) { candidates_.find(q, problem_.bodies, add); });
  if (problem_.starting) return;
  std::vector<Touching>& striking = problem_.striking;
  for (const Touching& t : set_) {
    if (!(t.strike.apart > 0.0)) continue;
    const auto place = place_of(t.pair.key, striking.begin(), striking.end());
    if (place == striking.end() || !(place->pair.key == t.pair.key)) striking.insert(place, t);
  }
}

void Contact::local(int i, bool with_hessian, ContactLocal& out, const ContactLinearisation& linearisation) const {
  contact_local(problem_, set_[i], linearisation, with_hessian, out);
}

bool Contact::plane_local(int i, bool with_hessian, PlaneLocal& out, const ContactLinearisation& linearisation) const {
  if (!beside_plane(problem_, set_[i])) return false;
  plane_contact(problem_, set_[i], PlaneForces::both, linearisation, with_hessian, out);
  return true;
}

double Contact::rounding(int i, double reach, const ContactLinearisation& linearisation) const {
  const Touching& t = set_[i];
  const double stiffness = std::max(t.pressing.by_end, friction_slope(problem_, t, linearisation));
  return 8.0 * std::numeric_limits<double>::epsilon() * reach * stiffness;
}

double Contact::pressing_gain(const VectorX& change) const { return withe::pressing_gain(problem_, set_, change); }

double Contact::mean_friction_loss(const VectorX& change, const VectorX& start, const VectorX& end) const {
  return withe::mean_friction_loss(problem_, set_, change, start, end);
}

void Contact::friction_force(VectorX& out) const { withe::friction_force(problem_, set_, out); }

double Contact::obstacle_work() const { return withe::obstacle_work(problem_, set_); }

bool Contact::has_given_stiffness(const State& state) const {
  return std::all_of(set_.begin(), set_.end(), [&](const Touching& t) {
    const ContactRecord* record = find_record(state.contacts, t.pair.key);
    const double given = surfaces_.given_stiffness(t.pair.rod_a, t.pair.key.b < 0 ? t.pair.key.b : t.pair.rod_b);
    return record == nullptr || record->stiffness == given;
  });
}

bool Contact::unresolved(double dt) const {
  return std::any_of(set_.begin(), set_.end(), [&](const Touching& t) { return withe::unresolved(problem_, t, dt); });
}

std::vector<ContactKey> Contact::near() const {
  std::vector<ContactKey> keys = candidates_.near(set_.q(), problem_.bodies);
  for (const Touching& t : set_) keys.push_back(t.pair.key);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

Contact::TouchingComponents Contact::touching_components() const {
  const Model& model = problem_.model();
  TouchingComponents out{std::vector<bool>(at(model.component_count), false)};
  for (const Touching& t : set_) {
    out.which[at(model.component_of_edge(t.pair.key.a))] = true;
    if (t.pair.key.b >= 0) {
      out.which[at(model.component_of_edge(t.pair.key.b))] = true;
      continue;
    }
    const Vec3d velocity = problem_.velocity_of(t.pair);
    const auto same = [&](const Vec3d& other) { return dot(velocity - other, velocity - other) == 0.0; };
    if (std::none_of(out.obstacles.begin(), out.obstacles.end(), same)) out.obstacles.push_back(velocity);
  }
  return out;
}

void Contact::leave_obstacles(State& state) const {
  if (!target_.empty()) state.obstacles.assign(target_.begin(), target_.end());
  const bool moves = !problem_.velocity.empty() && problem_.pressing != Pressing::still;
  for (std::size_t o = 0; o < state.obstacles.size(); ++o)
    state.obstacles[o].velocity = moves ? problem_.velocity[o] : Vec3d{};
}

void Contact::predict_friction(const VectorX& change, ContactLinearisation& linearisation) const {
  if (!frictional() || problem_.description().friction_law == FrictionLaw::semi_explicit) return;
  if (regularises() && slips_shortly(problem_, linearisation, change)) {
    linearisation.forget_friction();
    return;
  }
  const auto predict = [&](FrictionKind kind, FrictionPrediction& prediction) {
    prediction.renew([&](const auto& add) {
      OrderedLookup last;
      for (const Touching& t : set_) {
        if (!has_friction(problem_, t, kind)) continue;
        const Slipping s = slipping(problem_, t, kind, linearisation, change);
        const Vec3d* known = prediction.of(t.pair.key, last);
        if (s.limit > 0.0) add(t.pair.key, s.law.predict(s.slip, s.change, known, s.limit));
      }
    });
  };
  predict(FrictionKind::slipping, linearisation.friction);
  predict(FrictionKind::rolling, linearisation.rolling);
}

void Contact::leave(State& state) {
  state.contacts.swap(scratch_.records);
  leave_obstacles(state);
}

double Contact::accept(State& state, double spare) {
  const double put_in = ContactStiffness(problem_).accept(set_, spare, scratch_, state.contact_stiffness);
  leave(state);
  return put_in;
}

void Contact::accept_at_rest(State& state, bool arrived, double deepest) {
  ContactStiffness(problem_).accept_at_rest(set_, arrived, deepest, scratch_, state.contact_stiffness);
  leave(state);
}

void Contact::remember(State& state) {
  ContactStiffness(problem_).remember(set_, state.contact_stiffness, scratch_.records);
  leave(state);
}

double Contact::stiffen(State& state, bool at_rest) {
  std::swap(set_, deep_);
  restart(state, problem_.duration);
  return ContactStiffness(problem_).stiffen(deep_, set_, at_rest, state.contacts, state.contact_stiffness);
}

void Contact::initialise(State& state, const Parameters& parameters) const {
  if (state.contact_stiffness.size() == 0)
    state.contact_stiffness = ContactParameters(surfaces_, parameters).least_stiffness;
}

double Contact::energy_of(const State& state, const Parameters& parameters, ContactAtRest& rest) const {
  find_at_rest(state, parameters, rest);
  return rest.set.kept_energy(rest.problem);
}

std::vector<ContactReport> Contact::report(const State& state, const Parameters& parameters) const {
  ContactAtRest rest;
  find_at_rest(state, parameters, rest);
  std::vector<ContactReport> reports;
  for (const Touching& t : rest.set) reports.push_back(report_of(rest.problem, t));
  return reports;
}

void Contact::forget() {
  current_ = false;
  candidates_.forget();
  set_.clear();
  problem_.lagged.clear();
  problem_.leaving.clear();
  problem_.striking.clear();
}

void Contact::hold_sticking(const State& state, VectorX& change) const {
  const Model& model = problem_.model();
  for (const ContactRecord& record : state.contacts) {
    // Rods that stick to each other may well move together, which lagged friction is content with.
    if (!record.sticking || (record.key.b >= 0 && !unsymmetric())) continue;
    for (int edge : {record.key.a, record.key.b}) {
      if (edge < 0) continue;
      change.segment(model.tail_dof[at(edge)], model.dimension).setZero();
      change.segment(model.head_dof[at(edge)], model.dimension).setZero();
      if (!model.planar()) change(model.edge_dof[at(edge)]) = 0.0;
    }
  }
}

}  // namespace withe
