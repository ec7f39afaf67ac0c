#include <algorithm>
#include <string_view>

#include "forces/stokeslets.hpp"
#include "run/checks.hpp"
#include "world/archive.hpp"
#include "world/exchange.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

constexpr std::uint64_t kMagic = 0x4353454854495757ull;

/// FNV-1a.
std::uint64_t hash_of(std::string_view bytes) {
  std::uint64_t hash = 14695981039346656037ull;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  return hash;
}

/// Loads that the drawing has; those put on since follow them.
std::size_t drawn_loads(const SceneDescription& scene) {
  return static_cast<std::size_t>(
      std::count_if(scene.loads.begin(), scene.loads.end(), [](const LoadDescription& load) { return !load.added; }));
}

void write_added_loads(Writer& w, const SceneDescription& scene) {
  const std::size_t drawn = drawn_loads(scene);
  w(static_cast<std::int64_t>(scene.loads.size() - drawn));
  for (std::size_t k = drawn; k < scene.loads.size(); ++k) {
    const LoadDescription& load = scene.loads[k];
    w(static_cast<int>(load.kind));
    w(load.pass.rod);
    w(load.pass.node);
    w(load.follower);
    w(static_cast<std::int64_t>(load.values.rows()));
  }
}

std::vector<LoadDescription> read_added_loads(Reader& r, const SceneDescription& scene) {
  std::int64_t count = 0;
  r(count);
  require(count >= 0 && count < 1 << 20, "snapshot is damaged: impossible number of loads");
  std::vector<LoadDescription> loads(static_cast<std::size_t>(count));
  for (LoadDescription& load : loads) {
    int kind = 0;
    r(kind);
    require(kind >= 0 && kind <= static_cast<int>(LoadKind::pressure), "snapshot is damaged: unknown load");
    load.kind = static_cast<LoadKind>(kind);
    r(load.pass.rod);
    r(load.pass.node);
    r(load.follower);
    std::int64_t rows = 0;
    r(rows);
    require(rows >= 0 && rows < 1 << 28, "snapshot is damaged: impossible load");
    load.values.setZero(rows, 3);
    check_load(scene, load);
    load.added = true;
  }
  return loads;
}

void write_hand(Writer& w, const HandDescription& hand) {
  w(hand.at), w(hand.length), w(hand.posed), w(hand.position), w(hand.rotation), w(hand.yields);
  for (double k : hand.stiffness) w(k);
  w(hand.force_limit), w(hand.slides), w(hand.friction), w(hand.feeds), w(hand.feed_rate), w(hand.node);
}

void read_hand(Reader& r, HandDescription& hand) {
  r(hand.at), r(hand.length), r(hand.posed), r(hand.position), r(hand.rotation), r(hand.yields);
  for (double& k : hand.stiffness) r(k);
  r(hand.force_limit), r(hand.slides), r(hand.friction), r(hand.feeds), r(hand.feed_rate), r(hand.node);
}

bool same_hand(const HandDescription& a, const HandDescription& b) {
  Writer of_a, of_b;
  write_hand(of_a, a);
  write_hand(of_b, b);
  return of_a.bytes == of_b.bytes;
}

/// As it was set while running; where it was not, that of the drawing holds.
void write_contact(Writer& w, const ContactDescription& contact) {
  for (double x : {contact.friction, contact.slip_tolerance, contact.restitution, contact.stiffness}) w(x);
  w(contact.obstacle_restitution);
  w(contact.obstacle_friction);
  w(static_cast<std::int64_t>(contact.obstacle_rolling.size()));
  w(contact.obstacle_rolling);
  w(static_cast<std::int64_t>(contact.pairs.size()));
  for (const ContactPairDescription& p : contact.pairs) {
    w(p.first), w(p.second), w(p.ignored);
    w(p.friction), w(p.stiffness), w(p.restitution);
    w(static_cast<std::int64_t>(p.shares.size()));
    w(p.shares);
  }
}

