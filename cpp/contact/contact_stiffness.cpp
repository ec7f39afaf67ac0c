#include "contact/contact_stiffness.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "contact/contact_friction.hpp"
#include "contact/contact_work.hpp"
#include "contact/impacts.hpp"

namespace withe {
namespace {

bool by_key(const ContactRecord& a, const ContactRecord& b) { return a.key < b.key; }

// Ratio of the new stiffness of a contact to the required one, when the force outgrows the stiffness. Later increases
// of the force by up to a quarter then change nothing.
constexpr double kStiffnessMargin = 1.25;
// Ratio of the force that a stiffness can carry to the present force, above which the stiffness decreases.
constexpr double kMaxForceMargin = 32.0;
// Share of the yielded depth beyond kDepth that presses again after a step, where surfaces rest.
constexpr double kFadingPerStep = 0.1;
// Speed of resting surfaces that part, over `rest_speed`.
constexpr double kMaxFadingSpeed = 0.1;
// Force for which a contact is stiff in the step of an impact with a restitution below 1, over the force that stops its
// mass within the step. The depth at the end of this step is lost.
constexpr double kStrikeMargin = 10.0;
// Force of surfaces that a scene draws near each other, besides the weight of their edges, over the force for which the
// contact is stiff.
constexpr double kMaxDrawnForce = 1e-6;

/// A new contact starts with the stiffness that the greatest force of its rods has needed. When one contact takes over
/// from another while surfaces slide, no stiffness then changes. The start stiffness decays if it is far above the
/// need.
void follow_forces(const ContactProblem& problem, const VectorX& greatest, VectorX& stiffness) {
  const VectorX& firm = problem.parameters->firm_stiffness;
  for (Eigen::Index rod = 0; rod < greatest.size(); ++rod) {
    double& own = stiffness(rod);
    if (greatest(rod) > own)
      own = kStiffnessMargin * greatest(rod);
    else if (own > problem.stiffness_to_bear_more(firm(rod), greatest(rod), kMaxForceMargin))
      own *= 0.8;
  }
}

/// Yielded depth wears off where separating surfaces press no more, without work, down to the depth that their bodies'
/// contacts begin with.
double worn(const ContactProblem& problem, const Touching& t) {
  const double least = std::min(problem.offset(t.pair), t.yielded);
  return std::clamp(t.pair.reach() - t.proximity.distance, least, t.yielded);
}

/// The yielded depth also decays while surfaces rest, which takes work from other dissipation. It decays until surfaces
/// part, and slowly: they press at most about half as hard again after a step. Otherwise dissipated friction energy
/// would throw them off.
double faded(const ContactProblem& problem, const Touching& t) {
  const double beyond = t.yielded - kDepth * t.pair.scale, left = worn(problem, t);
  if (!(beyond > 0.0 && t.energy.second > 0.0)) return left;
  const double parted = t.proximity.distance - start_distance(problem, t.pair);
  if (parted > kMaxFadingSpeed * rest_speed(problem, t.pair) * problem.duration) return left;
  return std::min(left, t.yielded - std::min(kFadingPerStep * beyond, -0.5 * t.energy.first / t.energy.second));
}

/// Share of an edge's weight that a contact holds up, where edges touch several others. Contacts of the same bodies,
/// which follow each other, are counted once.
class SharedWeight {
 public:
  SharedWeight(const ContactProblem& problem, const ContactSet& set) : problem_(problem), set_(set) {}

  double on(const ContactPair& pair) {  // [N]
    const std::pair<int, int> bodies = bodies_of(pair);
    if (contacts_ == 0 || bodies != bodies_) {
      bodies_ = bodies;
      contacts_ = std::count_if(set_.begin(), set_.end(),
                                [&](const Touching& t) { return t.lagged < 0 && bodies_of(t.pair) == bodies; });
    }
    const std::vector<int>& first = problem_.model().rod_first_edge;
    const int edges = problem_.model().is_surface(pair.key.a) ? 1 : first[at(pair.rod_a + 1)] - first[at(pair.rod_a)];
    const double share = std::min(1.0, static_cast<double>(edges) / static_cast<double>(contacts_));
    return share * pair.share * problem_.mass_of(pair) * problem_.parameters->gravity;
  }

 private:
  static std::pair<int, int> bodies_of(const ContactPair& pair) {
    return {pair.rod_a, pair.key.b < 0 ? pair.key.b : pair.rod_b};
  }

