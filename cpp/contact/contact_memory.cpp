#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/contact.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

bool by_key(const ContactRecord& a, const ContactRecord& b) { return a.key < b.key; }

// A stiffness follows forces that outgrow it at once, and is then so many times what they want; and it follows those
// for which it is so many times too great.
constexpr double kAhead = 1.25, kSlack = 32.0;
// Greatest depth that has yielded, over the smaller radius; what is beyond the depth that lasts presses again little by
// little: this much of it is left after a step.
constexpr double kMostYield = 0.02, kLastingYield = 0.01;
constexpr double kFading = 0.9;

/// A contact that is yet to come starts as stiff as its rods' greatest force has wanted, so that those which take over
/// from each other while surfaces slide have no need to change; that fades where it is much more than is wanted now.
void follow_forces(const VectorX& greatest, VectorX& stiffness) {
  for (Eigen::Index rod = 0; rod < greatest.size(); ++rod) {
    double& own = stiffness(rod);
    if (greatest(rod) > own)
      own = kAhead * greatest(rod);
    else if (own > kSlack * greatest(rod))
      own *= 0.8;
  }
}

}  // namespace

double Contact::energy() const {
  double sum = 0.0;
  const ContactDescription& contact = model_.description.contact;
  for (const Touching& t : touching_) {
    if (t.frozen >= 0) continue;
    sum += t.energy.value;
    const ContactPair& pair = t.pair;
    if (contact.friction_law != FrictionLaw::anchored || !(pair.friction > 0.0)) continue;
    double now[kContactUnknowns], unused[kContactUnknowns] = {};
    bodies().values(pair, q1_, now);
    const FrictionSetting f = setting(t);
    const FrictionForce<double> anchor = friction_gradient(f, now, unused);
    sum += 0.5 * dot(anchor.force, anchor.stick);
  }
  return sum;
}

double Contact::pressing_energy() const {
  double sum = 0.0;
  for (const Touching& t : touching_)
    if (t.frozen < 0) sum += t.energy.value;
  return sum;
}

double Contact::work_against(int i, const ContactLocal& local, const VectorX& change) const {
  int dofs[kContactUnknowns];
  unknowns(i, dofs);
  const double* g = local.gradient;
  double work = 0.0;
  for (int k = 0; k < kContactUnknowns; ++k)
    if (dofs[k] >= 0) work += g[k] * change(dofs[k]);
  return pair_of(i).key.b < 0 ? work - dot(shift_of(pair_of(i)), force_on_nodes(pair_of(i), local)) : work;
}

double Contact::pressing_gain(const VectorX& change) const {
  double gain = pressing_energy() - start_pressing_;
  for (int i = 0; i < count(); ++i) {
    const Touching& t = touching_[at(i)];
    if (t.frozen >= 0) continue;
    ContactLocal local{};
    press(t, false, local);
    gain -= work_against(i, local, change);
  }
  return gain;
}

/// Whether a contact has any friction, which it adds.
bool Contact::add_friction_alone(const Touching& t, ContactLocal& out) const {
  if (t.frozen >= 0)
    add_frozen_friction(t, false, out);
  else if (!freezes() && t.pair.friction > 0.0)
    add_friction(t, false, out);
  else
    return false;
  return true;
}

void Contact::friction_force(VectorX& out) const {
  if (!frictional()) return;
  out.setZero(model_.dof_count);
  for (int i = 0; i < count(); ++i) {
    ContactLocal local{};
    if (!add_friction_alone(touching_[at(i)], local)) continue;
    int dofs[kContactUnknowns];
    unknowns(i, dofs);
    for (int k = 0; k < kContactUnknowns; ++k)
      if (dofs[k] >= 0) out(dofs[k]) += local.gradient[k];
  }
}

double Contact::mean_friction_loss(const VectorX& change, const VectorX& start, const VectorX& end) const {
  if (!frictional() || start.size() != end.size()) return friction_loss(change);
  double loss = 0.5 * (start.dot(change) + end.dot(change));
  for (const Touching& t : touching_) {
    const ContactPair& pair = t.pair;
    if (!(pair.friction > 0.0)) continue;
    if (!shift_.empty() || !turn_.empty()) {
      ContactLocal local{};
      if (add_friction_alone(t, local)) loss += turning_work(t) - dot(shift_of(pair), force_on_nodes(pair, local));
    }
    if (!anchored()) continue;
    const ContactRecord now = record(t);
    const Vec3d before = -tangential_stiffness(pair, t.stiffness) * t.stick;
    loss += 0.5 * dot(before + now.friction, now.stick - t.stick);
  }
  return loss;
}