/// Contact of a scene, with the values that a snapshot has of it.
ContactDescription read_contact(Reader& r, ContactDescription contact) {
  for (double* x : {&contact.friction, &contact.slip_tolerance, &contact.restitution, &contact.stiffness}) r(*x);
  r(contact.obstacle_restitution);
  r(contact.obstacle_friction);
  std::int64_t count = 0;
  r(count);
  require(count == 0 || count == contact.obstacle_friction.rows(), "snapshot is damaged: impossible friction");
  contact.obstacle_rolling.resize(count);
  r(contact.obstacle_rolling);
  r(count);
  require(count >= 0 && count < 1 << 20, "snapshot is damaged: impossible number of pairs");
  contact.pairs.assign(static_cast<std::size_t>(count), {});
  for (ContactPairDescription& p : contact.pairs) {
    r(p.first), r(p.second), r(p.ignored);
    r(p.friction), r(p.stiffness), r(p.restitution);
    r(count);
    require(count >= 0 && count < 1 << 28, "snapshot is damaged: impossible friction");
    p.shares.resize(count);
    r(p.shares);
  }
  return contact;
}

bool same_contact(const ContactDescription& a, const ContactDescription& b) {
  Writer of_a, of_b;
  write_contact(of_a, a);
  write_contact(of_b, b);
  return of_a.bytes == of_b.bytes;
}

bool same_loads(const std::vector<LoadDescription>& added, const SceneDescription& scene) {
  const std::size_t drawn = drawn_loads(scene);
  return std::equal(added.begin(), added.end(), scene.loads.begin() + static_cast<std::ptrdiff_t>(drawn),
                    scene.loads.end(), [](const LoadDescription& a, const LoadDescription& b) {
                      return a.kind == b.kind && a.pass.rod == b.pass.rod && a.pass.node == b.pass.node &&
                             a.follower == b.follower && a.values.rows() == b.values.rows();
                    });
}

/// Hash of the drawn scene: what must be equal for a snapshot to fit.
std::uint64_t fingerprint(const SceneDescription& scene) {
  Writer w;
  w(scene.positions);
  w(static_cast<int>(scene.bending));
  for (const RodDescription& rod : scene.rods) {
    w(static_cast<std::int64_t>(rod.nodes.size()));
    for (int node : rod.nodes) w(node);
    w(rod.rest_lengths);
    w(rod.arc_lengths);
    w(rod.directors);
    w(rod.contact_radius);
    w(rod.fluid_radius);
    if (rod.is_surface()) w(rod.body);
    for (const FaceDescription& face : rod.faces) w(face.outline);
  }
  for (const BodyDescription& body : scene.bodies) {
    w(body.node);
    for (int node : body.carried) w(node);
    w(body.inertia);
  }
  w(static_cast<std::int64_t>(scene.joints.size()));
  for (const JointDescription& joint : scene.joints) w(static_cast<std::int64_t>(joint.links.size()));
  for (const LoopDescription& loop : scene.loops) w(loop.copy_node), w(loop.body_node);
  w(static_cast<std::int64_t>(drawn_loads(scene)));
  w(static_cast<std::int64_t>(scene.springs.size()));
  for (const SpringDescription& spring : scene.springs)
    for (int node : spring.nodes) w(node);
  if (!scene.tendons.empty()) w(static_cast<std::int64_t>(scene.tendons.size()));
  for (const TendonDescription& tendon : scene.tendons) {
    for (const auto& [rod, edge, place] : tendon.guides) w(rod), w(edge), w(static_cast<int>(place));
    w(tendon.offsets);
  }
  for (const TorsionDescription& torsion : scene.torsions) {
    for (std::size_t k = 0; k < 2; ++k) w(torsion.rods[k]), w(torsion.edges[k]);
    w(torsion.axis), w(torsion.reference);
  }
  w(static_cast<int>(scene.fluid.model));
  w(scene.fluid.regularization);
  w(scene.fluid.wavelength);
  return hash_of(w.bytes);
}

