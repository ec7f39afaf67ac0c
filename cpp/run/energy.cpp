#include "run/energy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/edge_vectors.hpp"
#include "steps/hand_forces.hpp"
#include "steps/terms.hpp"

namespace withe {
namespace {

/// Energy of the share part(node) of each node's mass.
template <class Part>
double gravity_energy(const Model& model, const EnergyCoefficients& k, const VectorX& q, const Part& part) {
  const Vec3d g = in_axes(model, k.gravity);
  double energy = 0.0;
  for (int i = 0; i < model.node_count; ++i) {
    const int dof = model.node_dof[at(i)];
    for (int d = 0; d < model.dimension; ++d) energy -= part(i) * k.node_mass(i) * g[d] * q(dof + d);
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

/// Kinetic, elastic, of springs and gravity's.
Energy mechanical_energy(const Model& model, const EnergyCoefficients& k, const Configuration& c, const State& state) {
  Energy e;
  e.kinetic = kinetic_energy(model, k.mass, state.v);
  e.stretch = stretch_energy(model, k.elastic, c);
  const BendTwistEnergy turned = bend_twist_energy(model, k.elastic, c);
  e.bend = turned.bend;
  e.twist = turned.twist;
  e.gravity = gravity_energy(model, k, state.q, [](int) { return 1.0; });
  e.spring = stored_energy(model, k.numbers, state.q, c) + hand_energy(model, k.elastic.measure, state, c);
  return e;
}

}  // namespace

double balance_of(const Energy& e) { return e.total - e.work + e.dissipated; }

double rounding_of(const Energy& e, int unknowns) {
  const double sum = e.kinetic + e.elastic() + e.contact + std::abs(e.gravity) + std::abs(e.loads) + std::abs(e.work) +
                     std::abs(e.dissipated);
  return std::numeric_limits<double>::epsilon() * unknowns * sum;
}

void EnergyCoefficients::set(const Model& model, const Parameters& p) {
  if (natural_version != p.natural_version) set_natural(p, elastic);
  natural_version = p.natural_version;
  if (version == p.version) return;
  version = p.version;
  set_elastic(p, elastic);
  set_mass(model, p, mass);
  node_mass = p.node_mass;
  gravity = p.gravity;
  numbers = p;
}

void EnergyScratch::set(const Model& model, const Parameters& parameters, const State& state) {
  compute_configuration(model, state, state.q, configuration);
  coefficients.set(model, parameters);
  if (model.has_bodies()) turn_bodies(model, parameters, state, coefficients.mass);
}

double change_by_settings(const Model& model, const EnergyCoefficients& before, const Parameters& parameters,
                          const State& state, EnergyScratch& scratch) {
  scratch.set(model, parameters, state);
  auto& [c, now, touching, components] = scratch;
  const EnergyCoefficients* then = &before;
  EnergyCoefficients turned;
  if (model.has_bodies()) {  // which have turned since
    turned = before;
    turned.mass.bodies = now.mass.bodies;
    then = &turned;
  }
  const Energy a = mechanical_energy(model, *then, c, state), b = mechanical_energy(model, now, c, state);
  return (b.kinetic - a.kinetic) + (b.stretch - a.stretch) + (b.bend - a.bend) + (b.twist - a.twist) +
         (b.gravity - a.gravity) + (b.spring - a.spring);
}

double elastic_energy(const Model& model, const Parameters& parameters, const State& state, EnergyScratch& scratch) {
  scratch.set(model, parameters, state);
  auto& [c, now, touching, components] = scratch;
  const BendTwistEnergy turned = bend_twist_energy(model, now.elastic, c);
  return stretch_energy(model, now.elastic, c) + turned.bend + turned.twist +
         stored_energy(model, now.numbers, state.q, c);
}

Energy energy_of(const Model& model, const Parameters& parameters, const Contact* contact, const State& state,
                 const Ledger& ledger, EnergyScratch& scratch) {
  scratch.set(model, parameters, state);
  auto& [c, coefficients, touching, components] = scratch;
  Energy e = mechanical_energy(model, coefficients, c, state);
  e.loads = -ledger.load_work;
  if (contact) e.contact = contact->energy_of(state, parameters, touching);
  e.total = e.kinetic + e.stretch + e.bend + e.twist + e.gravity + e.loads + e.contact + e.spring;
  e.work = ledger.support_work + ledger.actuation_work;
  e.dissipated = ledger.dissipated;
  return e;
}

Energy rod_energy(const Model& model, const Parameters& parameters, const State& state, int rod,
                  EnergyScratch& scratch) {
  scratch.set(model, parameters, state);
  auto& [c, coefficients, touching, components] = scratch;
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

void find_component_energies(const Model& model, const Parameters& parameters, const State& state,
                             EnergyScratch& scratch) {
  scratch.set(model, parameters, state);
  auto& [c, k, touching, out] = scratch;
  const MassMatrix& mass = k.mass;
  const VectorX& v = state.v;
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
  for_each_stored(model, k.numbers, state.q, c,
                  [&](int node, double stored) { out.elastic[model.component_of_node(node)] += stored; });
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

double touching_energy(const Model& model, const Parameters& parameters, const Contact& contact, const State& state,
                       EnergyScratch& scratch) {
  find_component_energies(model, parameters, state, scratch);
  const ComponentEnergies& energies = scratch.components;
  double sum = 0.0, mass = 0.0, travelling = 0.0;
  Vector3 momentum = Vector3::Zero();
  const auto [which, obstacles] = contact.touching_components();
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

}  // namespace withe
