#include <algorithm>
#include <string_view>

#include "world/archive.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

constexpr std::uint64_t kMagic = 0x4153454854495756ull;

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

/// As it was set while running; where it was not, that of the drawing holds.
void write_friction(Writer& w, const ContactDescription& contact) {
  w(contact.friction);
  w(contact.slip_tolerance);
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
  r(contact.slip_tolerance);
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
  }
  w(static_cast<std::int64_t>(scene.joints.size()));
  w(static_cast<std::int64_t>(drawn_loads(scene)));
  w(static_cast<std::int64_t>(scene.springs.size()));
  for (const SpringDescription& spring : scene.springs)
    for (int node : spring.nodes) w(node);
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
  for (auto& [key, force, stiffness, yielded, approach, age, stick, friction, sticking] : contacts) {
    io(key.a), io(key.b), io(key.end), io(force), io(stiffness), io(yielded), io(approach), io(age);
    for (Vec3d* v : {&stick, &friction}) io(v->x), io(v->y), io(v->z);
    io(sticking);
  }
}

// Members are named one by one, by structured bindings: one that is added and not named here does not compile.

template <class Archive>
void exchange(Archive& io, Vec3d& v) {
  io(v.x), io(v.y), io(v.z);
}

/// Of any size, in an archive that ends soon enough to be read.
template <class Archive>
void exchange(Archive& io, VectorX& v) {
  auto size = static_cast<std::int64_t>(v.size());
  io(size);
  require(size >= 0 && size < 1 << 28, "snapshot is damaged: impossible size");
  v.resize(size);
  io(v);
}

template <class Archive>
void exchange(Archive& io, std::optional<Energy>& energy) {
  bool known = energy.has_value();
  io(known);
  if (!known) {
    energy.reset();
    return;
  }
  if (!energy) energy.emplace();
  auto& [kinetic, stretch, bend, twist, gravity, loads, contact, spring, total, work, dissipated] = *energy;
  for (double* x : {&kinetic, &stretch, &bend, &twist, &gravity, &loads, &contact, &spring, &total, &work, &dissipated})
    io(*x);
}

/// What users may set; the rest follows from it. Friction is that of the drawing where it was not set: see
/// `write_friction`.
template <class Archive>
void exchange(Archive& io, const Model& model, Parameters& p) {
  for (const ParameterInfo& info : parameter_index()) {
    if (info.of_contact()) continue;
    for (int rod = 0; rod < (info.of_rod() ? static_cast<int>(model.place.size()) : 1); ++rod) {
      ParameterView values = parameter_view(model, p, info.kind, rod);
      io(values);
    }
  }
  io(p.held_lumped);
}

template <class Archive>
void exchange(Archive& io, const Model& model, Settings& settings) {
  auto& [parameters, ramps, obstacle_motions] = settings;
  exchange(io, model, parameters);
  const auto exchange_ramp = [&](auto& ramp) {
    auto& [from, to, start, end, active] = ramp;
    io(from), io(to), io(start), io(end), io(active);
  };
  for (auto& [curvature, twist] : ramps) exchange_ramp(curvature), exchange_ramp(twist);
  for (auto& [from, to, start, end] : obstacle_motions) {
    for (ObstacleWay* way : {&from, &to}) io(way->shift), io(way->turn);
    io(start), io(end);
  }
}

template <class Archive>
void exchange(Archive& io, State& state) {
  auto& [time, q, v, acceleration, acceleration_current, load_force, friction_force, tangent, director, frame, bend_tau,
         half_tau, contacts, obstacles, contact_stiffness, motion] = state;
  io(time), io(q), io(v), io(acceleration), io(acceleration_current);
  exchange(io, load_force);
  exchange(io, friction_force);
  for (auto& t : tangent) exchange(io, t);
  for (auto& d : director) exchange(io, d);
  for (auto& f : frame) io(f);
  io(bend_tau), io(half_tau);
  exchange_contacts(io, contacts);
  for (auto& [point, other, turn] : obstacles) exchange(io, point), exchange(io, other), exchange(io, turn);
  io(contact_stiffness);
  auto& [known, velocity, times] = motion;
  io(known);
  for (int i : {0, 1}) io(velocity[i]), io(times[i]);
}

