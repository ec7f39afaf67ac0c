#include "world/world.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/check.hpp"
#include "common/timer.hpp"
#include "forces/stokeslets.hpp"
#include "model/edge_vectors.hpp"
#include "run/checks.hpp"
#include "run/drive.hpp"
#include "run/frames.hpp"
#include "world/implementation.hpp"

namespace withe {
World::World(SceneDescription description, Options options)
    : implementation_(std::make_unique<Implementation>(std::move(description), options)) {}
World::World(const World& other) : implementation_(std::make_unique<Implementation>(other.accounted())) {
  implementation_->systems.recall(other.implementation_->systems.lagged());
}
World::~World() = default;

World::Implementation& World::accounted() const {
  implementation_->account_for_settings();
  return *implementation_;
}

const SceneDescription& World::description() const { return implementation_->description; }
const Options& World::options() const { return implementation_->options; }
const Plan& World::plan() const {
  Implementation& self = *implementation_;
  if (!self.plan_current)
    self.plan = plan_of(self.model, self.options, self.parameters, self.systems.scheme(),
                        {self.spatial, self.plane_left_by, self.separated, self.stable_explicit_step});
  self.plan_current = true;
  return self.plan;
}
bool World::frames_as_drawn() const {
  constexpr double kNear = 1e-9;
  const Model& model = implementation_->model;
  const State& state = implementation_->state;
  for (int f = 0; f < model.frame_count; ++f)
    if (!frame_rotation(model, state, f).isIdentity(kNear)) return false;
  return std::all_of(model.hinges.begin(), model.hinges.end(),
                     [&](const Hinge& hinge) { return std::abs(state.q(hinge.dof)) < kNear; });
}

std::optional<Vector3> World::plane_normal() const {
  const Model& model = implementation_->model;
  if (!model.planar()) return std::nullopt;
  return model.plane->normal;
}
double World::time() const { return implementation_->state.time; }
void World::interrupt() { implementation_->interrupted = true; }

const Statistics& World::statistics() const {
  Statistics& s = implementation_->statistics;
  const Counters& c = implementation_->systems.work.newton.counters;
  s.iterations = c.iterations;
  s.evaluations = c.evaluations;
  s.factorizations = c.factorizations;
  s.assembly_time = c.assembly_time;
  s.solve_time = c.solve_time;
  s.fluid_time = c.fluid_time;
  return s;
}

void World::step(int count) {
  if (count < 0) throw std::invalid_argument("number of steps must not be negative, got " + std::to_string(count));
  Implementation& self = *implementation_;
  const Timer timer(self.statistics.total_time);
  const double dt = self.options.time_step;
  const auto on_grid = [&](std::int64_t steps) { return self.grid_origin + static_cast<double>(steps) * dt; };
  for (int i = 0; i < count; ++i) {
    if (self.state.time != on_grid(self.grid_steps)) {
      self.grid_origin = self.state.time;
      self.grid_steps = 0;
    }
    const double end = on_grid(self.grid_steps + 1);
    if (self.options.integrator == Integrator::statics) {
      self.static_step(end, dt);
    } else {
      self.advance(dt);
    }
    self.state.time = end;
    ++self.grid_steps;
    self.release_left_rings();
  }
  if (self.options.integrator == Integrator::verlet && count > 0) self.check_explicit();
}

void World::advance_to(double time) {
  Implementation& self = *implementation_;
  const double span = time - self.state.time;
  require(std::isfinite(time) && span >= 0.0, "time must not lie before the present, got ", time);
  if (span == 0.0) return;
  const Timer timer(self.statistics.total_time);
  const double steps = std::max(1.0, std::ceil(span / self.options.time_step - 1e-9));
  const double start = self.state.time;
  for (double i = 1.0; i <= steps; i += 1.0) {
    const double next = i == steps ? time : start + span * i / steps;
    if (self.options.integrator == Integrator::statics) {
      self.static_step(next, next - self.state.time);
    } else {
      self.advance(next - self.state.time);
    }
    self.state.time = next;
    self.release_left_rings();
  }
  if (self.options.integrator == Integrator::verlet) self.check_explicit();
}

EquilibriumResult World::equilibrium(Saddles saddles) {
  Implementation& self = *implementation_;
  const Timer timer(self.statistics.total_time);
  if (self.callbacks.before_step) self.callbacks.before_step(self.state.time, self.state.time);
  return self.equilibrium(0.0, saddles);
}

void World::set_step_callback(const StepCallback& callback, bool prescribes) {
  implementation_->callbacks.prescribes = callback && prescribes;
  if (!callback) {
    implementation_->callbacks.before_step = nullptr;
    return;
  }
  implementation_->callbacks.before_step = [this, callback](double force_time, double end_time) {
    callback(*this, force_time, end_time);
  };
}

void World::set_poll(const std::function<void()>& poll) { implementation_->callbacks.poll = poll; }

void World::set_force_function(const CustomFunction& force) { implementation_->callbacks.force = force; }

void World::set_load(int load, const Eigen::Ref<const MatrixX3>& values) {
  Implementation& self = *implementation_;
  const auto [first, rows] = self.load_rows(load);
  require(values.rows() == rows, "load must have ", rows, " rows");
  require(values.allFinite(), "load must be finite");
  if (leaves_plane(self.model, self.description.loads[at(load)].kind, values)) self.leave_plane("a load");
  self.parameters.loads.middleRows(first, rows) = values;
  self.reaction_current = false;
  self.state.acceleration_current = false;
}
int World::add_load(const LoadDescription& load) {
  Implementation& self = *implementation_;
  check_load(self.description, load);
  const Eigen::Index rows = load.values.rows(), before = self.parameters.loads.rows();
  if (leaves_plane(self.model, load.kind, load.values)) self.leave_plane("a load");
  self.description.loads.push_back(load);
  self.description.loads.back().added = true;
  self.parameters.loads.conservativeResize(before + rows, 3);
  self.parameters.loads.bottomRows(rows) = load.values;
  self.remake_equations();
  return static_cast<int>(self.description.loads.size()) - 1;
}
void World::remove_load(int load) {
  Implementation& self = *implementation_;
  const auto [first, rows] = self.load_rows(load);
  require(self.description.loads[at(load)].added, "a load of the scene cannot be removed: set the load to zero");
  MatrixX3& loads = self.parameters.loads;
  const MatrixX3 after = loads.bottomRows(loads.rows() - first - rows);
  loads.conservativeResize(loads.rows() - rows, 3);
  loads.bottomRows(after.rows()) = after;
  self.description.loads.erase(self.description.loads.begin() + load);
  self.remake_equations();
}
MatrixX3 World::load(int load) const {
  const auto [first, rows] = implementation_->load_rows(load);
  return implementation_->parameters.loads.middleRows(first, rows);
}
std::pair<Eigen::Index, Eigen::Index> World::Implementation::load_rows(int load) const {
  require(load >= 0 && load < static_cast<int>(description.loads.size()), "no such load: ", load);
  return {first_load_row(description, at(load)), description.loads[at(load)].values.rows()};
}

/// Takes over a description of the same bodies. The change of the energy at the present state is work of actuation.
void World::Implementation::set_contact(ContactDescription wanted) {
  check_impacts(options, wanted);
  const auto energy = [&] {
    const Contact* touching = systems.scheme().contact();
    return touching ? touching->energy_of(state, parameters, energy_scratch.contact) : 0.0;
  };
  const double before = energy();
  const double stiffness = parameters.surfaces.contact_stiffness;
  const VectorX of_pairs = parameters.surfaces.pair_contact_stiffness;
  description.contact = std::move(wanted);
  take_contact();
  const SurfaceParameters& now = parameters.surfaces;
  const bool stiffer = now.contact_stiffness != stiffness || now.pair_contact_stiffness != of_pairs;
  if (const Contact* touching = systems.scheme().contact(); touching && stiffer) {
    touching->take_given_stiffness(state, parameters);
    if (tape) tape->refuse("the contact stiffness was set during the run; begin a new run at the change");
  }
  // Energy stored in surfaces and anchors changes with their coefficients.
  ledger.actuation_work += energy() - before;
}

int World::own_contact(int first, int second) {
  Implementation& self = *implementation_;
  auto& pairs = self.description.contact.pairs;
  const auto found =
      std::find_if(pairs.begin(), pairs.end(), [&](const auto& pair) { return pair.is_of(first, second); });
  if (found != pairs.end()) return static_cast<int>(found - pairs.begin());
  const auto exists = [&](int body) {
    return body < static_cast<int>(self.description.rods.size()) &&
           -1 - body < static_cast<int>(self.description.contact.obstacles.size());
  };
  require(exists(first) && exists(second), "no such pair of bodies: ", first, ", ", second);
  ContactPairDescription pair;
  pair.first = first, pair.second = second;
  pairs.push_back(pair);
  self.take_contact();
  return static_cast<int>(pairs.size()) - 1;
}

void World::set_friction_shares(int pair, const VectorX& shares) {
  Implementation& self = *implementation_;
  auto& pairs = self.description.contact.pairs;
  require(pair >= 0 && pair < static_cast<int>(pairs.size()), "no such pair: ", pair);
  ContactPairDescription& own = pairs[at(pair)];
  if (own.shares.size() == shares.size() && own.shares == shares) return;
  ContactPairDescription wanted = own;
  wanted.shares = shares;
  check_shares(self.model, wanted);
  const Contact* contact = self.systems.scheme().contact();
  // Energy stored in anchors changes with their coefficients.
  const bool stores = contact && contact->anchored();
  const auto energy = [&] {
    return stores ? contact->energy_of(self.state, self.parameters, self.energy_scratch.contact) : 0.0;
  };
  const double before = energy();
  const bool same_form = own.shares.size() > 0;
  own.shares = shares;
  if (same_form) {
    self.model.description.contact.pairs[at(pair)].shares = shares;
    self.parameters.surfaces.pair_shares[at(pair)] = shares;
    update_derived(self.model, Derived::nothing, 0, self.parameters);
    self.state.acceleration_current = false;
    for (const System which : kSystems)
      if (Equations* known = self.systems.find(which); known && known->contact())
        known->contact()->set_parameters(self.parameters);
  } else {
    self.take_contact();
  }
  self.ledger.actuation_work += energy() - before;
}

/// As the description has it; the equations take another form only where friction comes or goes.
void World::Implementation::take_contact() {
  model.description.contact = description.contact;
  spatial_twin.reset();
  withe::set_contact(description.contact, parameters);
  update_derived(model, Derived::nothing, 0, parameters);
  reaction_current = false;
  state.acceleration_current = false;
  plan_current = false;
  bool remade = false;
  for (const System which : kSystems) {
    Equations* known = systems.find(which);
    if (!known || !known->contact()) continue;
    const bool frictional = known->contact()->frictional();
    known->contact()->set_parameters(parameters);
    remade = remade || known->contact()->frictional() != frictional;
  }
  if (remade) remake_equations();
}

void World::Implementation::leave_plane_for(const ParameterSetting& setting) {
  const std::string why = leaving_plane(model, setting);
  if (!why.empty()) leave_plane(why);
}

/// All of them or, where one is refused, none.
void World::Implementation::set(std::span<const ParameterSetting> settings, double over) {
  require(std::isfinite(over) && over >= 0.0, "over must be finite and not negative");
  for (const ParameterSetting& setting : settings) {
    check_setting(model, setting);
    const ParameterInfo& info = info_of(setting.kind);
    require(over == 0.0 || info.is_ramped(), info.name, " must be set without over");
    require(setting.kind != ParameterKind::fluid_viscosity || description.fluid.model != FluidModel::none,
            "the scene has no fluid");
    if (setting.kind != ParameterKind::fluid_regularization) continue;
    require(description.fluid.model == FluidModel::stokeslets, "the scene has no fluid of Stokeslets");
    check_regularization(model, setting.values(0, 0));
  }
  if (options.integrator == Integrator::fourth_order) {
    Parameters wanted = parameters;
    set_parameters(model, settings, wanted);
    check_reversible(model, options, wanted);
  }
  for (const ParameterSetting& setting : settings) leave_plane_for(setting);
  const auto of_surfaces = [](const ParameterSetting& setting) { return info_of(setting.kind).of_contact(); };
  if (std::any_of(settings.begin(), settings.end(), of_surfaces)) {
    std::vector<ParameterSetting> own, others;
    for (const ParameterSetting& setting : settings) (of_surfaces(setting) ? own : others).push_back(setting);
    Parameters wanted = parameters;
    set_parameters(model, own, wanted);
    ContactDescription contact = description.contact;
    describe_contact(wanted.surfaces, contact);
    set_contact(std::move(contact));
    if (!others.empty()) set(others, over);
    return;
  }
  if (settings.size() > 1 && std::any_of(settings.begin(), settings.end(), [&](const ParameterSetting& setting) {
        return shortest_ramp(setting) > over;
      })) {
    for (const ParameterSetting& setting : settings) set({&setting, 1}, over);
    return;
  }
  if (settings.size() == 1) over = std::max(over, shortest_ramp(settings.front()));
  for (const ParameterSetting& setting : settings)
    if (over > 0.0)
      begin_ramp(setting, over);
    else
      end_ramp(setting);
  if (over > 0.0) return;
  const bool set_before = newly_set;
  begin_setting();
  if (!set_parameters(model, settings, parameters)) {
    newly_set = set_before;
    return;
  }
  reaction_current = false;
  state.acceleration_current = false;
  plan_current = false;
}

/// Shortest time in which the rest angle of a servo gets to its value [s]; 0 of every other parameter. Equilibria have
/// no time.
double World::Implementation::shortest_ramp(const ParameterSetting& setting) const {
  if (setting.kind != ParameterKind::joint_rest_angle || options.integrator == Integrator::statics) return 0.0;
  const double way = std::abs(setting.values(0, 0) - parameters.joint_rest_angle[setting.owner]);
  return way / parameters.joint_max_speed[setting.owner];
}

/// Starts a ramp from the present value.
void World::Implementation::begin_ramp(const ParameterSetting& setting, double over) {
  const auto& [kind, owner, values] = setting;
  ParameterView now = parameter_view(model, parameters, kind, owner);
  const MatrixX target = values.rows() == now.rows() ? MatrixX(values) : MatrixX(values.replicate(now.rows(), 1));
  const Span way{state.time, state.time + over};
  if (info_of(kind).number) {
    end_ramp(setting);
    ramps.numbers.push_back({kind, owner, now(0, 0), target(0, 0), way});
  } else if (kind == ParameterKind::natural_curvature) {
    ramps.natural[at(owner)].curvature = {now, target, way.start, way.end, true};
  } else {
    NaturalRamp& own = ramps.natural[at(owner)];
    Ramp<VectorX>& ramp = kind == ParameterKind::natural_twist ? own.twist : own.stretch;
    ramp = {now.col(0), target.col(0), way.start, way.end, true};
  }
  reaction_current = false;
  state.acceleration_current = false;
}

/// A parameter that is set at once leaves its ramp.
void World::Implementation::end_ramp(const ParameterSetting& setting) {
  const auto& [kind, owner, values] = setting;
  const ParameterInfo& info = info_of(kind);
  if (info.derived == Derived::natural_strains || kind == ParameterKind::tendon_tension) note_actuation();
  if (info.number)
    std::erase_if(ramps.numbers, [&, k = kind, o = owner](const NumberRamp& r) { return r.kind == k && r.part == o; });
  if (kind == ParameterKind::natural_curvature) ramps.natural[at(owner)].curvature.active = false;
  if (kind == ParameterKind::natural_twist) ramps.natural[at(owner)].twist.active = false;
  if (kind == ParameterKind::natural_stretch) ramps.natural[at(owner)].stretch.active = false;
}

void World::set(std::span<const ParameterSetting> settings, double over) { implementation_->set(settings, over); }

namespace {

template <class Matrix>
ParameterValues rows_of(const Matrix& m) {
  return {m.data(), m.rows(), m.cols()};
}

}  // namespace

MatrixX World::parameter(ParameterKind kind, int owner) const {
  Implementation& self = *implementation_;
  check_owner(self.model, info_of(kind), owner);
  return parameter_view(self.model, self.parameters, kind, owner);
}

void World::set_natural_curvature(int rod, const MatrixX2& curvature, double over) {
  const ParameterSetting setting{ParameterKind::natural_curvature, rod, rows_of(curvature)};
  set({&setting, 1}, over);
}

void World::set_natural_twist(int rod, const VectorX& twist, double over) {
  const ParameterSetting setting{ParameterKind::natural_twist, rod, rows_of(twist)};
  set({&setting, 1}, over);
}

void World::set_natural_stretch(int rod, const VectorX& stretch, double over) {
  const ParameterSetting setting{ParameterKind::natural_stretch, rod, rows_of(stretch)};
  set({&setting, 1}, over);
}

MatrixX2 World::natural_curvature(int rod) const { return implementation_->parameters.natural_curvature.at(at(rod)); }
VectorX World::natural_twist(int rod) const { return implementation_->parameters.natural_twist.at(at(rod)); }

std::optional<double> World::due(ParameterKind kind, int owner) const {
  const Implementation& self = *implementation_;
  const ParameterInfo& info = info_of(kind);
  require(info.is_ramped(), info.name, " has no ramps");
  check_owner(self.model, info, owner);
  for (const NumberRamp& ramp : self.ramps.numbers)
    if (ramp.kind == kind && ramp.part == owner) return ramp.span.end;
  if (info.number) return std::nullopt;
  const NaturalRamp& ramp = self.ramps.natural.at(at(owner));
  const auto due = [](const auto& way) { return way.active ? std::optional(way.end) : std::nullopt; };
  if (kind == ParameterKind::natural_curvature) return due(ramp.curvature);
  return kind == ParameterKind::natural_twist ? due(ramp.twist) : due(ramp.stretch);
}

void World::set_added_mass(const VectorX& mass) {
  const ParameterSetting setting{ParameterKind::added_mass, 0, rows_of(mass)};
  set({&setting, 1});
}

void World::set_gravity(const Vector3& gravity) {
  const ParameterSetting setting{ParameterKind::gravity, 0, {gravity.data(), 1, 3}};
  set({&setting, 1});
}

void World::set_body_motion(int body, const Vector3& velocity, const Vector3& spin, const Vector3& held) {
  Implementation& self = *implementation_;
  require(velocity.allFinite() && spin.allFinite() && held.allFinite(), "velocities of a body must be finite");
  self.account_for_settings();
  const int frame = self.model.body_frame.at(at(body)), base = self.model.frame_node[at(frame)];
  if (self.model.planar()) {
    const Vector3& n = self.model.plane->normal;
    if (std::abs(velocity.dot(n)) > 1e-9 * velocity.norm() || spin.cross(n).norm() > 1e-9 * spin.norm())
      self.leave_plane("the motion of a body");
  }
  const Model& model = self.model;
  VectorX& v = self.state.v;
  const auto put_spin = [&](int f, const Vector3& turn) {
    const int dof = model.frame_dof[at(f)];
    if (model.planar())
      v(dof) = turn.dot(model.plane->normal);
    else
      v.segment<3>(dof) = turn;
  };
  const auto spin_of = [&](int f) { return frame_vector(model, v, f); };
  VectorX of_support = v;
  put_node_vector(model, base, held, of_support);
  put_node_vector(model, base, velocity, v);
  put_spin(frame, spin);
  for (const Constraint& c : model.constraints)
    if (c.first == model.node_dof[at(base)])
      v.segment(c.first, c.size) = (c.held(of_support) + c.free * c.part(v)).head(c.size);
  // Parts follow their bodies; of a body on a joint of another, only its motion in the joint is its own.
  for (const CarriedPart& part : model.carried) {
    const Matrix3 turned = frame_rotation(model, self.state, part.frame);
    if (part.is_node()) {
      Vector3 carried = node_vector(model, v, part.base);
      if (part.slide < 0) {
        carried += spin_of(part.frame).cross(turned * part.arm);
      } else {
        const Slide& slide = model.slides[at(part.slide)];
        const Vector3 axis = turned * slide.axis;
        carried += spin_of(part.frame).cross(turned * (part.arm + self.state.q(slide.dof) * slide.axis));
        if (part.node == base) v(slide.dof) = axis.dot(velocity - carried);
        carried += v(slide.dof) * axis;
      }
      put_node_vector(model, part.node, carried, v);
    } else if (part.edge >= 0) {
      v(part.own_dof) = spin_of(part.frame).dot(to_eigen(self.state.tangent[at(part.edge)]));
    } else if (part.hinge < 0) {
      put_spin(part.own_frame, spin_of(part.frame));
    } else {
      const Hinge& hinge = model.hinges[at(part.hinge)];
      const Vector3 axis = turned * hinge.axis;
      if (part.own_frame == frame) v(hinge.dof) = axis.dot(spin - spin_of(part.frame));
      put_spin(part.own_frame, spin_of(part.frame) + v(hinge.dof) * axis);
    }
  }
  self.forget_motion();
}

void World::set_velocities(const MatrixX3& velocities) {
  Implementation& self = *implementation_;
  require(velocities.rows() == self.model.node_count, "velocities need one row a node");
  require(velocities.allFinite(), "velocities must be finite");
  self.account_for_settings();
  if (self.model.planar()) {
    const VectorX off = velocities * self.model.plane->normal;
    if (off.cwiseAbs().maxCoeff() > 1e-9 * velocities.cwiseAbs().maxCoeff()) self.leave_plane("a velocity");
  }
  for (int i = 0; i < self.model.node_count; ++i) put_node_vector(self.model, i, velocities.row(i), self.state.v);
  self.forget_motion();
}

}  // namespace withe
