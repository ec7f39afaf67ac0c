#include <algorithm>
#include <string_view>

#include "world/archive.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

constexpr std::uint64_t kMagic = 0x3953454854495755ull;

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
    require(load.pass.rod >= 0 && load.pass.rod < static_cast<int>(scene.rods.size()) && load.pass.node >= 0 &&
                load.pass.node < static_cast<int>(scene.rods[static_cast<std::size_t>(load.pass.rod)].nodes.size()),
            "snapshot is damaged: load at a node that is not there");
    r(load.follower);
    load.added = true;
  }
  return loads;
}

void write_friction(Writer& w, const ContactDescription& contact) {
  w(contact.friction);
  w(contact.obstacle_friction);
  w(static_cast<std::int64_t>(contact.obstacle_across.size()));
  w(contact.obstacle_across);
  w(static_cast<std::int64_t>(contact.pairs.size()));
  for (const ContactPairDescription& p : contact.pairs) {
    w(p.first), w(p.second), w(p.ignored);
    for (double x : {p.friction, p.across, p.stiffness, p.restitution}) w(x);
  }
}

/// What a snapshot knows of friction, for the contact of a scene.
ContactDescription read_friction(Reader& r, ContactDescription contact) {
  r(contact.friction);
  r(contact.obstacle_friction);
  std::int64_t count = 0;
  r(count);
  require(count == 0 || count == contact.obstacle_friction.size(), "snapshot is damaged: impossible friction");
  contact.obstacle_across.resize(count);
  r(contact.obstacle_across);
  r(count);
  require(count >= 0 && count < 1 << 20, "snapshot is damaged: impossible number of pairs");
  contact.pairs.assign(static_cast<std::size_t>(count), {});
  for (ContactPairDescription& p : contact.pairs) {
    r(p.first), r(p.second), r(p.ignored);
    for (double* x : {&p.friction, &p.across, &p.stiffness, &p.restitution}) r(*x);
  }
  return contact;
}

bool same_friction(const ContactDescription& a, const ContactDescription& b) {
  Writer of_a, of_b;
  write_friction(of_a, a);
  write_friction(of_b, b);
  return of_a.bytes == of_b.bytes;
}

