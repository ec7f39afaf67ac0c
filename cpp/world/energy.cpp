#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "common/text.hpp"
#include "steps/hand_forces.hpp"
#include "steps/joint_forces.hpp"
#include "steps/spring_forces.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

/// Share of the greatest kinetic energy by which the energy of midpoint steps may drift before a warning.
constexpr double kMostDrift = 1e-2;
/// Share of a component's kinetic and elastic energy that a backward Euler step may add.
constexpr double kMostPressureGain = 1e-4;

/// Of a part of each node's mass, part(node).
template <class Part>
double gravity_energy(const Model& model, const EnergyCoefficients& k, const VectorX& q, const Part& part) {
  Vector3 g = k.gravity;
  if (model.planar()) g << k.gravity.dot(model.plane->first), k.gravity.dot(model.plane->second), 0.0;
  double energy = 0.0;
  for (int i = 0; i < model.node_count; ++i) {
    const int dof = model.node_dof[at(i)];
    for (int d = 0; d < model.dimension; ++d) energy -= part(i) * k.node_mass(i) * g(d) * q(dof + d);
  }
  return energy;
}

BendTwistEnergy bend_twist_energy(const Model& model, const ElasticCoefficients& k, const Configuration& c) {
  BendTwistEnergy sum{0.0, 0.0};
  const auto add = [&](const BendTwistEnergy& part) {
    sum.bend += part.bend;
    sum.twist += part.twist;
  };
  for (int b = 0; b < static_cast<int>(model.bend.size()); ++b) add(bend_energy_of(k, c, b));
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) add(half_energy_of(k, c, h));
  return sum;
}

double stretch_energy(const Model& model, const ElasticCoefficients& k, const Configuration& c) {
  double energy = 0.0;
  for (int i = 0; i < model.edge_count; ++i) energy += stretch_energy_of(model, k, c, i);
  return energy;
}

/// Energy balance, which an exact integrator leaves constant [J].
double balance_of(const Energy& e) { return e.total - e.work + e.dissipated; }

/// Rounding error bound of a balance [J]. What rests has no energy but that of its weight.
double rounding_of(const Energy& e, int unknowns) {
  const double sum = e.kinetic + e.elastic() + e.contact + std::abs(e.gravity) + std::abs(e.loads) + std::abs(e.work) +
                     std::abs(e.dissipated);
  return std::numeric_limits<double>::epsilon() * unknowns * sum;
}

/// Kinetic, elastic, of springs and gravity's.
Energy mechanical_energy(const Model& model, const EnergyCoefficients& k, const Configuration& c, const State& state) {
  Energy e;
  e.kinetic = kinetic_energy(model, k.mass, state.v);
  e.stretch = stretch_energy(model, k.elastic, c);
  const BendTwistEnergy turned = bend_twist_energy(model, k.elastic, c);
  e.bend = turned.bend;
  e.twist = turned.twist;
  e.gravity = gravity_energy(model, k, state.q, [](int) { return 1.0; });
  e.spring = spring_energy(model, k.spring_stiffness, k.spring_rest_length, state.q) +
             joint_energy(model, k.elastic, state.q) + hand_energy(model, k.elastic.measure, state, c);
  return e;
}

}  // namespace

void EnergyCoefficients::set(const Model& model, const Parameters& p) {
  if (natural_version != p.natural_version) set_natural(p, elastic);
  natural_version = p.natural_version;
  if (version == p.version) return;
  version = p.version;
  set_elastic(p, elastic);
  set_mass(model, p, mass);
  node_mass = p.node_mass;
  gravity = p.gravity;
  spring_stiffness = p.spring_stiffness;
  spring_rest_length = p.spring_rest_length;
}

/// Takes ramps on to a time at a configuration that stays, and adds what that changes of the elastic energy [J].
void World::Implementation::apply_ramps(double time, const Configuration& c, double& work) {
  EnergyCoefficients& before = energy_scratch.coefficients;
  before.set(model, parameters);
  apply_ramps(time);
  work += natural_change_energy(model, before.elastic, parameters, c);
}