/// Refuses what another scene, or none, would have left.
void check_lagged(const Lagged& lagged, const Model& model) {
  const int obstacles = static_cast<int>(model.description.contact.obstacles.size());
  const auto is_edge = [&](int edge) { return edge >= 0 && edge < model.edge_count; };
  for (const auto& memory : lagged.systems) {
    if (!memory) continue;
    for (const std::vector<ContactKey>* keys : {&memory->ordered, &memory->coupled})
      for (const auto& [a, b, end] : *keys)
        require(is_edge(a) && (b < 0 ? b >= -obstacles : is_edge(b)), "snapshot is damaged: impossible contact");
    for (const std::vector<int>& group : memory->groups)
      for (int unknown : group)
        require(unknown >= 0 && unknown < model.dof_count, "snapshot is damaged: impossible group");
    const Eigen::Map<const VectorX> matrix(memory->matrix.data(), static_cast<Eigen::Index>(memory->matrix.size()));
    require(matrix.allFinite(), "snapshot is damaged: not finite");
  }
}

/// Ramps have no size until they are used, nor has the shape before one was set.
void give_sizes(World::Implementation& self) {
  for (std::size_t r = 0; r < self.ramps.natural.size(); ++r) {
    NaturalRamp& ramp = self.ramps.natural[r];
    const auto& rod = self.description.rods[r];
    for (MatrixX2* m : {&ramp.curvature.from, &ramp.curvature.to})
      if (m->rows() != rod.natural_curvature.rows()) *m = rod.natural_curvature;
    for (VectorX* v : {&ramp.twist.from, &ramp.twist.to})
      if (v->size() != rod.natural_twist.size()) *v = rod.natural_twist;
    for (VectorX* v : {&ramp.stretch.from, &ramp.stretch.to})
      if (v->size() != rod.rest_lengths.size()) v->setOnes(rod.rest_lengths.size());
  }
  if (self.actuation_before.curvature.empty()) self.actuation_before = actuation_of(self.parameters);
  self.predictor.resize(self.model.dof_count);
  for (VectorX* v : {&self.reaction_residual, &self.reaction_place})
    if (v->size() != self.model.dof_count) v->setZero(self.model.dof_count);
  if (!self.impulses.empty()) self.impulses.resize(self.model.supports.size());
}

struct StoredSupports {
  std::vector<SupportDescription> descriptions;
  std::vector<bool> active;
};

void write_supports(Writer& w, const World::Implementation& self) {
  w(static_cast<std::int64_t>(self.description.supports.size()));
  for (std::size_t s = 0; s < self.description.supports.size(); ++s) {
    const SupportDescription& d = self.description.supports[s];
    w(self.model.supports[s].active);
    w(static_cast<int>(d.kind));
    w(d.pass.rod);
    w(d.pass.node);
    w(d.free);
    w(d.gripped);
    w(d.axis);
    write_hand(w, d.hand);
  }
}

StoredSupports read_supports(Reader& r, const SceneDescription& scene) {
  std::int64_t count = 0;
  r(count);
  require(count >= 0 && count < 1 << 20, "snapshot is damaged: impossible number of supports");
  StoredSupports out;
  for (std::int64_t s = 0; s < count; ++s) {
    SupportDescription d;
    bool on = false;
    int kind = 0;
    r(on);
    r(kind);
    require(kind >= 0 && kind <= static_cast<int>(SupportKind::hand), "snapshot is damaged: unknown support");
    d.kind = static_cast<SupportKind>(kind);
    r(d.pass.rod);
    r(d.pass.node);
    require(is_there(scene, d.pass), "snapshot is damaged: support of a node that is not there");
    r(d.free);
    r(d.gripped);
    r(d.axis);
    read_hand(r, d.hand);
    out.descriptions.push_back(d);
    out.active.push_back(on);
  }
  return out;
}