bool same_loads(const std::vector<LoadDescription>& added, const SceneDescription& scene) {
  const std::size_t drawn = drawn_loads(scene);
  return std::equal(added.begin(), added.end(), scene.loads.begin() + static_cast<std::ptrdiff_t>(drawn),
                    scene.loads.end(), [](const LoadDescription& a, const LoadDescription& b) {
                      return a.kind == b.kind && a.pass.rod == b.pass.rod && a.pass.node == b.pass.node &&
                             a.follower == b.follower;
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
  }
  w(static_cast<std::int64_t>(scene.joints.size()));
  w(static_cast<std::int64_t>(drawn_loads(scene)));
  w(static_cast<int>(scene.fluid.model));
  w(scene.fluid.regularization);
  w(scene.fluid.wavelength);
  return hash_of(w.bytes);
}

template <class Archive>
void exchange_contacts(Archive& io, std::vector<ContactRecord>& contacts) {
  auto count = static_cast<std::int64_t>(contacts.size());
  io(count);
  require(count >= 0 && count < 1 << 28, "snapshot is damaged: impossible number of contacts");
  contacts.resize(static_cast<std::size_t>(count));
  for (ContactRecord& c : contacts) {
    io(c.key.a);
    io(c.key.b);
    io(c.key.end);
    io(c.force);
    io(c.stiffness);
    io(c.yielded);
    io(c.approach);
    io(c.age);
    for (Vec3d* v : {&c.stick, &c.friction}) io(v->x), io(v->y), io(v->z);
    io(c.sticking);
  }
}

/// The numbers of a state that any world of the scene has, in a fixed order.
template <class Archive, class Self>
void exchange(Archive& io, Self& self) {
  auto& p = self.parameters;
  for (auto* v : {&p.edge_stretch, &p.edge_twist, &p.edge_density, &p.edge_rotary, &p.edge_viscous_time, &p.edge_drag,
                  &p.added_mass})
    io(*v);
  io(p.edge_bend);
  io(p.gravity);
  io(p.fluid_viscosity);
  io(p.held_lumped);
  for (auto& m : p.natural_curvature) io(m);
  for (auto& v : p.natural_twist) io(v);
  for (auto& r : self.ramps) {
    io(r.curvature.from);
    io(r.curvature.to);
    io(r.twist.from);
    io(r.twist.to);
    io(r.curvature.start);
    io(r.curvature.end);
    io(r.twist.start);
    io(r.twist.end);
    io(r.curvature.active);
    io(r.twist.active);
  }
  for (auto& v : self.load_values) io(v);
  io(self.custom_force);
  if (self.description.custom_moments) io(self.custom_moments);
  for (auto* x : {&self.support_work, &self.actuation_work, &self.dissipated, &self.load_work}) io(*x);
  io(self.level);
  io(self.easy_steps);
  io(self.patience);
  io(self.grown);
  io(self.guard.rescue);
  io(self.error_rate);
  io(self.grid_origin);
  io(self.grid_steps);
  for (auto* x : {&self.guard.turn, &self.guard.scale, &self.guard.excess}) io(*x);
  for (auto* x : {&self.contact_guard.scale, &self.contact_guard.excess}) io(*x);
  for (auto& m : self.motions) {
    io(m.position);
    io(m.stretch);
    io(m.rotation);
    io(m.from_position);
    io(m.to_position);
    io(m.from_rotation);
    io(m.to_rotation);
    io(m.start);
    io(m.end);
  }
  auto& s = self.state;
  io(s.time);
  io(s.q);
  io(s.v);
  io(s.acceleration);
  io(s.acceleration_current);
  for (auto& t : s.tangent) io(t.x), io(t.y), io(t.z);
  for (auto& d : s.director) io(d.x), io(d.y), io(d.z);
  for (auto& f : s.frame) io(f);
  io(s.bend_tau);
  io(s.half_tau);
  for (auto& o : s.obstacles)
    for (Vec3d* x : {&o.point, &o.other, &o.turn}) io(x->x), io(x->y), io(x->z);
  for (auto& m : self.obstacle_motions) {
    for (ObstacleWay* way : {&m.from, &m.to}) io(way->shift), io(way->turn);
    io(m.start), io(m.end);
  }
  io(s.contact_stiffness);
  exchange_contacts(io, s.contacts);
  io(s.motion.known);
  for (int i : {0, 1}) io(s.motion.velocity[i]), io(s.motion.time[i]);
  self.predictor.exchange(io);
  io(self.reaction_current);
  io(self.reaction_residual);
}

/// Ramps have no size until they are used.
void give_sizes(World::Implementation& self) {
  for (std::size_t r = 0; r < self.ramps.size(); ++r) {
    NaturalRamp& ramp = self.ramps[r];
    const auto& rod = self.description.rods[r];
    for (MatrixX2* m : {&ramp.curvature.from, &ramp.curvature.to})
      if (m->rows() != rod.natural_curvature.rows()) *m = rod.natural_curvature;
    for (VectorX* v : {&ramp.twist.from, &ramp.twist.to})
      if (v->size() != rod.natural_twist.size()) *v = rod.natural_twist;
  }
  self.predictor.resize(self.model.dof_count);
  if (self.reaction_residual.size() != self.model.dof_count) self.reaction_residual.setZero(self.model.dof_count);
}

}  // namespace