template <class Archive>
void exchange(Archive& io, Moving& moving) {
  auto& [state, predictor, motions, support_work, actuation_work, dissipated, load_work] = moving;
  exchange(io, state);
  predictor.exchange(io);
  for (auto& motion : motions) {
    auto& [position, rotation, from_position, to_position, from_rotation, to_rotation, start, end, stretch] = motion;
    io(position), io(rotation), io(from_position), io(to_position), io(from_rotation), io(to_rotation);
    io(start), io(end), io(stretch);
  }
  for (double* x : {&support_work, &actuation_work, &dissipated, &load_work}) io(*x);
}

template <class Archive>
void exchange(Archive& io, StepControl& control) {
  auto& [level, easy_steps, patience, grown, error_rate, grid_origin, grid_steps, steps_taken, guard, contact_guard,
         step_watch, alarm] = control;
  io(level), io(easy_steps), io(patience), io(grown), io(error_rate), io(grid_origin), io(grid_steps), io(steps_taken);
  auto& [turn, scale, excess, stretch_gain, rescue, energy] = guard;
  io(turn), io(scale), io(excess), io(stretch_gain), io(rescue);
  exchange(io, energy);
  auto& [greatest, gained, put_in] = contact_guard;
  io(greatest), io(gained), io(put_in);
  auto& [change, motion, most, pull, moved, acceleration] = step_watch;
  io(change), io(motion), io(most), io(pull), io(moved);
  exchange(io, acceleration);
  exchange(io, alarm);
}

template <class Archive>
void exchange(Archive& io, Found& found) {
  auto& [custom_force, custom_moments, reaction_residual, reaction_place, reaction_current] = found;
  io(custom_force), io(custom_moments), io(reaction_residual), io(reaction_place), io(reaction_current);
}

template <class Archive>
void exchange(Archive& io, const Model& model, Running& running) {
  exchange(io, model, static_cast<Settings&>(running));
  exchange(io, static_cast<Moving&>(running));
  exchange(io, static_cast<StepControl&>(running));
  exchange(io, static_cast<Found&>(running));
}

template <class Archive>
void exchange(Archive& io, std::vector<ContactKey>& keys) {
  auto count = static_cast<std::int64_t>(keys.size());
  io(count);
  require(count >= 0 && count < 1 << 28, "snapshot is damaged: impossible number of contacts");
  keys.resize(static_cast<std::size_t>(count));
  for (auto& [a, b, end] : keys) io(a), io(b), io(end);
}

template <class Archive>
void exchange(Archive& io, StokesletFluid::Memory& memory) {
  auto& [solution, past, known, factorized_at, iterations, fresh_iterations, wave, excess, waited] = memory;
  for (VectorX* v : {&solution, &past[0], &past[1], &factorized_at, &wave}) exchange(io, *v);
  io(known), io(iterations), io(fresh_iterations), io(excess), io(waited);
}

template <class Archive>
void exchange(Archive& io, EquationsMemory& memory) {
  auto& [ordered, coupled, groups, matrix, flow_excess, fluid] = memory;
  exchange(io, ordered);
  exchange(io, coupled);
  auto count = static_cast<std::int64_t>(groups.size());
  io(count);
  require(count >= 0 && count < 1 << 28, "snapshot is damaged: impossible number of groups");
  groups.resize(static_cast<std::size_t>(count));
  for (std::vector<int>& group : groups) {
    auto size = static_cast<std::int64_t>(group.size());
    io(size);
    require(size >= 0 && size < 1 << 10, "snapshot is damaged: impossible group");
    group.resize(static_cast<std::size_t>(size));
    for (int& unknown : group) io(unknown);
  }
  io(matrix);
  io(flow_excess);
  exchange(io, fluid);
}

template <class Archive>
void exchange(Archive& io, MatrixHistory& history) {
  auto& [interval, contraction, waited, slow] = history;
  io(interval);
  for (double& rate : contraction) io(rate);
  io(waited), io(slow);
}