/// That of the present state.
const Configuration& World::Implementation::configuration() const {
  compute_configuration(model, state, state.q, energy_scratch.configuration);
  return energy_scratch.configuration;
}

void World::Implementation::begin_setting() {
  if (!newly_set) before_settings.set(model, parameters);
  newly_set = true;
}

void World::Implementation::account_for_settings() {
  if (!newly_set) return;
  actuation_work += work_of_settings();
  std::swap(before_settings, energy_scratch.coefficients);  // those of now, for what is set next
  newly_set = false;
}

double World::Implementation::work_of_settings() const {
  if (!newly_set) return 0.0;
  auto& [c, now, touching, components] = energy_scratch;
  compute_configuration(model, state, state.q, c);
  now.set(model, parameters);
  const Energy a = mechanical_energy(model, before_settings, c, state), b = mechanical_energy(model, now, c, state);
  return (b.kinetic - a.kinetic) + (b.stretch - a.stretch) + (b.bend - a.bend) + (b.twist - a.twist) +
         (b.gravity - a.gravity) + (b.spring - a.spring);
}

/// Of stretching, bending, twisting and joints, as it is [J].
double World::Implementation::elastic_energy() const {
  auto& [c, now, touching, components] = energy_scratch;
  compute_configuration(model, state, state.q, c);
  now.set(model, parameters);
  const BendTwistEnergy turned = bend_twist_energy(model, now.elastic, c);
  return stretch_energy(model, now.elastic, c) + turned.bend + turned.twist + joint_energy(model, now.elastic, state.q);
}

Energy World::Implementation::energy() const {
  return energy_of(state, load_work, support_work + (actuation_work + work_of_settings()), dissipated);
}

/// Energy of a state, with the work and the losses up to it.
Energy World::Implementation::energy_of(const State& at, double loads, double work_done, double lost) const {
  auto& [c, coefficients, touching, components] = energy_scratch;
  compute_configuration(model, at, at.q, c);
  coefficients.set(model, parameters);
  Energy e = mechanical_energy(model, coefficients, c, at);
  e.loads = -loads;
  if (const Contact* contact = systems.scheme().contact()) e.contact = contact->energy_of(at, parameters, touching);
  e.total = e.kinetic + e.stretch + e.bend + e.twist + e.gravity + e.loads + e.contact + e.spring;
  e.work = work_done;
  e.dissipated = lost;
  return e;
}

