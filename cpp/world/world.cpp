#include "world/world.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "common/check.hpp"
#include "common/timer.hpp"
#include "steps/spring_forces.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

/// Whether a load points, or turns, out of the plane of a normal.
bool off_plane(LoadKind kind, const Vector3& value, const Vector3& normal) {
  const double off = is_axial(kind) ? value.cross(normal).norm() : std::abs(value.dot(normal));
  return off > 1e-8 * value.norm();
}

int checked_spring(const Parameters& parameters, int spring) {
  require(spring >= 0 && spring < parameters.spring_stiffness.size(), "no such spring: " + std::to_string(spring));
  return spring;
}

}  // namespace

World::World(SceneDescription description, Options options)
    : implementation_(std::make_unique<Implementation>(std::move(description), options)) {}
World::World(const World& other) : implementation_(std::make_unique<Implementation>(*other.implementation_)) {
  implementation_->recall(other.implementation_->lagged());
}
World::~World() = default;

const SceneDescription& World::description() const { return implementation_->description; }
const Options& World::options() const { return implementation_->options; }
const Plan& World::plan() const {
  if (!implementation_->plan_current) implementation_->make_plan();
  return implementation_->plan;
}
double World::time() const { return implementation_->state.time; }
void World::interrupt() { implementation_->interrupted = true; }

const Statistics& World::statistics() const {
  Statistics& s = implementation_->statistics;
  const Counters& c = implementation_->work.newton.counters;
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
  self.guard.energy.reset();
  const double dt = self.options.time_step;
  const auto on_grid = [&](std::int64_t steps) { return self.grid_origin + static_cast<double>(steps) * dt; };
  for (int i = 0; i < count; ++i) {
    if (self.state.time != on_grid(self.grid_steps)) {
      self.grid_origin = self.state.time;
      self.grid_steps = 0;
    }
    const double end = on_grid(self.grid_steps + 1);
    if (self.options.integrator == Integrator::statics) {
      self.work.newton.poll();
      if (self.callback) self.callback(end, end);
      self.equilibrium(dt);
    } else {
      self.advance(dt);
    }
    self.state.time = end;
    ++self.grid_steps;
  }
  if (self.options.integrator == Integrator::verlet && count > 0) self.check_explicit();
}

void World::advance_to(double time) {
  Implementation& self = *implementation_;
  const double span = time - self.state.time;
  require(std::isfinite(time) && span >= 0.0, "time must not lie before the present, got " + std::to_string(time));
  if (span == 0.0) return;
  self.guard.energy.reset();
  const Timer timer(self.statistics.total_time);
  const double steps = std::max(1.0, std::ceil(span / self.options.time_step - 1e-9));
  const double start = self.state.time;
  for (double i = 1.0; i <= steps; i += 1.0) {
    const double next = i == steps ? time : start + span * i / steps;
    if (self.options.integrator == Integrator::statics) {
      self.work.newton.poll();
      if (self.callback) self.callback(next, next);
      self.equilibrium(next - self.state.time);
    } else {
      self.advance(next - self.state.time);
    }
    self.state.time = next;
  }
  if (self.options.integrator == Integrator::verlet) self.check_explicit();
}

EquilibriumResult World::equilibrium() {
  Implementation& self = *implementation_;
  const Timer timer(self.statistics.total_time);
  if (self.callback) self.callback(self.state.time, self.state.time);
  return self.equilibrium(0.0);
}

void World::set_step_callback(const StepCallback& callback) {
  if (!callback) {
    implementation_->callback = nullptr;
    return;
  }
  implementation_->callback = [this, callback](double force_time, double end_time) {
    callback(*this, force_time, end_time);
  };
}

void World::set_poll(const std::function<void()>& poll) { implementation_->poll = poll; }

void World::set_force_function(const CustomFunction& force) { implementation_->force_function = force; }