  const ContactProblem& problem_;
  const ContactSet& set_;
  std::pair<int, int> bodies_;
  std::ptrdiff_t contacts_ = 0;
};

/// Stiffness of a whole node that a contact's force requires [N/m].
double wanted_stiffness(const ContactProblem& problem, const Touching& t) {
  return problem.stiffness_to_bear(t.pair, -t.energy.first / t.pair.share);
}

/// Law of a contact with a multiplied stiffness and a yielded depth.
PressingLaw law_at(const ContactProblem& problem, const Touching& t, double ratio, double yielded) {
  const double stiffness = ratio * t.stiffness;
  return {t.law.law, t.pair.radii(), problem.tolerance(t.pair, stiffness / t.pair.share), stiffness, yielded};
}

/// Distance of centrelines, with the yielded depth, at which the force, or energy, of a contact with a multiplied
/// stiffness equals `wanted` for unit stiffness, or is less by rounding.
double distance_at(const ContactProblem& problem, const Touching& t, double ratio, bool force, double wanted) {
  const PressingLaw law = law_at(problem, t, ratio, 0.0);
  double low = t.proximity.distance + t.yielded, high = t.pair.reach();
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    const ContactEnergy e = law.energy(middle);
    ((force ? -e.first : e.value) > wanted ? low : high) = middle;
  }
  return high;
}

/// Force of a contact at its present distance, with a multiplied stiffness and a yielded depth [N].
double force_at(const ContactProblem& problem, const Touching& t, double ratio, double yielded) {
  return -ratio * t.stiffness * law_at(problem, t, ratio, yielded).energy(t.proximity.distance).first;
}

/// Stiffness that stops an edge's mass, within the step or within the depth of contact, at the speed at which the ends
/// meet. For a plane that speed is along the normal, which is known before the ends meet. Where a step's force does as
/// much work as contact stores, the stiffness also stores the energy of the mass in that depth.
double impact_stiffness(const ContactProblem& problem, const ContactPair& pair) {
  if (problem.fixed(pair)) return 0.0;
  const Model& model = problem.model();
  const auto end_node = [&](int edge, int end) { return (end == 0 ? model.edge_tail : model.edge_head)[at(edge)]; };
  const VectorX& velocities = problem.start->v;
  const bool obstacle = pair.key.b < 0;
  const Vec3d moved = problem.velocity_of(pair);
  const Obstacle* plane = obstacle ? &problem.bodies.obstacle(pair) : nullptr;
  if (plane != nullptr && plane->kind != ObstacleKind::plane) plane = nullptr;
  const auto speed_of = [&](const Vec3d& v) {
    return plane != nullptr ? std::max(0.0, -dot(plane->other, v)) : std::sqrt(dot(v, v));
  };
  double fastest = 0.0;
  for (int k = 0; k < (pair.curve() ? pair.piece.weights->nodes : 2); ++k) {
    const int node_a = pair.curve() ? pair.piece.node[k] : end_node(pair.key.a, k);
    const Vec3d v = local_position(model, velocities, node_a) - moved;
    if (obstacle) {
      fastest = std::max(fastest, speed_of(v));
      continue;
    }
    for (int l = 0; l < 2; ++l)
      fastest = std::max(fastest, speed_of(v - local_position(model, velocities, end_node(pair.key.b, l))));
  }
  const double mass = problem.mass_of(pair);
  if (pair.restitution < 1.0) {
    // In shorter steps surfaces hardly enter each other before the impulses of the impact act.
    const double shortest = fastest > 0.0 ? kDepth * pair.scale / (kStrikeMargin * fastest) : 0.0;
    return problem.stiffness_to_bear(pair, kStrikeMargin * mass * fastest / std::max(problem.duration, shortest));
  }
  const auto stores = [&](double speed) { return problem.stiffness_to_store(pair, 0.5 * mass * speed * speed); };
  const double stops = std::min(problem.stiffness_to_bear(pair, mass * fastest / problem.duration), stores(fastest));
  if (problem.pressing < Pressing::mean) return stops;
  return std::max(stops, stores(approach_speed(problem, pair)));
}

}  // namespace