/// A node's part goes to the rods that meet there, by the masses of their half edges: what is added to it too.
Energy World::Implementation::rod_energy(int rod) const {
  auto& [c, coefficients, touching, components] = energy_scratch;
  compute_configuration(model, state, state.q, c);
  coefficients.set(model, parameters);
  const ElasticCoefficients& k = coefficients.elastic;
  const MassMatrix& mass = coefficients.mass;
  const int first = model.rod_first_edge.at(at(rod)), last = model.rod_first_edge.at(at(rod) + 1);
  const auto share_of = [&](int edge) { return first <= edge && edge < last ? 1.0 : 0.0; };

  Energy e;
  VectorX all = VectorX::Zero(model.node_count), mine = all;  // masses of half edges at the nodes [kg]
  for (int i = 0; i < model.edge_count; ++i)
    for (int node : {model.edge_tail[at(i)], model.edge_head[at(i)]}) {
      const double half = 0.5 * parameters.edge_density(i) * model.edge_arc(i);
      all(node) += half;
      mine(node) += share_of(i) * half;
    }
  VectorX part = VectorX::Zero(model.dof_count);  // of each unknown that is this rod's
  for (int i = 0; i < model.node_count; ++i)
    part.segment(model.node_dof[at(i)], model.dimension).setConstant(mine(i) / all(i));
  for (int i = first; i < last; ++i) {
    const int a = model.tail_dof[at(i)], b = model.head_dof[at(i)], n = model.dimension;
    e.kinetic -= 0.5 * mass.coupling(i) * (state.v.segment(b, n) - state.v.segment(a, n)).squaredNorm();
    if (!model.planar()) part(model.edge_dof[at(i)]) = 1.0;
    e.stretch += stretch_energy_of(model, k, c, i);
  }
  VectorX halves = VectorX::Zero(model.frame_count), my_halves = halves;
  for (std::size_t h = 0; h < model.half.size(); ++h) {
    const double share = share_of(model.half[h].edge);
    halves(model.half[h].frame) += 1.0;
    my_halves(model.half[h].frame) += share;
    if (model.half[h].hinge >= 0) part(model.hinges[at(model.half[h].hinge)].dof) = share;
    const BendTwistEnergy turned = half_energy_of(k, c, static_cast<int>(h));
    e.bend += share * turned.bend;
    e.twist += share * turned.twist;
  }
  for (int f = 0; f < model.frame_count; ++f)
    part.segment(model.frame_dof[at(f)], model.frame_size()).setConstant(my_halves(f) / std::max(halves(f), 1.0));
  for (std::size_t b = 0; b < model.bend.size(); ++b) {
    const double share = 0.5 * (share_of(model.bend[b].edge[0]) + share_of(model.bend[b].edge[1]));
    const BendTwistEnergy turned = bend_energy_of(k, c, static_cast<int>(b));
    e.bend += share * turned.bend;
    e.twist += share * turned.twist;
  }
  e.kinetic += 0.5 * part.cwiseProduct(mass.rows).dot(state.v.cwiseAbs2());
  e.gravity = gravity_energy(model, coefficients, state.q, [&](int node) { return mine(node) / all(node); });
  e.total = e.kinetic + e.stretch + e.bend + e.twist + e.gravity;
  return e;
}

/// Whether the backward Euler step just taken added too much to a component, of what that has now.
bool World::Implementation::gains_under_pressure() {
  const VectorX& gains = systems.work.pressure.gains;
  if ((gains.array() <= 0.0).all()) return false;
  ComponentEnergies& now = energy_scratch.components;
  find_component_energies(state, now);
  return (gains.array() > kMostPressureGain * (now.kinetic + now.elastic).array()).any();
}