template <class Archive>
void exchange(Archive& io, GuessHistory& history) {
  auto& [records, cut, plain_solves] = history;
  for (auto& [misses, waits] : records) io(misses), io(waits);
  io(cut.misses), io(cut.waits), io(plain_solves);
}

template <class Archive>
void exchange(Archive& io, Lagged& lagged) {
  auto& [matrix, guesses, owner, systems] = lagged;
  exchange(io, matrix);
  exchange(io, guesses);
  int number = owner ? static_cast<int>(*owner) : -1;
  io(number);
  require(number >= -1 && number < static_cast<int>(kSystems.size()), "snapshot is damaged: unknown equations");
  if (number >= 0) owner = static_cast<System>(number);
  for (auto& memory : systems) {
    bool known = memory.has_value();
    io(known);
    if (known && !memory) memory.emplace();
    if (known) exchange(io, *memory);
  }
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
  for (VectorX* v : {&self.reaction_residual, &self.reaction_place})
    if (v->size() != self.model.dof_count) v->setZero(self.model.dof_count);
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
  const bool set = !same_friction(self.description.contact, self.drawn_contact);
  w(set);
  if (set) write_friction(w, self.description.contact);
  exchange(w, self.model, static_cast<Running&>(self));
  Lagged lagged = self.lagged();
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
  fresh->take_callbacks(*implementation_);
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
    fresh->parameters.loads.setZero(first_load_row(fresh->description, loads.size()), 3);
    fresh->remake_equations();
  }
  bool friction_set = false;
  r(friction_set);
  const ContactDescription contact = friction_set ? read_friction(r, fresh->description.contact) : fresh->drawn_contact;
  if (!same_friction(contact, fresh->description.contact)) {
    fresh->description.contact = contact;
    fresh->take_friction();
  }
  if (!same) {
    fresh->spatial = spatial;
    if (!spatial) fresh->plane_left_by.clear();
    fresh->description.supports = supports;
    fresh->motions.assign(supports.size(), SupportMotion{});
    fresh->model.supports.assign(supports.size(), Support{});
    for (std::size_t s = 0; s < supports.size(); ++s) fresh->model.supports[s].active = active[s];
    fresh->rebuild(Rebuild::restored);
  }
  fresh->obstacle_motions.assign(obstacles_move ? fresh->state.obstacles.size() : 0, ObstacleMotion{});
  give_sizes(*fresh);
  exchange(r, fresh->model, static_cast<Running&>(*fresh));
  Lagged lagged;
  exchange(r, lagged);
  r.expect_end();
  require(fresh->level >= 0 && fresh->level <= fresh->levels_per_halving() * fresh->options.max_halvings &&
              fresh->easy_steps >= 0 && fresh->patience >= 1 && fresh->easy_steps <= fresh->patience &&
              fresh->guard.rescue >= 0 && fresh->guard.rescue <= 256,
          "snapshot is damaged: impossible step size");
  require(fresh->state.q.allFinite() && fresh->state.v.allFinite(), "snapshot is damaged: not finite");
  require(std::isfinite(fresh->parameters.fluid_viscosity) && fresh->parameters.fluid_viscosity >= 0.0,
          "snapshot is damaged: impossible viscosity");
  for (const VectorX* v :
       {&fresh->parameters.spring_stiffness, &fresh->parameters.spring_rest_length, &fresh->parameters.spring_damping})
    require(v->allFinite() && (v->array() >= 0.0).all(), "snapshot is damaged: impossible spring");
  require(fresh->state.motion.known >= 0 && fresh->state.motion.known <= 2, "snapshot is damaged: impossible history");
  require(fresh->predictor.plausible(), "snapshot is damaged: impossible history");
  update_derived(fresh->model, fresh->parameters);
  fresh->check_reversible(fresh->parameters);
  check_lagged(lagged, fresh->model);
  fresh->recall(lagged);
  implementation_ = std::move(fresh);
}

}  // namespace withe