double Contact::friction_loss(const VectorX& change) const {
  double loss = 0.0;
  for (int i = 0; i < count(); ++i) {
    const Touching& t = touching_[at(i)];
    ContactLocal local{};
    if (!add_friction_alone(t, local)) continue;
    loss += work_against(i, local, change) + turning_work(t);
    if (!anchored()) continue;
    const ContactRecord end = record(t);
    loss += dot(end.friction, end.stick - t.stick);
  }
  return loss;
}

double Contact::depth() const {
  double deepest = 0.0;
  for (const Touching& t : touching_) {
    const ContactPair& pair = t.pair;
    if (t.frozen < 0) deepest = std::max(deepest, depth_of(pair, t));
  }
  return deepest;
}

double Contact::rounding(int i, double reach) const {
  const Touching& t = touching_[at(i)];
  const double stiffness = std::max(t.pressing.by_end, friction_slope(t));
  return 8.0 * std::numeric_limits<double>::epsilon() * reach * stiffness;
}

/// The depth that must press no more for a contact that becomes stiffer to press as hard as before, which takes energy;
/// to store as much as before, in an impact; or, where energy does not count, the former, but not so much that surfaces
/// could sink into each other for good.
double Contact::yielded_at(const Touching& t, double ratio, Keep keep) const {
  const ContactPair& pair = t.pair;
  const bool force = keep == Keep::force || t.approach == 0.0;
  const double wanted = (force ? -t.energy.first : t.energy.value) / (t.stiffness * ratio);
  double low = t.proximity.distance + t.yielded, high = pair.reach();
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    const ContactEnergy e = contact_energy(t.law.law, middle, pair.radii(), pair.tolerance);
    ((force ? -e.first : e.value) > wanted ? low : high) = middle;
  }
  if (keep == Keep::energy) return high - t.proximity.distance;
  return std::min(low - t.proximity.distance, kMostYield * pair.small_radius());
}

/// Gives a contact another stiffness, and another depth that presses no more. Anchors that become stiffer keep their
/// force, others their energy, and so their elastic slip changes. Returns the energy put in.
double Contact::change_stiffness(const Touching& t, double ratio, double yielded, ContactRecord& record) const {
  const ContactPair& pair = t.pair;
  const double energy = ratio * t.stiffness *
                        contact_energy(t.law.law, t.proximity.distance + yielded, pair.radii(), pair.tolerance).value;
  const double shorter = ratio > 1.0 ? 1.0 / ratio : 1.0 / std::sqrt(ratio);
  const double put_in =
      energy - t.energy.value - 0.5 * dot(record.friction, record.stick) * (ratio * shorter * shorter - 1.0);
  record.stick = shorter * record.stick;
  record.stiffness *= ratio;
  record.yielded = yielded;
  return put_in;
}

/// What has yielded wears off where surfaces that separate press no more, without work.
double Contact::worn(const Touching& t) const {
  return std::clamp(t.pair.reach() - t.proximity.distance, 0.0, t.yielded);
}

/// And fades where it is deep and surfaces rest, which takes work.
double Contact::faded(const Touching& t) const {
  const double lasting = kLastingYield * t.pair.small_radius();
  const double left = t.yielded > lasting ? lasting + kFading * (t.yielded - lasting) : t.yielded;
  return std::min(worn(t), left);
}

double Contact::wanted_ratio(const Touching& t, const ContactRecord& record) const {
  const ContactPair& pair = t.pair;
  if (fixed(pair)) return 1.0;
  const double wanted = wanted_stiffness(pair, record.force);
  if (wanted > record.stiffness) return kAhead * wanted / record.stiffness;
  if (record.approach > 0.0) return 1.0;  // as stiff as the impact that has only begun will want it
  // A contact that is about to open wants next to nothing, and more when it presses again.
  const double common = std::max(wanted, start_stiffness(pair, state_->contact_stiffness));
  return kSlack * common < record.stiffness ? 2.0 * common / record.stiffness : 1.0;
}