void World::Implementation::find_component_energies(const State& then, ComponentEnergies& out) const {
  auto& [c, k, touching, components] = energy_scratch;
  compute_configuration(model, then, then.q, c);
  k.set(model, parameters);
  const MassMatrix& mass = k.mass;
  const VectorX& v = then.v;
  for (VectorX* x : {&out.kinetic, &out.elastic, &out.travelling, &out.mass}) x->setZero(model.component_count);
  out.momentum.setZero(model.component_count, 3);
  for (int i = 0; i < model.dof_count; ++i) out.kinetic[model.dof_component[at(i)]] += 0.5 * mass.rows[i] * v[i] * v[i];
  for (int i = 0; i < model.node_count; ++i) {
    const int dof = model.node_dof[at(i)], own = model.component_of_node(i);
    out.mass[own] += mass.rows[dof];
    for (int d = 0; d < model.dimension; ++d) out.momentum(own, d) += mass.rows[dof + d] * v[dof + d];
  }
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.tail_dof[at(e)], b = model.head_dof[at(e)], n = model.dimension,
              own = model.component_of_edge(e);
    out.kinetic[own] -= 0.5 * mass.coupling[e] * (v.segment(b, n) - v.segment(a, n)).squaredNorm();
    out.elastic[own] += stretch_energy_of(model, k.elastic, c, e);
  }
  const auto add = [&](int edge, const BendTwistEnergy& turned) {
    out.elastic[model.component_of_edge(edge)] += turned.bend + turned.twist;
  };
  for (std::size_t b = 0; b < model.bend.size(); ++b)
    add(model.bend[b].edge[0], bend_energy_of(k.elastic, c, static_cast<int>(b)));
  for (std::size_t h = 0; h < model.half.size(); ++h)
    add(model.half[h].edge, half_energy_of(k.elastic, c, static_cast<int>(h)));
  for (std::size_t s = 0; s < model.description.springs.size(); ++s)
    out.elastic[model.component_of_node(model.description.springs[s].nodes[0])] +=
        spring_energy(model, k.spring_stiffness, k.spring_rest_length, then.q, static_cast<int>(s));
  for (std::size_t j = 0; j < model.joint_angles.size(); ++j)
    out.elastic[model.component_of_node(model.joint_angles[j].node)] +=
        joint_energy(model, k.elastic, then.q, static_cast<int>(j));
  // In a frame that goes with the nodes that supports hold, else with the centre of mass.
  MatrixX3& frame = out.frame;
  VectorX& nodes = out.held_nodes;
  frame.setZero(model.component_count, 3);
  nodes.setZero(model.component_count);
  for (const Support& support : model.supports)
    for (const int node : support.nodes) {
      if (!support.active || support.yields()) continue;
      const int own = model.component_of_node(node);
      nodes[own] += 1.0;
      frame.row(own).head(model.dimension) += v.segment(model.node_dof[at(node)], model.dimension).transpose();
    }
  for (int i = 0; i < model.component_count; ++i) {
    if (nodes[i] > 0.0)
      frame.row(i) /= nodes[i];
    else if (out.mass[i] > 0.0)
      frame.row(i) = out.momentum.row(i) / out.mass[i];
    out.travelling[i] = frame.row(i).dot(out.momentum.row(i) - 0.5 * out.mass[i] * frame.row(i));
    out.kinetic[i] -= out.travelling[i];
  }
}

/// Kinetic and elastic energy of components that touch anything [J]: about their common centre of mass, but in a frame
/// that goes with an obstacle, or rests as what is held does, where there is one; the greatest of several.
double World::Implementation::touching_energy(const State& then) {
  ComponentEnergies& energies = energy_scratch.components;
  find_component_energies(then, energies);
  double sum = 0.0, mass = 0.0, travelling = 0.0;
  Vector3 momentum = Vector3::Zero();
  const auto [which, obstacles] = systems.scheme().contact()->touching_components();
  bool held = false;
  for (int i = 0; i < model.component_count; ++i) {
    if (!which[at(i)]) continue;
    held = held || energies.held_nodes[i] > 0.0;
    sum += energies.kinetic[i] + energies.elastic[i];
    travelling += energies.travelling[i];
    mass += energies.mass[i];
    momentum += energies.momentum.row(i).transpose();
  }
  if (!held && obstacles.empty()) return sum + travelling - (mass > 0.0 ? 0.5 * momentum.squaredNorm() / mass : 0.0);
  double greatest = held ? travelling : 0.0;
  for (const Vec3d& obstacle : obstacles) {
    const Vector3 frame = to_eigen(obstacle);
    greatest = std::max(greatest, travelling - frame.dot(momentum - 0.5 * mass * frame));
  }
  return sum + greatest;
}