double start_stiffness(const ContactProblem& problem, const ContactPair& pair, const VectorX& stiffness) {
  if (pair.stiffness > 0.0) return pair.stiffness;
  double start = stiffness(pair.rod_a);
  if (pair.rod_b >= 0) start = std::max(start, stiffness(pair.rod_b));
  if (problem.description().law != ContactLaw::spillmann_teschner) return start;
  // A force 2 k d leads out of the depth d within the step.
  const VectorX& masses = problem.parameters->edge_mass;
  const double a = masses(pair.key.a);
  const double mass = pair.key.b < 0 ? a : a * masses(pair.key.b) / (a + masses(pair.key.b));
  return std::max(start, 0.5 * mass / (problem.duration * problem.duration));
}

double first_stiffness(const ContactProblem& problem, const ContactPair& pair) {
  const double start = start_stiffness(problem, pair, problem.start->contact_stiffness);
  if (problem.pressing == Pressing::still || !meets(problem, pair)) return start;
  return std::max(start, impact_stiffness(problem, pair));
}

/// Yielded depth for which a stiffened contact stores no more energy than before and, except in an impact, presses no
/// harder.
double ContactStiffness::yielded_at(const Touching& t, double ratio) const {
  const double stiffness = t.stiffness * ratio;
  double distance = distance_at(problem_, t, ratio, false, t.energy.value / stiffness);
  if (t.approach == 0.0)
    distance = std::max(distance, distance_at(problem_, t, ratio, true, -t.energy.first / stiffness));
  return distance - t.proximity.distance;
}

/// Gives a contact another stiffness, and another depth that presses no more. Anchors that become stiffer keep their
/// force, others their energy, and so their elastic slip changes. Returns the energy put in.
double ContactStiffness::change_stiffness(const Touching& t, double ratio, double yielded,
                                          ContactRecord& record) const {
  const ContactPair& pair = t.pair;
  const double energy = ratio * t.stiffness * law_at(problem_, t, ratio, yielded).energy(t.proximity.distance).value;
  const double shorter = ratio > 1.0 ? 1.0 / ratio : 1.0 / std::sqrt(ratio);
  const double rolled = anchor_stiffness(pair, FrictionKind::rolling, t.stiffness) * dot(record.roll, record.roll);
  const double anchored = 0.5 * (rolled - dot(record.friction, record.stick));
  const double put_in = energy - t.energy.value + anchored * (ratio * shorter * shorter - 1.0);
  record.stick = shorter * record.stick;
  record.roll = shorter * record.roll;
  record.stiffness *= ratio;
  record.yielded = yielded;
  return put_in;
}

/// Leaves no more than a weight on a contact after an impact. Returns the energy put in.
double ContactStiffness::settle(const Touching& t, double weight, ContactRecord& record) const {
  const double wanted = start_stiffness(problem_, t.pair, problem_.start->contact_stiffness),
               ratio = problem_.fixed(t.pair) ? 1.0 : wanted / record.stiffness;
  const double distance = distance_at(problem_, t, ratio, true, weight / (ratio * t.stiffness));
  record.stick = record.roll = Vec3d{};
  return change_stiffness(t, ratio, std::max(0.0, distance - t.proximity.distance), record) -
         anchor_energy(problem_, t);
}

double ContactStiffness::wanted_ratio(const Touching& t, const ContactRecord& record) const {
  if (problem_.fixed(t.pair)) return 1.0;
  const double wanted = wanted_stiffness(problem_, t);
  if (wanted > record.stiffness) return kStiffnessMargin * wanted / record.stiffness;
  if (record.approach > 0.0) return 1.0;  // a new impact has its required stiffness
  // A contact that is about to open needs almost no stiffness, and more when it presses again.
  const double common = std::max(wanted, start_stiffness(problem_, t.pair, problem_.start->contact_stiffness));
  const auto bears = [&](double times) {
    return problem_.stiffness_to_bear_more(problem_.firm_stiffness(t.pair), common, times);
  };
  return bears(kMaxForceMargin) < record.stiffness ? bears(2.0) / record.stiffness : 1.0;
}

/// The greatest force that contact must carry at a node, times 1e5 / m [Choi, dissertation, (5.16), (5.17)]. Contact
/// and friction balance the sum of all other forces there, inertia included. 0 under another rule.
double ContactStiffness::source_stiffness(const ContactSet& set, VectorX& force) const {
  constexpr double kSource = 1e5;  // [1/m]
  if (problem_.description().stiffness_rule != StiffnessRule::source) return 0.0;
  if (problem_.surfaces->parameters().contact_stiffness > 0.0) return 0.0;
  contact_force(problem_, set, force);
  return std::max(kSource * farthest(problem_.model(), force), problem_.parameters->least_stiffness.minCoeff());
}