void write_uncorrected_ends(Writer& w, const std::vector<UncorrectedEnd>& ends) {
  w(static_cast<std::int64_t>(ends.size()));
  for (const UncorrectedEnd& end : ends) w(end.edge), w(end.frame_first), w(end.at_frame), w(end.at_next);
}

std::vector<UncorrectedEnd> read_uncorrected_ends(Reader& r, const Model& model) {
  std::int64_t count = 0;
  r(count);
  require(count >= 0 && count <= 2 * model.edge_count, "snapshot is damaged: impossible number of ends");
  std::vector<UncorrectedEnd> ends(static_cast<std::size_t>(count));
  for (UncorrectedEnd& end : ends) {
    r(end.edge), r(end.frame_first), r(end.at_frame), r(end.at_next);
    require(end.edge >= 0 && end.edge < model.edge_count, "snapshot is damaged: end of an edge that is not there");
    require(end.at_frame.allFinite() && end.at_next.allFinite(), "snapshot is damaged: not finite");
  }
  return ends;
}

bool same_ends(const std::vector<UncorrectedEnd>& a, const std::vector<UncorrectedEnd>& b) {
  Writer of_a, of_b;
  write_uncorrected_ends(of_a, a);
  write_uncorrected_ends(of_b, b);
  return of_a.bytes == of_b.bytes;
}

bool same_supports(const StoredSupports& stored, const World::Implementation& self) {
  if (stored.active.size() != self.description.supports.size()) return false;
  for (std::size_t s = 0; s < stored.active.size(); ++s) {
    const SupportDescription &a = stored.descriptions[s], &b = self.description.supports[s];
    if (stored.active[s] != self.model.supports[s].active || a.kind != b.kind || a.pass.rod != b.pass.rod ||
        a.pass.node != b.pass.node || a.free != b.free || a.gripped != b.gripped || a.axis != b.axis ||
        !same_hand(a.hand, b.hand))
      return false;
  }
  return true;
}

void restore_supports(const StoredSupports& stored, World::Implementation& self) {
  const std::size_t count = stored.active.size();
  self.description.supports = stored.descriptions;
  self.motions.assign(count, SupportMotion{});
  self.model.supports.assign(count, Support{});
  for (std::size_t s = 0; s < count; ++s) self.model.supports[s].active = stored.active[s];
  self.rebuild(Rebuild::restored);
}

void restore_loads(const std::vector<LoadDescription>& added, World::Implementation& self) {
  if (same_loads(added, self.description)) return;
  auto& loads = self.description.loads;
  loads.resize(drawn_loads(self.description));
  loads.insert(loads.end(), added.begin(), added.end());
  self.parameters.loads.setZero(first_load_row(self.description, loads.size()), 3);
  self.remake_equations();
}

void check_parts(const Parameters& p) {
  for (const ParameterInfo& info : parameter_index())
    require(!info.number || in_range(p.*info.number, info.range), "snapshot is damaged: impossible ", info.name);
}

/// Refuses values that no simulation would have left.
void check_running(const World::Implementation& self) {
  const StepLengths& lengths = self.lengths;
  require(lengths.level >= 0 && lengths.level <= StepControl(self.options).deepest_level() && lengths.easy_steps >= 0 &&
              lengths.patience >= 1 && lengths.easy_steps <= lengths.patience,
          "snapshot is damaged: impossible step size");
  require(self.state.q.allFinite() && self.state.v.allFinite(), "snapshot is damaged: not finite");
  require(std::isfinite(self.parameters.fluid_viscosity) && self.parameters.fluid_viscosity >= 0.0,
          "snapshot is damaged: impossible viscosity");
  if (self.description.fluid.model == FluidModel::stokeslets)
    check_regularization(self.model, self.parameters.fluid_regularization);
  check_parts(self.parameters);
  for (std::size_t s = 0; s < self.model.supports.size(); ++s) {
    const Support& support = self.model.supports[s];
    if (!support.active || !support.slides()) continue;
    const HandState& hand = self.state.hands[s];
    const SplinePlace& place = hand.ring.place;
    require(hand.points.size() == 1 && place.along >= 0.0 && place.along <= 1.0 &&
                (support.curve.closed || (place.piece >= 0 && place.piece < support.curve.pieces())),
            "snapshot is damaged: impossible ring");
  }
  require(self.state.motion.known >= 0 && self.state.motion.known <= 2, "snapshot is damaged: impossible history");
  require(self.predictor.plausible(), "snapshot is damaged: impossible history");
}

}  // namespace