/// The greatest force that contact has to hold at a node, times 1e5 / m [Choi, dissertation, (5.16), (5.17)]: what all
/// other forces there add up to, inertia among them, is what contact and friction are.
double Contact::source_stiffness() const {
  constexpr double kSource = 1e5;  // [1/m]
  VectorX force = VectorX::Zero(model_.dof_count);
  ContactLocal local;
  int dofs[kContactUnknowns];
  for (int i = 0; i < count(); ++i) {
    this->local(i, false, local);
    unknowns(i, dofs);
    for (int k = 0; k < 12; ++k)
      if (dofs[k] >= 0) force(dofs[k]) += local.gradient[k];
  }
  return kSource * farthest(model_, force);
}

void Contact::record_friction(const Touching& t, ContactRecord& record) const {
  double now[kContactUnknowns], unused[kContactUnknowns] = {};
  bodies().values(t.pair, q1_, now);
  const FrictionForce<double> f = friction_gradient(setting(t), now, unused);
  record.stick = f.stick;
  record.friction = -f.force;
  record.sticking = f.sticking;
}

ContactRecord Contact::record(const Touching& t) const {
  const ContactPair& pair = t.pair;
  ContactRecord record;
  record.key = pair.key;
  record.force = -t.energy.first;
  record.stiffness = t.stiffness / pair.share;
  record.yielded = t.yielded;
  const bool coming = t.age == 0.0 && apart(t);
  if (pressing_ != Pressing::still && (coming || impact_share(pair, t) > 0.0)) {
    record.approach = t.approach;
    record.age = coming ? 0.0 : t.age + duration_;
  }
  if (frictional() && !freezes() && pair.friction > 0.0) record_friction(t, record);
  return record;
}

void Contact::keep(std::vector<ContactRecord>& records, State& state) const {
  std::sort(records.begin(), records.end(), by_key);
  if (!frozen_.empty()) record_frozen(records);
  state.contacts.swap(records);
  leave_obstacles(state);
}

void Contact::remember(State& state) const {
  std::vector<ContactRecord> records;
  for (const Touching& t : touching_) {
    const ContactPair& pair = t.pair;
    if (t.frozen >= 0 || t.proximity.distance >= pair.reach()) continue;
    records.push_back(record(t));
    if (record_of(pair.key) == nullptr) records.back().stiffness = start_stiffness(pair, state.contact_stiffness);
  }
  keep(records, state);
}

double Contact::accept(State& state, Keep keep, double spare) {
  struct Fading {
    const Touching* touching;
    std::size_t record;
  };
  std::vector<ContactRecord> records;
  std::vector<Fading> fading;
  const ContactDescription& contact = model_.description.contact;
  const bool source = contact.stiffness_rule == StiffnessRule::source && !(contact.stiffness > 0.0);
  const double common = source ? std::max(source_stiffness(), least_stiffness_.minCoeff()) : 0.0;
  VectorX greatest = least_stiffness_;
  double put_in = 0.0, wanted = 0.0;
  for (const Touching& t : touching_) {
    const ContactPair& pair = t.pair;
    if (t.frozen >= 0 || t.proximity.distance >= pair.reach()) continue;
    ContactRecord record = this->record(t);
    const double ratio = source && !fixed(pair) ? common / record.stiffness : wanted_ratio(t, record);
    if (ratio > 1.0) {
      put_in += change_stiffness(t, ratio, yielded_at(t, ratio, keep), record);
    } else if (ratio < 1.0 || record.approach > 0.0) {
      put_in += change_stiffness(t, ratio, worn(t), record);
    } else if (t.yielded > 0.0) {
      ContactRecord unused;
      wanted += change_stiffness(t, 1.0, faded(t), unused);
      fading.push_back({&t, records.size()});
    }
    for (int rod : {pair.rod_a, pair.rod_b})
      if (rod >= 0) greatest(rod) = std::max(greatest(rod), source ? common : wanted_stiffness(pair, -t.energy.first));
    records.push_back(record);
  }
  // Energy grows with depth the faster the deeper, so that a part of the way takes less than that part of the work.
  spare -= put_in;
  const double part = wanted > spare ? spare / wanted : 1.0;
  for (const auto& [t, number] : fading) {
    const double left = worn(*t) + part * (faded(*t) - worn(*t));
    put_in += change_stiffness(*t, 1.0, left, records[number]);
  }
  this->keep(records, state);
  if (!(contact.stiffness > 0.0)) follow_forces(greatest, state.contact_stiffness);
  return put_in;
}