ContactRecord ContactStiffness::record(const Touching& t) const {
  ContactRecord record;
  record.key = t.pair.key;
  record.force = t.struck() ? -t.pressing.first : -t.energy.first;
  record.stiffness = t.stiffness / t.pair.share;
  record.yielded = t.yielded;
  if (problem_.pressing != Pressing::still) {
    const bool coming = comes_near(problem_, t);
    if (!t.struck() && (coming || impact_lasts(problem_, t))) {
      record.approach = t.approach;
      record.age = coming ? 0.0 : t.age + problem_.duration;
    }
  }
  record_friction(problem_, t, record);
  return record;
}

bool ContactStiffness::presses(const Touching& t) const {
  return t.lagged < 0 && problem_.touch(t.pair, t.proximity.distance, t.yielded);
}

/// Sorts records, and adds the results of lagged friction.
void ContactStiffness::finish(const ContactSet& set, std::vector<ContactRecord>& records) const {
  std::sort(records.begin(), records.end(), by_key);
  for (const Touching& t : set) {
    if (t.lagged < 0) continue;
    if (ContactRecord* record = find_record(records, t.pair.key)) record_lagged_friction(problem_, t, *record);
  }
}

void ContactStiffness::remember(const ContactSet& set, const VectorX& stiffness,
                                std::vector<ContactRecord>& records) const {
  records.clear();
  for (const Touching& t : set) {
    if (!presses(t)) continue;
    records.push_back(record(t));
    if (problem_.record_of(t.pair.key) == nullptr)
      records.back().stiffness = start_stiffness(problem_, t.pair, stiffness);
  }
  finish(set, records);
}

double ContactStiffness::accept(const ContactSet& set, double spare, StiffnessScratch& scratch,
                                VectorX& stiffness) const {
  auto& [records, fading, greatest, force, pressing, change] = scratch;
  records.clear();
  fading.clear();
  const bool given = problem_.surfaces->parameters().contact_stiffness > 0.0;
  const double common = source_stiffness(set, force);
  const bool source = common > 0.0;
  greatest = problem_.parameters->least_stiffness;
  double put_in = 0.0, wanted = 0.0;
  SharedWeight weight(problem_, set);
  for (const Touching& t : set) {
    const ContactPair& pair = t.pair;
    if (!presses(t)) continue;
    ContactRecord record = this->record(t);
    if (t.strike.happens) {
      if (record.approach == 0.0) put_in += settle(t, t.struck() ? weight.on(pair) : 0.0, record);
      records.push_back(record);
      continue;
    }
    if (t.proximity.beyond && (record.approach == 0.0 || t.proximity.outside > pair.radius_a)) {
      // The next step begins without it.
      put_in -= t.energy.value + anchor_energy(problem_, t);
      continue;
    }
    double ratio = source && !problem_.fixed(pair) ? common / record.stiffness : wanted_ratio(t, record);
    if (ratio > 1.0) {
      put_in += change_stiffness(t, ratio, yielded_at(t, ratio), record);
    } else if (ratio < 1.0 || record.approach > 0.0) {
      put_in += change_stiffness(t, ratio, worn(problem_, t), record);
    } else if (t.yielded > 0.0) {
      ContactRecord unused;
      wanted += change_stiffness(t, 1.0, faded(problem_, t), unused);
      fading.push_back({&t, records.size()});
    }
    for (int rod : {pair.rod_a, pair.rod_b})
      if (rod >= 0) greatest(rod) = std::max(greatest(rod), source ? common : wanted_stiffness(problem_, t));
    records.push_back(record);
  }
  // Energy grows with depth the faster the deeper, so that a part of the way takes less than that part of the work.
  spare = std::max(spare - put_in, 0.0);
  const double part = wanted > spare ? spare / wanted : 1.0;
  for (const auto& [t, number] : fading) {
    const double left = worn(problem_, *t) + part * (faded(problem_, *t) - worn(problem_, *t));
    put_in += change_stiffness(*t, 1.0, left, records[number]);
  }
  finish(set, records);
  if (!given) follow_forces(problem_, greatest, stiffness);
  return put_in;
}