std::string World::snapshot() const {
  Implementation& self = *implementation_;
  give_sizes(self);
  self.forget_contacts();
  self.forget_matrix();  // who restores has none, and goes on with the same bits
  Writer w;
  w(kMagic);
  w(fingerprint(self.description));
  w(self.spatial);
  w(!self.obstacle_motions.empty());
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
  }
  write_added_loads(w, self.description);
  if (self.description.contact.any()) write_friction(w, self.description.contact);
  exchange(w, self);
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
  auto fresh = std::make_unique<Implementation>(*implementation_);
  fresh->callback = implementation_->callback;
  fresh->force_function = implementation_->force_function;
  bool spatial = false, obstacles_move = false;
  std::int64_t count = 0;
  r(spatial);
  r(obstacles_move);
  r(count);
  require(count >= 0 && count < 1 << 20, "snapshot is damaged: impossible number of supports");
  std::vector<SupportDescription> supports;
  std::vector<bool> active;
  for (std::int64_t s = 0; s < count; ++s) {
    SupportDescription d;
    bool on = false;
    int kind = 0;
    r(on);
    r(kind);
    require(kind >= 0 && kind <= 4, "snapshot is damaged: unknown support");
    d.kind = static_cast<SupportKind>(kind);
    r(d.pass.rod);
    r(d.pass.node);
    const auto& rods = fresh->description.rods;
    require(d.pass.rod >= 0 && d.pass.rod < static_cast<int>(rods.size()) && d.pass.node >= 0 &&
                d.pass.node < static_cast<int>(rods[static_cast<std::size_t>(d.pass.rod)].nodes.size()),
            "snapshot is damaged: support of a node that is not there");
    r(d.free);
    r(d.gripped);
    r(d.axis);
    supports.push_back(d);
    active.push_back(on);
  }
  const bool same = spatial == fresh->spatial && supports.size() == fresh->description.supports.size() && [&] {
    for (std::size_t s = 0; s < supports.size(); ++s) {
      const SupportDescription &a = supports[s], &b = fresh->description.supports[s];
      if (active[s] != fresh->model.supports[s].active || a.kind != b.kind || a.pass.rod != b.pass.rod ||
          a.pass.node != b.pass.node || a.free != b.free || a.gripped != b.gripped || a.axis != b.axis)
        return false;
    }
    return true;
  }();
  const std::vector<LoadDescription> added = read_added_loads(r, fresh->description);
  if (!same_loads(added, fresh->description)) {
    auto& loads = fresh->description.loads;
    loads.resize(drawn_loads(fresh->description));
    loads.insert(loads.end(), added.begin(), added.end());
    fresh->load_values.resize(loads.size(), Vector3::Zero());
    fresh->remake_equations();
  }
  if (fresh->description.contact.any()) {
    const ContactDescription contact = read_friction(r, fresh->description.contact);
    if (!same_friction(contact, fresh->description.contact)) {
      fresh->description.contact = fresh->model.description.contact = contact;
      fresh->remake_equations();
    }
  }
  if (!same) {
    fresh->spatial = spatial;
    fresh->description.supports = supports;
    fresh->motions.assign(supports.size(), SupportMotion{});
    fresh->model.supports.assign(supports.size(), Support{});
    for (std::size_t s = 0; s < supports.size(); ++s) fresh->model.supports[s].active = active[s];
    fresh->rebuild(Rebuild::restored);
  }
  fresh->obstacle_motions.assign(obstacles_move ? fresh->state.obstacles.size() : 0, ObstacleMotion{});
  give_sizes(*fresh);
  exchange(r, *fresh);
  r.expect_end();
  require(fresh->level >= 0 && fresh->level <= fresh->notches() * fresh->options.max_halvings &&
              fresh->easy_steps >= 0 && fresh->patience >= 1 && fresh->easy_steps <= fresh->patience &&
              fresh->guard.rescue >= 0 && fresh->guard.rescue <= 256,
          "snapshot is damaged: impossible step size");
  require(fresh->state.q.allFinite() && fresh->state.v.allFinite(), "snapshot is damaged: not finite");
  require(std::isfinite(fresh->parameters.fluid_viscosity) && fresh->parameters.fluid_viscosity >= 0.0,
          "snapshot is damaged: impossible viscosity");
  require(fresh->state.motion.known >= 0 && fresh->state.motion.known <= 2, "snapshot is damaged: impossible history");
  require(fresh->predictor.plausible(), "snapshot is damaged: impossible history");
  update_derived(fresh->model, fresh->parameters);
  fresh->check_reversible(fresh->parameters);
  fresh->forget_matrix();
  fresh->equations->loads().values = fresh->load_values;
  fresh->alarm.reset();
  implementation_ = std::move(fresh);
}

}  // namespace withe
