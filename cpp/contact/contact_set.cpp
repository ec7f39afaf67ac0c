#include "contact/contact_set.hpp"

#include <algorithm>
#include <iterator>

#include "contact/contact_friction.hpp"
#include "contact/contact_stiffness.hpp"
#include "contact/impacts.hpp"
#include "contact/plane_contact.hpp"
#include "contact/pressing.hpp"

namespace withe {
namespace {

// Greatest depth of entry, over the radius of a point: with the greatest depth of contact it stays on its side of a
// face.
constexpr double kMaxEntryDepth = 0.5;

/// Depth at which surfaces begin that come to each other from beside: as deep as they are. An edge carries them there,
/// and they do not press at once [m].
double depth_of_entry(const ContactProblem& problem, const ContactRecord* record, const Touching& t) {
  if (!t.pair.may_be_beyond() || problem.starting || (record && record->approach > 0.0)) return 0.0;
  const bool beside = problem.bodies.proximity(t.pair, problem.start->q).beyond;
  return beside ? std::clamp(t.pair.reach() - t.proximity.distance, 0.0, kMaxEntryDepth * t.pair.radius_a) : 0.0;
}

/// Sets the stored data of a contact, its energy and its pressing law.
void set_from(const ContactProblem& problem, const ContactRecord* record, Touching& t) {
  t.stiffness = t.pair.share * (record ? record->stiffness : first_stiffness(problem, t.pair));
  t.yielded = std::max(record ? record->yielded : problem.offset(t.pair), depth_of_entry(problem, record, t));
  t.approach = record ? record->approach : first_approach(problem, t.pair);
  t.age = record ? record->age : 0.0;
  if (record) t.stick = record->stick, t.roll = record->roll;
  set_pressing(problem, t);
}

}  // namespace

void ContactSet::clear() {
  q_.resize(0);
  touching_.clear();
}

Touching& ContactSet::add(const ContactProblem& problem, const ContactPair& pair, const Proximity& proximity) {
  Touching& t = touching_.emplace_back();
  t.pair = pair;
  t.proximity = proximity;
  problem.bodies.values(pair, q_, t.now);
  return t;
}

void ContactSet::set_forces(const ContactProblem& problem, OrderedLookup& records, Touching& t) {
  set_from(problem, problem.record_of(t.pair.key, records), t);
}

/// True of a point whose foot is outside of a face. An impact on the face returns its energy there, within a radius.
bool ContactSet::leaves_face(const ContactProblem& problem, const Touching& t) {
  return t.proximity.beyond &&
         !(t.approach > 0.0 && t.proximity.outside <= t.pair.radius_a && problem.record_of(t.pair.key) != nullptr);
}

void ContactSet::renew(const ContactProblem& problem, int i, const ContactRecord& record) {
  set_from(problem, &record, touching_[static_cast<std::size_t>(i)]);
}

/// Adds contacts of a list that act for any end of the step, if they are not among those from `first` to `last`, which
/// are sorted.
void ContactSet::add_all(const ContactProblem& problem, const std::vector<Touching>& acting, std::size_t first,
                         std::size_t last) {
  OrderedLookup records;
  for (const Touching& start : acting) {
    const auto from = touching_.begin() + static_cast<std::ptrdiff_t>(first);  // adding to them moves them
    const auto end = touching_.begin() + static_cast<std::ptrdiff_t>(last);
    const auto found = place_of(start.pair.key, from, end);
    if (found != end && found->pair.key == start.pair.key) continue;
    set_forces(problem, records, add(problem, start.pair, problem.bodies.proximity(start.pair, q_, true)));
  }
}

const Touching* ContactSet::pressing(const ContactKey& key) const {
  const auto found = std::find_if(touching_.begin(), touching_.end(),
                                  [&](const Touching& t) { return t.lagged < 0 && t.pair.key == key; });
  return found == touching_.end() ? nullptr : &*found;
}

double ContactSet::pressing_energy() const {
  double sum = 0.0;
  for (const Touching& t : touching_)
    if (t.lagged < 0) sum += t.energy.value;
  return sum;
}

double ContactSet::energy(const ContactProblem& problem) const {
  double sum = pressing_energy();
  for (const Touching& t : touching_)
    if (t.lagged < 0) sum += anchor_energy(problem, t);
  return sum;
}

double ContactSet::kept_energy(const ContactProblem& problem) const {
  double sum = pressing_energy();
  for (const Touching& t : touching_)
    if (t.lagged < 0) sum += kept_anchor_energy(problem, t);
  return sum;
}

double ContactSet::depth() const {
  double deepest = 0.0;
  for (const Touching& t : touching_)
    if (t.lagged < 0) deepest = std::max(deepest, t.depth());
  return deepest;
}

void contact_local(const ContactProblem& problem, const Touching& t, const ContactLinearisation& linearisation,
                   bool with_hessian, ContactLocal& out) {
  std::fill(std::begin(out.gradient), std::end(out.gradient), 0.0);
  if (with_hessian)
    for (auto& row : out.hessian) std::fill(std::begin(row), std::end(row), 0.0);
  if (beside_plane(problem, t)) {
    add_plane_contact(problem, t, PlaneForces::both, linearisation, with_hessian, out);
    return;
  }
  if (t.lagged < 0) add_pressing(problem, t, with_hessian, linearisation.geometric, out);
  add_friction(problem, t, linearisation, with_hessian, out);
}

}  // namespace withe