void ContactStiffness::accept_at_rest(const ContactSet& set, bool arrived, double deepest, StiffnessScratch& scratch,
                                      VectorX& stiffness) const {
  const double source = source_stiffness(set, scratch.force);
  VectorX& greatest = scratch.greatest;
  greatest = problem_.parameters->least_stiffness;
  for (const Touching& t : set) {
    if (source > 0.0 || !presses(t) || problem_.fixed(t.pair)) continue;
    const double wanted = wanted_stiffness(problem_, t);
    const bool more = arrived ? wanted > t.stiffness / t.pair.share : t.depth() > deepest;
    for (int rod : {t.pair.rod_a, t.pair.rod_b}) {
      if (rod < 0) continue;
      greatest(rod) = std::max(greatest(rod), wanted);
      if (more) stiffness(rod) = std::max(stiffness(rod), kStiffnessMargin * wanted);
    }
  }
  // Contacts that a rod met on the way are no reason for a high stiffness.
  for (Eigen::Index rod = 0; arrived && source == 0.0 && rod < greatest.size(); ++rod)
    if (stiffness(rod) >
        problem_.stiffness_to_bear_more(problem_.parameters->firm_stiffness(rod), greatest(rod), kMaxForceMargin))
      stiffness(rod) = kStiffnessMargin * greatest(rod);
  scratch.records.clear();
  scratch.pressing = scratch.change = 0.0;
  for (const Touching& t : set) {
    if (!presses(t)) continue;
    ContactRecord record = this->record(t);
    record.approach = record.age = 0.0;
    if (problem_.fixed(t.pair)) {
      record.yielded = worn(problem_, t);
    } else {
      const double wanted = source > 0.0 ? source : start_stiffness(problem_, t.pair, stiffness);
      change_stiffness(t, wanted / record.stiffness, 0.0, record);
    }
    const double now = force_at(problem_, t, record.stiffness * t.pair.share / t.stiffness, record.yielded);
    scratch.pressing = std::max(scratch.pressing, record.force);
    scratch.change = std::max(scratch.change, std::abs(now - record.force));
    scratch.records.push_back(record);
  }
  finish(set, scratch.records);
}

double ContactStiffness::wanted_ratio(const ContactSet& set) const {
  double ratio = 1.0;
  for (const Touching& t : set)
    if (t.lagged < 0 && !problem_.fixed(t.pair))
      ratio = std::max(ratio, wanted_stiffness(problem_, t) * t.pair.share / t.stiffness);
  return ratio;
}

double ContactStiffness::stiffen(const ContactSet& set, const ContactSet& start, bool at_rest,
                                 std::vector<ContactRecord>& records, VectorX& stiffness) const {
  double put_in = 0.0;
  for (const Touching& deep : set) {
    const ContactPair& pair = deep.pair;
    const double depth = deep.depth();
    if (deep.lagged >= 0 || !(depth > 2.0 * kDepth)) continue;
    if (at_rest && !problem_.fixed(pair)) continue;  // see `accept_at_rest`
    const double factor = std::min(100.0, depth / kDepth);
    ContactRecord* record = find_record(records, pair.key);
    if (const ContactRecord* renewed = find_record(problem_.renewed, pair.key)) {
      if (record)
        *record = *renewed;
      else
        record = &*records.insert(std::lower_bound(records.begin(), records.end(), *renewed, by_key), *renewed);
    }
    const Touching* pressed = start.pressing(pair.key);
    if (record && pressed) {
      const double yielded = at_rest ? pressed->yielded : yielded_at(*pressed, factor);
      put_in += change_stiffness(*pressed, factor, yielded, *record);
      continue;
    }
    if (pair.stiffness > 0.0) {
      ContactRecord own;
      own.key = pair.key;
      own.stiffness = factor * deep.stiffness / pair.share;
      records.insert(std::lower_bound(records.begin(), records.end(), own, by_key), own);
      continue;
    }
    for (int rod : {pair.rod_a, pair.rod_b})
      if (rod >= 0) stiffness(rod) = std::max(stiffness(rod), factor * deep.stiffness / pair.share);
  }
  return put_in;
}