/// Where surfaces slide over each other's edges by much within a step, the forces at its end may push more than those
/// on the way would have. Whether the step just taken, that started from `kept`, gained by that more
/// than half of what is left of a share of the greatest energy; losses make room, and so does time, and a little of
/// what friction and drag take.
bool World::Implementation::contact_pumps(double dt) {
  constexpr double kMost = 3e-3, kRoom = 2e-5;  // of the greatest energy of what touches; that a time step makes
  constexpr double kShare = 0.01;               // of what is lost within a step
  auto& [scale, excess, put_in] = contact_guard;
  double gain = put_in;
  const double lost = std::max(dissipated - kept.dissipated, 0.0);
  const auto room = [&] { return kRoom * scale * dt / options.time_step + kShare * lost; };
  const auto too_much = [&] { return gain > room() + 0.5 * std::max(kMost * scale - excess, 0.0); };
  if (too_much()) {
    // What other parts lose makes up for it, but what drag, viscosity and friction take does not.
    const Energy now = energy();
    const Energy then = energy_of(kept.state, kept.load_work, kept.support_work + kept.actuation_work, kept.dissipated);
    gain = put_in + balance_of(now) - balance_of(then);
    scale = std::max({scale, touching_energy(state) + now.contact, touching_energy(kept.state) + then.contact});
    if (too_much()) return true;
  }
  excess = std::max(excess + gain - room(), 0.0);
  return false;
}

/// Refuses an explicit step that the drawing allowed, but not what has come since: forces that press surfaces, other
/// material.
void World::Implementation::begin_energy_watch() {
  const bool is_explicit = options.integrator == Integrator::verlet;
  if (!is_explicit && options.integrator != Integrator::implicit_midpoint) return;
  const std::string longest = is_explicit ? longest_explicit_step() : "";
  if (!longest.empty()) fail(NewtonResult{}, options.time_step, "the explicit scheme is not stable here" + longest);
  first_energy = energy();
  greatest_kinetic = first_energy->kinetic;
}

void World::Implementation::check_energy() {
  if (options.integrator == Integrator::verlet) check_explicit();
  if (options.integrator == Integrator::implicit_midpoint && first_energy && !warnings.has_reported(Warning::drift))
    check_drift();
}

/// What to say where the time step is above the stable one at the present state; else nothing.
std::string World::Implementation::longest_explicit_step() {
  const double stable = stable_step(systems.scheme(), parameters, at_rest(), state, systems.work);
  if (!(options.time_step > stable)) return "";
  const bool slips = systems.scheme().contact() && systems.scheme().contact()->regularises();
  return ": take a time_step below " + text(stable) + " s" +
         (slips ? ", or a greater slip_tolerance, which allows longer ones under friction" : "");
}

/// An explicit scheme that is about to blow up gains energy long before it shows as NaN.
void World::Implementation::check_explicit() {
  const Energy e = energy();
  const double gain = balance_of(e) - balance_of(*first_energy);
  const double scale = std::max({first_energy->kinetic, std::abs(e.gravity - first_energy->gravity),
                                 std::abs(e.loads - first_energy->loads), std::abs(e.work - first_energy->work),
                                 first_energy->elastic(), 1e-300});
  if (std::isfinite(e.total) && gain <= 0.5 * scale + rounding_of(e, model.dof_count)) return;
  const std::string longest = std::isfinite(e.total) ? longest_explicit_step() : "";
  fail(NewtonResult{}, options.time_step, "the explicit scheme gains energy" + longest);
}

/// Midpoint steps conserve energy to second order only, and stretching of edges that turn far within a step not at all
/// [Simo, Tarnow and Doblare 1995].
void World::Implementation::check_drift() {
  const Energy e = energy();
  greatest_kinetic = std::max(greatest_kinetic, e.kinetic);
  const double drift = balance_of(e) - balance_of(*first_energy);
  if (std::abs(drift) <= kMostDrift * greatest_kinetic + rounding_of(e, model.dof_count)) return;
  warnings.report(
      Warning::drift,
      "integrator='implicit_midpoint' has " + std::string(drift > 0.0 ? "added " : "lost ") + text(std::abs(drift), 2) +
          " J, " + text(100.0 * std::abs(drift) / greatest_kinetic, 2) + " % of the greatest kinetic energy (time " +
          text(state.time, 6) + " s, time_step " + text(options.time_step) +
          " s). Use integrator='energy_momentum', which conserves energy at any time_step, or a shorter one.");
}

}  // namespace withe