std::string World::snapshot() const {
  Implementation& self = accounted();
  give_sizes(self);
  Writer w;
  w(kMagic);
  w(fingerprint(self.description));
  w(self.spatial);
  w(!self.obstacle_motions.empty());
  write_supports(w, self);
  write_uncorrected_ends(w, self.description.uncorrected_ends);
  write_added_loads(w, self.description);
  const bool set = !same_contact(self.description.contact, self.drawn_contact);
  w(set);
  if (set) write_contact(w, self.description.contact);
  exchange(w, self.model, static_cast<Running&>(self));
  Lagged lagged = self.systems.lagged();
  exchange(w, lagged);
  w(hash_of(w.bytes));
  return w.bytes;
}

void World::restore(const std::string& bytes) {
  std::uint64_t magic = 0, print = 0, check = 0;
  require(bytes.size() > sizeof magic + sizeof check, "snapshot is damaged: it ends too early");
  const std::string body = bytes.substr(0, bytes.size() - sizeof check);
  Reader(bytes.substr(body.size()))(check);
  Reader r(body);
  r(magic);
  require(magic == kMagic, "snapshot is damaged, or not one of ours");
  require(check == hash_of(body), "snapshot is damaged: its bytes have changed");
  r(print);
  require(print == fingerprint(implementation_->description), "snapshot belongs to another scene");
  // Everything is read into a copy, so that a damaged file changes nothing.
  auto fresh = std::make_unique<Implementation>(accounted());
  fresh->callbacks = implementation_->callbacks;
  bool spatial = false, obstacles_move = false;
  r(spatial);
  r(obstacles_move);
  const StoredSupports supports = read_supports(r, fresh->description);
  const std::vector<UncorrectedEnd> ends = read_uncorrected_ends(r, fresh->model);
  const bool same = spatial == fresh->spatial && same_supports(supports, *fresh) &&
                    same_ends(ends, fresh->description.uncorrected_ends);
  restore_loads(read_added_loads(r, fresh->description), *fresh);
  bool contact_set = false;
  r(contact_set);
  const ContactDescription contact = contact_set ? read_contact(r, fresh->description.contact) : fresh->drawn_contact;
  if (!same_contact(contact, fresh->description.contact)) {
    fresh->description.contact = contact;
    fresh->take_contact();
  }
  if (!same) {
    fresh->spatial = spatial;
    if (!spatial) fresh->plane_left_by.clear();
    fresh->description.uncorrected_ends = ends;
    restore_supports(supports, *fresh);
  }
  fresh->obstacle_motions.assign(obstacles_move ? fresh->state.obstacles.size() : 0, ObstacleMotion{});
  give_sizes(*fresh);
  exchange(r, fresh->model, static_cast<Running&>(*fresh));
  Lagged lagged;
  exchange(r, lagged);
  r.expect_end();
  check_running(*fresh);
  update_derived(fresh->model, fresh->parameters);
  check_reversible(fresh->model, fresh->options, fresh->parameters);
  check_lagged(lagged, fresh->model);
  fresh->systems.recall(lagged);
  implementation_ = std::move(fresh);
}

}  // namespace withe