void World::set_load(int load, const Vector3& value) {
  Implementation& self = *implementation_;
  require(load >= 0 && load < static_cast<int>(self.load_values.size()), "no such load: " + std::to_string(load));
  require(value.allFinite(), "load must be finite");
  if (self.model.planar()) {
    const Vector3& n = self.model.plane->normal;
    if (off_plane(self.description.loads[at(load)].kind, value, n)) self.leave_plane("a load");
  }
  self.load_values[at(load)] = value;
  self.equations->loads().values = self.load_values;
  self.reaction_current = false;
  self.state.acceleration_current = false;
}
int World::add_load(const LoadDescription& load) {
  Implementation& self = *implementation_;
  const auto& rods = self.description.rods;
  require(load.pass.rod >= 0 && load.pass.rod < static_cast<int>(rods.size()) && load.pass.node >= 0 &&
              load.pass.node < static_cast<int>(rods[at(load.pass.rod)].nodes.size()),
          "load at a node that is not there");
  require(load.value.allFinite(), "load must be finite");
  if (self.model.planar() && off_plane(load.kind, load.value, self.model.plane->normal)) self.leave_plane("a load");
  self.description.loads.push_back(load);
  self.description.loads.back().added = true;
  self.load_values.push_back(load.value);
  self.remake_equations();
  return static_cast<int>(self.load_values.size()) - 1;
}
void World::remove_load(int load) {
  Implementation& self = *implementation_;
  require(load >= 0 && load < static_cast<int>(self.load_values.size()), "no such load: " + std::to_string(load));
  require(self.description.loads[at(load)].added, "a load of the drawing stays: set it to zero");
  self.description.loads.erase(self.description.loads.begin() + load);
  self.load_values.erase(self.load_values.begin() + load);
  self.remake_equations();
}
Vector3 World::load(int load) const {
  require(load >= 0 && load < static_cast<int>(implementation_->load_values.size()),
          "no such load: " + std::to_string(load));
  return implementation_->load_values[at(load)];
}

void World::set_friction(const ContactDescription& contact) {
  Implementation& self = *implementation_;
  ContactDescription& own = self.description.contact;
  const auto valid = [](const VectorX& v) { return v.size() == 0 || (v.allFinite() && v.minCoeff() >= 0.0); };
  require(contact.obstacle_friction.size() == own.obstacle_friction.size() &&
              (contact.obstacle_across.size() == 0 || contact.obstacle_across.size() == own.obstacle_friction.size()),
          "friction needs one coefficient an obstacle");
  require(std::isfinite(contact.friction) && contact.friction >= 0.0 && valid(contact.obstacle_friction) &&
              valid(contact.obstacle_across),
          "friction must not be negative");
  own.friction = contact.friction;
  own.obstacle_friction = contact.obstacle_friction;
  own.obstacle_across = contact.obstacle_across;
  own.pairs = contact.pairs;
  self.model.description.contact = own;
  self.remake_equations();
}

template <class Value>
void World::Implementation::actuate(Ramp<Value>& ramp, Value& now, const Value& value, double over) {
  if (over == 0.0) {
    const double before = actuation_energy();
    ramp.active = false;
    now = value;
    update_natural(model, parameters);
    actuation_work += actuation_energy_again() - before;
  } else {
    ramp = {now, value, state.time, state.time + over, true};
  }
  reaction_current = false;
  state.acceleration_current = false;
}

void World::set_natural_curvature(int rod, const MatrixX2& curvature, double over) {
  Implementation& self = *implementation_;
  require(rod >= 0 && rod < static_cast<int>(self.ramps.size()), "no such rod: " + std::to_string(rod));
  MatrixX2& now = self.parameters.natural_curvature[at(rod)];
  require(curvature.rows() == now.rows(), "natural curvature needs one row a stencil, " + std::to_string(now.rows()) +
                                              ", got " + std::to_string(curvature.rows()));
  require(curvature.allFinite() && std::isfinite(over) && over >= 0.0, "natural curvature must be finite, over >= 0");
  if (self.model.planar()) {
    const Vector2 p = self.model.planar_components[at(rod)];
    for (Eigen::Index i = 0; i < curvature.rows(); ++i)
      if (std::abs(curvature(i, 0) * p(1) - curvature(i, 1) * p(0)) > 1e-8 * curvature.row(i).norm()) {
        self.leave_plane("natural curvature of rod '" + self.description.rods[at(rod)].name + "'");
        break;
      }
  }
  for (std::size_t s = 0; s < self.model.place[at(rod)].size(); ++s) {
    const auto row = static_cast<Eigen::Index>(s);
    const int b = self.model.place[at(rod)][s].bend;
    if (b >= 0) discrete_curvature(curvature.row(row), self.model.bend_voronoi(b));  // refuses a turn of pi
  }
  self.actuate(self.ramps[at(rod)].curvature, now, curvature, over);
}

void World::set_natural_twist(int rod, const VectorX& twist, double over) {
  Implementation& self = *implementation_;
  require(rod >= 0 && rod < static_cast<int>(self.ramps.size()), "no such rod: " + std::to_string(rod));
  require(twist.size() == self.parameters.natural_twist[at(rod)].size(), "natural twist needs one number a stencil");
  require(twist.allFinite() && std::isfinite(over) && over >= 0.0, "natural twist must be finite, over >= 0");
  if (self.model.planar() && (twist.array() != 0.0).any())
    self.leave_plane("natural twist of rod '" + self.description.rods[at(rod)].name + "'");
  self.actuate(self.ramps[at(rod)].twist, self.parameters.natural_twist[at(rod)], twist, over);
}