double Contact::stiffen(State& state, Keep keep) {
  // Pairs are renumbered when candidates are found anew for the start of the step.
  struct Deep {
    ContactPair pair;
    double factor, stiffness;
  };
  std::vector<Deep> deep;
  for (const Touching& t : touching_) {
    const ContactPair& pair = t.pair;
    const double depth = depth_of(pair, t);
    if (t.frozen < 0 && depth > 2.0 * kDepth) deep.push_back({pair, std::min(100.0, depth / kDepth), t.stiffness});
  }
  restart(state, duration_);
  double put_in = 0.0;
  for (const auto& [pair, factor, stiffness] : deep) {
    ContactRecord* record = find_record(state.contacts, pair.key);
    const auto pressed = std::find_if(touching_.begin(), touching_.end(),
                                      [&, &key = pair.key](const Touching& s) { return s.pair.key == key; });
    if (const ContactRecord* renewed = find_record(renewed_, pair.key)) {
      const auto place = std::lower_bound(state.contacts.begin(), state.contacts.end(), *renewed, by_key);
      if (record)
        *record = *renewed;
      else
        record = &*state.contacts.insert(place, *renewed);
    }
    if (record && pressed != touching_.end()) {
      put_in += change_stiffness(*pressed, factor, yielded_at(*pressed, factor, keep), *record);
      continue;
    }
    if (pair.stiffness > 0.0) {
      ContactRecord own;
      own.key = pair.key;
      own.stiffness = factor * stiffness / pair.share;
      state.contacts.insert(std::lower_bound(state.contacts.begin(), state.contacts.end(), own, by_key), own);
      continue;
    }
    for (int rod : {pair.rod_a, pair.rod_b})
      if (rod >= 0)
        state.contact_stiffness(rod) = std::max(state.contact_stiffness(rod), factor * stiffness / pair.share);
  }
  return put_in;
}

void Contact::hold_sticking(const State& state, VectorX& change) const {
  for (const ContactRecord& record : state.contacts) {
    // Rods that stick to each other may well move together, which lagged friction is content with.
    if (!record.sticking || (record.key.b >= 0 && !unsymmetric())) continue;
    for (int edge : {record.key.a, record.key.b}) {
      if (edge < 0) continue;
      change.segment(model_.tail_dof[at(edge)], model_.dimension).setZero();
      change.segment(model_.head_dof[at(edge)], model_.dimension).setZero();
      if (!model_.planar()) change(model_.edge_dof[at(edge)]) = 0.0;
    }
  }
}

/// A step that goes nowhere: obstacles stay where they are in the state.
void Contact::look_at(const State& state, const Parameters& parameters) {
  std::vector<ObstaclePlace> target = std::exchange(target_, {});
  const Pressing pressing = pressing_;
  begin(state, parameters, 1.0, Pressing::still);
  pressing_ = pressing;
  target_ = std::move(target);
}

double Contact::energy_of(const State& state, const Parameters& parameters) {
  const State* kept = state_;
  const double duration = duration_;
  look_at(state, parameters);
  state_ = kept;
  duration_ = duration;
  return start_energy_;
}

std::vector<ContactReport> Contact::report(const State& state, const Parameters& parameters) {
  look_at(state, parameters);
  std::vector<ContactReport> reports;
  for (const Touching& t : touching_) {
    const ContactPair& pair = t.pair;
    ContactReport r;
    r.key = pair.key;
    r.distance = t.proximity.distance;
    r.gap = t.proximity.distance - pair.radii();
    r.s = t.proximity.points.s;
    r.t = t.proximity.points.t;
    r.normal = t.proximity.normal;
    r.force = -t.energy.first;
    Vec3d x[4];
    bodies().end_points(pair, state.q, x);
    Vec3d on_a = x[0] + r.s * (x[1] - x[0]);
    if (pair.curve()) {
      on_a = curve_point(*pair.piece.weights, x, t.proximity.points.s);
      r.key.a = pair.piece.edge[pair.piece.weights->edges > 1 && r.s > 0.0];
      r.s = pair.piece.weights->along(t.proximity.points.s);
    }
    r.point = on_a - (pair.radius_a + 0.5 * r.gap) * t.proximity.normal;
    if (const ContactRecord* record = record_of(pair.key)) {
      r.friction = record->friction;
      r.sticking = record->sticking;
    }
    reports.push_back(r);
  }
  return reports;
}

void Contact::forget() {
  current_ = false;
  candidates_.forget();
  touching_.clear();
  lagged_.clear();
  leaving_.clear();
  q1_.resize(0);
}

}  // namespace withe