void ContactStiffness::renew(ContactSet& start, std::vector<ContactRecord>& records) const {
  records.clear();
  const bool still = problem_.pressing == Pressing::still, begins = !still || problem_.start->contacts.empty();
  SharedWeight weight(problem_, start);
  OrderedLookup at_start;
  for (int i = 0; i < start.count(); ++i) {
    const Touching& t = start[i];
    ContactRecord record;
    bool drawn = false, struck = false;
    if (const ContactRecord* known = find_record(problem_.start->contacts, t.pair.key, at_start)) {
      struck = known->approach == 0.0;
      if (struck && !is_struck(t)) continue;  // they rest until they have left each other
      record = *known;
    } else {
      record.key = t.pair.key;
      record.stiffness = t.stiffness / t.pair.share;
      record.yielded = t.yielded;
      record.force = weight.on(t.pair);
      drawn = begins && begins_at_rest(t, record);
      if (drawn) start.renew(problem_, i, record);
    }
    const bool anew = !still && begins_anew(t, struck, record);
    if (!drawn && !anew) continue;
    // An impact with a restitution below 1 begins without energy. The energy that its contact stored is lost.
    if (anew && t.pair.restitution == 1.0) start.renew(problem_, i, record);
    records.push_back(record);
  }
  std::sort(records.begin(), records.end(), by_key);
}

/// At the start, drawn surfaces press on each other with their weight only, for any stiffness of their contact: the
/// depth beyond has yielded. A given stiffness keeps its law.
bool ContactStiffness::begins_at_rest(const Touching& t, ContactRecord& record) const {
  if (problem_.fixed(t.pair)) return false;
  const double most = record.force + kMaxDrawnForce * 2.0 * kDepth * t.pair.scale * t.stiffness;
  if (!(-t.energy.first > most)) return false;
  record.yielded = distance_at(problem_, t, 1.0, true, most / t.stiffness) - t.proximity.distance;
  return true;
}

/// Surfaces that a scene begins with within the contact tolerance may fall onto each other or rest. They fall if they
/// store less energy than motion and weight will supply. Later, surfaces may part and meet again within the tolerance,
/// or a stronger impact may hit surfaces before the first impact is over. Their approach speed then belongs to a new
/// impact, which is compressing while its age is 0. The contact gets the stiffness of a new impact, without a change of
/// energy.
bool ContactStiffness::begins_anew(const Touching& t, bool struck, ContactRecord& record) const {
  const ContactPair& pair = t.pair;
  double speed = approach_speed(problem_, pair);
  if (record.approach == 0.0 && !struck) {
    const double given =
        0.5 * speed * speed + problem_.parameters->gravity * std::max(t.proximity.distance - pair.radii(), 0.0);
    if (!(t.energy.value < pair.share * problem_.mass_of(pair) * given)) return false;
    speed = std::max(speed, least_approach(problem_, pair));
  } else {
    const bool again = t.apart() && t.age > 0.0 && speed > 0.0;
    // Surfaces that met in the last step may have turned round in it: then their speed is that at which they part.
    if (!struck) speed = std::abs(nearing(problem_, pair));
    if (!again && speed <= t.approach) return false;
  }
  record.approach = speed;
  record.age = 0.0;
  const double ratio = impact_stiffness(problem_, pair) / record.stiffness;
  if (pair.restitution < 1.0) {
    record.stiffness *= std::max(ratio, 1.0);
    return true;
  }
  if (!t.apart() || !(ratio > 1.0)) return true;
  Touching renewed = t;
  renewed.approach = speed;
  record.yielded = yielded_at(renewed, ratio);
  record.stiffness *= ratio;
  record.stick = (1.0 / std::sqrt(ratio)) * record.stick;
  record.roll = (1.0 / std::sqrt(ratio)) * record.roll;
  return true;
}

/// True if two resting surfaces strike each other in this step. Either they have come apart, within the tolerance of
/// contact, and approach faster than they rest; or the obstacle under a rod jumps to a velocity that strikes the rod.
/// In the second case only a restitution below 1 needs the impact: an elastic contact throws the rod off as it is.
bool ContactStiffness::is_struck(const Touching& t) const {
  const ContactPair& pair = t.pair;
  if (t.apart() && (problem_.pressing >= Pressing::mean || pair.restitution < 1.0))
    return approach_speed(problem_, pair) > rest_speed(problem_, pair);
  if (pair.key.b >= 0 || problem_.velocity.empty() || pair.restitution >= 1.0) return false;
  const Vec3d jump = problem_.velocity_of(pair) - problem_.start->obstacles[at(-1 - pair.key.b)].velocity;
  const double rest = rest_speed(problem_, pair);
  return dot(jump, jump) > rest * rest && approach_speed(problem_, pair) > rest;
}

}  // namespace withe