MatrixX2 World::natural_curvature(int rod) const { return implementation_->parameters.natural_curvature.at(at(rod)); }
VectorX World::natural_twist(int rod) const { return implementation_->parameters.natural_twist.at(at(rod)); }

void World::set_rod_parameters(int rod, const RodDescription& d) {
  Implementation& self = *implementation_;
  require(rod >= 0 && rod < static_cast<int>(self.ramps.size()), "no such rod: " + std::to_string(rod));
  const int count = self.model.rod_first_edge[at(rod) + 1] - self.model.rod_first_edge[at(rod)];
  for (const VectorX* v :
       {&d.stretch_stiffness, &d.twist_stiffness, &d.line_density, &d.rotary_inertia, &d.viscous_time, &d.drag})
    require(v->size() == count && v->allFinite(), "rod parameters need one finite number an edge");
  require(d.bend_stiffness.rows() == count && d.bend_stiffness.allFinite(), "bend_stiffness needs one row an edge");
  Parameters p = self.parameters;
  set_rod(self.model, rod, d, p);
  update_derived(self.model, p);
  self.check_reversible(p);
  const double before = self.actuation_energy();
  self.parameters = std::move(p);
  self.actuation_work += self.actuation_energy_again() - before;
  self.reaction_current = false;
  self.state.acceleration_current = false;
  self.plan_current = false;
}

void World::set_added_mass(const VectorX& mass) {
  Implementation& self = *implementation_;
  require(mass.size() == self.model.node_count && mass.allFinite() && (mass.array() >= 0.0).all(),
          "added mass needs one finite number >= 0 a node");
  Parameters p = self.parameters;
  p.added_mass = mass;
  update_derived(self.model, p);
  self.check_reversible(p);
  self.parameters = std::move(p);
  self.state.acceleration_current = false;
}

void World::set_gravity(const Vector3& gravity) {
  Implementation& self = *implementation_;
  require(gravity.allFinite(), "gravity must be finite");
  if (self.model.planar() && std::abs(gravity.dot(self.model.plane->normal)) > 1e-8 * gravity.norm())
    self.leave_plane("gravity");
  self.parameters.gravity = gravity;
  update_derived(self.model, self.parameters);
  self.reaction_current = false;
  self.state.acceleration_current = false;
}

void World::set_fluid_viscosity(double viscosity) {
  Implementation& self = *implementation_;
  require(self.description.fluid.model != FluidModel::none, "the scene has no fluid");
  require(std::isfinite(viscosity) && viscosity > 0.0,
          "viscosity of the fluid must be positive and finite, got " + std::to_string(viscosity));
  self.parameters.fluid_viscosity = viscosity;
  update_derived(self.model, self.parameters);
  self.state.acceleration_current = false;
}

void World::set_spring(int spring, const SpringDescription& description) {
  Implementation& self = *implementation_;
  const double before = spring_energy(self.model, self.parameters, self.state.q);
  Parameters p = self.parameters;
  withe::set_spring(checked_spring(p, spring), description, p);
  self.check_reversible(p);
  update_natural(self.model, p);
  self.parameters = std::move(p);
  self.actuation_work += spring_energy(self.model, self.parameters, self.state.q) - before;
  self.reaction_current = false;
  self.state.acceleration_current = false;
}

SpringDescription World::spring(int spring) const {
  const Implementation& self = *implementation_;
  const Parameters& p = self.parameters;
  const int s = checked_spring(p, spring);
  return {self.description.springs[at(s)].nodes, p.spring_stiffness[s], p.spring_rest_length[s], p.spring_damping[s]};
}

void World::set_velocities(const MatrixX3& velocities) {
  Implementation& self = *implementation_;
  require(velocities.rows() == self.model.node_count, "velocities need one row a node");
  require(velocities.allFinite(), "velocities must be finite");
  if (self.model.planar()) {
    const VectorX off = velocities * self.model.plane->normal;
    if (off.cwiseAbs().maxCoeff() > 1e-9 * velocities.cwiseAbs().maxCoeff()) self.leave_plane("a velocity");
  }
  for (int i = 0; i < self.model.node_count; ++i) {
    const int dof = self.model.node_dof[at(i)];
    const Vector3 v = velocities.row(i);
    if (self.model.planar())
      self.state.v.segment<2>(dof) << v.dot(self.model.plane->first), v.dot(self.model.plane->second);
    else
      self.state.v.segment<3>(dof) = v;
  }
  self.equations->assembler().project(self.state.v);
  self.forget_motion();
}

}  // namespace withe
