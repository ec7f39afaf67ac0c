#include "integrators/equations.hpp"

#include <algorithm>
#include <cmath>

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

std::vector<std::string> asymmetries_of(const Loads& loads, const Contact* contact, const SceneDescription& scene,
                                        const Options& options) {
  const FluidModel fluid = scene.fluid.model;
  std::vector<std::string> found;
  if (scene.custom_implicit || (scene.has_custom_force && options.integrator == Integrator::statics))
    found.emplace_back("custom forces that are solved for");
  if (loads.unsymmetric) found.emplace_back("follower loads or moments in 3D");
  if (options.integrator == Integrator::energy_momentum) found.emplace_back("energy-momentum steps");
  const bool rods_touch = contact != nullptr && !contact->surfaces().edges().empty();
  if (options.integrator == Integrator::implicit_midpoint && rods_touch && !contact->frictional())
    found.emplace_back("contact of rods in midpoint steps");
  if (contact != nullptr && contact->unsymmetric()) found.emplace_back("implicit friction");
  if (fluid == FluidModel::resistive && options.integrator != Integrator::statics)
    found.emplace_back("resistive-force theory");
  return found;
}

std::unique_ptr<Contact> make_contact(const Model& model) {
  return model.description.contact.any() ? std::make_unique<Contact>(model) : nullptr;
}

}  // namespace

void set_gravity_force(const Model& model, const Parameters& p, VectorX& force) {
  force.setZero(model.dof_count);
  for (int i = 0; i < model.node_count; ++i) {
    const int dof = model.node_dof[at(i)];
    if (model.planar())
      force.segment<2>(dof) =
          p.node_mass(i) * Vector2(p.gravity.dot(model.plane->first), p.gravity.dot(model.plane->second));
    else
      force.segment<3>(dof) = p.node_mass(i) * p.gravity;
  }
}

Equations::Equations(const Model& model, const Options& options)
    : model_(model),
      loads_(resolve_loads(model)),
      contact_(make_contact(model)),
      asymmetries_(asymmetries_of(loads_, contact_.get(), model.description, options)),
      assembler_(model, loads_, asymmetries_.empty() ? Symmetry::symmetric : Symmetry::unsymmetric, options.solver),
      static_duration_(options.time_step),
      explicit_(options.integrator == Integrator::verlet) {
  if (contact_) {
    contact_rows_.set(contact_->surfaces(), contact_->near());
    assembler_.couple(contact_rows_.unknowns(), kContactUnknowns);
    ordered_ = contact_rows_.keys();
    if (contact_->frictional()) has_potential_ = false;
  }
  custom_force = VectorX::Zero(model.dof_count);
  inverse_rest_ = model.edge_length.cwiseInverse();
  if (model.description.has_custom_force) has_potential_ = false;
  for (const LoadPiece& piece : loads_.pieces)
    if (!withe::has_potential(model, piece)) has_potential_ = false;
  if (options.integrator == Integrator::statics) return;
  const FluidModel fluid = model.description.fluid.model;
  if (fluid == FluidModel::stokeslets) fluid_ = std::make_unique<StokesletFluid>(model);
  if (fluid == FluidModel::resistive) find_resistance();
}

void Equations::set_parameters(const Parameters& parameters) {
  parameters_ = &parameters;
  if (version_ == parameters.version) return;
  version_ = parameters.version;
  set_mass(model_, parameters, mass_);
  set_gravity_force(model_, parameters, gravity_);
  set_elastic(parameters, elastic);
  set_drag(model_, parameters, drag_);
  drag_force_.setZero(model_.dof_count);
}

void Equations::begin(const State& state, const Parameters& parameters, double h, bool energy_momentum, Inner inner) {
  state_ = &state;
  h_ = h;
  inner_ = inner;
  energy_momentum_ = energy_momentum;
  set_parameters(parameters);
  const bool viscous = parameters.viscous && h != 0.0;
  if (viscous || energy_momentum) compute_configuration(model_, state, state.q, start_);
  if (viscous) {
    set_viscous(model_, parameters, start_, h, viscous_);
    if (!energy_momentum) add_viscosity();
  }
  acting_ = viscous && !energy_momentum ? &total_ : &elastic;
  floor_current_ = false;
  flowing_ = false;
  if (!contact_) return;
  const Pressing pressing = energy_momentum          ? Pressing::mean_direction
                            : inner == Inner::middle ? Pressing::mean
                            : h != 0.0 && !explicit_ ? Pressing::end
                                                     : Pressing::still;
  contact_->begin(state, parameters, h == 0.0 ? static_duration_ : inner == Inner::middle ? 2.0 * h : h, pressing);
}

void Equations::add_viscosity() {
  total_ = elastic;
  add_coefficients(viscous_, total_);
}

/// Rates of strain of a step under the midpoint rules, from its ends. The Jacobian takes those of its middle instead.
void Equations::set_strain_rates() {
  refer_viscous_to_ends(model_, start_, middle_, end_, viscous_);
  if (!energy_momentum_) add_viscosity();
}

void Equations::evaluate(const VectorX& z, bool with_matrix, const double* axial_force, Evaluation& out,
                         const ContactLinearisation& contact) {
  out.potential = 0.0;
  gradient_.setZero(model_.dof_count + kPadding);
  magnitude_.setZero(model_.dof_count + kPadding);
  last_z_ = z;
  if (with_matrix) pass_mark();
  if (respond) ask_custom(z, with_matrix);
  if (contact_) find_contacts(z, with_matrix);
  const std::span<double> values = assembler_.solver().values();
  if (with_matrix) std::fill(values.begin(), values.end(), 0.0);
  compute_configuration(model_, *state_, z, middle_);
  if (!floor_current_) set_floor(z, floor_);
  floor_current_ = true;
  const bool viscous = h_ != 0.0 && inner_ == Inner::middle && parameters_->viscous;
  if (energy_momentum_ || viscous) {
    end_q_ = 2.0 * z - state_->q;
    compute_configuration(model_, *state_, end_q_, end_);
  }
  if (viscous) set_strain_rates();
  if (energy_momentum_) {
    difference_ = 2.0 * (z - state_->q);
    add_discrete_gradient(z, with_matrix, axial_force, out);
  } else {
    add_elastic(*acting_, z, with_matrix, axial_force, out);
  }
  add_loads(z, with_matrix, out);
  if (respond && with_matrix) add_custom_matrix(z);
  if (!resistance_.empty() && h_ != 0.0) add_resistance(z, with_matrix);
  if (contact_) add_contacts(with_matrix, contact, out);
  if (h_ != 0.0 && inner_ == Inner::end && !model_.planar()) add_spin_couple(z);
  add_step(z, with_matrix, out);
  assembler_.project(out.residual);
  if (with_matrix) assembler_.project_matrix();
}

void Equations::add_loads(const VectorX& z, bool with_matrix, Evaluation& out) {
  Local local;
  for (std::size_t k = 0; k < loads_.pieces.size(); ++k) {
    const bool dead = loads_.pieces[k].shape == LoadShape::dead_node;
    load_local(model_, *state_, z, middle_, loads_, loads_.pieces[k], local);
    assembler_.loads[k].add_gradient(0, local.gradient, 1.0, gradient_, magnitude_);
    if (with_matrix && !dead) assembler_.loads[k].add_hessian(0, local.hessian, 1.0, assembler_.solver().values());
    const int* dofs = assembler_.loads[k].dofs(0);
    if (dead)
      for (int i = 0; i < model_.dimension; ++i) out.potential += local.gradient[i] * z(dofs[i]);
    else
      out.potential += local.energy;
  }
}

/// Inertia, drag, gravity and custom forces, and what rounding leaves, in one pass over the unknowns.
void Equations::add_step(const VectorX& z, bool with_matrix, Evaluation& out) {
  const int n = model_.dof_count;
  out.full_residual.resize(n);
  out.magnitude.resize(n);
  out.floor.resize(n);
  const double inverse = h_ != 0.0 ? 1.0 / h_ : 0.0;
  const auto x = z.array(), q0 = state_->q.array(), v0 = state_->v.array();
  acceleration_ = (inverse * (inverse * (x - q0) - v0)).matrix();
  if (h_ != 0.0 && held_acceleration.size() != 0) {
    assembler_.project(acceleration_);
    assembler_.add_held_part(held_acceleration, 1.0, acceleration_);
  }
  multiply(model_, mass_, acceleration_, inertia_);
  if (h_ != 0.0 && inner_ == Inner::middle) set_turning_inertia(z);
  const auto inertia = inertia_.array();
  if (parameters_->dragged) {
    mean_velocity_ = inverse * (z - state_->q);
    multiply(model_, drag_, mean_velocity_, drag_force_);
  }
  const auto drag = drag_force_.array();
  out.full_residual = (gradient_.head(n).array() + inertia + drag - gravity_.array() - custom_force.array()).matrix();
  out.magnitude =
      (magnitude_.head(n).array() + inertia.abs() + drag.abs() + gravity_.array().abs() + custom_force.array().abs())
          .matrix();
  if (flowing_) add_flow(z, with_matrix, out);
  out.floor = floor_ + rounding_ * out.magnitude;
  if (contact_) out.floor += contact_floor_;
  out.potential -= gravity_.dot(z);
  out.residual = out.full_residual;
  if (with_matrix && h_ != 0.0) {
    const std::span<double> values = assembler_.solver().values();
    const std::vector<std::ptrdiff_t>& diagonal = assembler_.diagonal_offsets();
    for (int i = 0; i < n; ++i)
      values[static_cast<std::size_t>(diagonal[at(i)])] += (mass_.rows[i] * inverse + drag_.rows[i]) * inverse;
    add_coupling(mass_.coupling, inverse * inverse, values);
    if (parameters_->dragged) add_coupling(drag_.coupling, inverse, values);
  }
  // An axial strain rounds along its edge only.
  const bool planar = model_.planar();
  for (int e = 0; e < model_.edge_count; ++e) {
    const Vec3d& t = middle_.edge[at(e)].tangent;
    const double part[3] = {axial_floor_[e] * std::abs(t.x), axial_floor_[e] * std::abs(t.y),
                            planar ? 0.0 : axial_floor_[e] * std::abs(t.z)};
    double *tail = &out.floor[model_.tail_dof[at(e)]], *head = &out.floor[model_.head_dof[at(e)]];
    for (int i = 0; i < (planar ? 2 : 3); ++i) {
      tail[i] += part[i];
      head[i] += part[i];
    }
  }
}

/// A matrix such as that of masses off the diagonal, and what that takes from it.
void Equations::add_coupling(const VectorX& all, double factor, std::span<double> values) {
  const auto size = static_cast<std::size_t>(model_.dimension);
  for (int e = 0; e < model_.edge_count; ++e) {
    const double coupling = factor * all[e];
    const std::ptrdiff_t* entry = assembler_.edge_couplings.data() + at(e) * 4 * size;
    for (std::size_t i = 0; i < size; ++i, entry += 4) {
      values[static_cast<std::size_t>(entry[0])] -= coupling;
      values[static_cast<std::size_t>(entry[1])] -= coupling;
      values[static_cast<std::size_t>(entry[2])] += coupling;
      if (entry[3] >= 0) values[static_cast<std::size_t>(entry[3])] += coupling;
    }
  }
}

/// Axial forces of all edges and their energy.
void Equations::set_axial_forces(const ElasticCoefficients& k, Evaluation& out) {
  const int n = model_.edge_count;
  force_.resize(n);
  modulus_.resize(n);
  double energy = 0.0;
  for (int e = 0; e < n; ++e) {
    const double strain = middle_.length[e] * inverse_rest_[e] - 1.0 - k.stretch_natural[e];
    force_[e] = k.stretch_stiffness[e] * strain;
    modulus_[e] = k.stretch_stiffness[e] * inverse_rest_[e];
    energy += force_[e] * strain * model_.edge_length[e];
  }
  out.potential += 0.5 * energy;
}

StencilBatch Equations::regular_batch(const ElasticCoefficients& k, const double* axial_force, double* values) {
  const RegularStencils& regular = assembler_.regular;
  return {.count = static_cast<int>(regular.stencil.size()),
          .stencil = regular.stencil.data(),
          .first_unknown = regular.first_unknown.data(),
          .edges = regular.edges.data(),
          .owned = regular.owned.data(),
          .lines = regular.lines.data(),
          .lower = symmetric(),
          .by_rows = regular.by_rows,
          .measure = k.measure,
          .frames = &middle_.edge.data()->tangent.x,
          .strain = middle_.bend_strain.data(),
          .natural = k.bend_natural.data(),
          .stiffness = k.bend_stiffness.data(),
          .column = middle_.bend_strain.rows(),
          .force = force_.data(),
          .geometric = axial_force ? axial_force : force_.data(),
          .modulus = modulus_.data(),
          .residual = gradient_.data(),
          .magnitude = magnitude_.data(),
          .values = values,
          .velocity = nullptr,
          .edge_inertia = nullptr};
}

void Equations::add_elastic(const ElasticCoefficients& k, const VectorX& z, bool with_matrix, const double* axial_force,
                            Evaluation& out) {
  const std::span<double> values = assembler_.solver().values();
  set_axial_forces(k, out);
  const StencilBatch batch = regular_batch(k, axial_force, with_matrix ? values.data() : nullptr);
  out.potential += model_.planar() ? stencil_kernels().planar_bend(batch) : stencil_kernels().bend(batch);
  add_other_elastic(k, z, with_matrix, axial_force, out);
}

/// What the kernels do not take: edges and stencils of joints and of rods' ends at walls.
void Equations::add_other_elastic(const ElasticCoefficients& k, const VectorX& z, bool with_matrix,
                                  const double* axial_force, Evaluation& out) {
  const std::span<double> values = assembler_.solver().values();
  Local local;
  const auto add = [&](const ElementTable& table, int i) {
    table.add_gradient(i, local.gradient, 1.0, gradient_, magnitude_);
    if (with_matrix) table.add_hessian(i, local.hessian, 1.0, values);
  };
  for (int e : assembler_.regular.other_edges) {
    stretch_local(model_, k, middle_, e, with_matrix, axial_force, local);
    add(assembler_.stretch, e);
  }
  for (int b : assembler_.regular.other_bend) {
    bend_local(model_, k, middle_, b, with_matrix, local);
    out.potential += local.energy;
    add(assembler_.bend, b);
  }
  for (int h = 0; h < static_cast<int>(model_.half.size()); ++h) {
    half_local(model_, z, k, middle_, h, with_matrix, local);
    out.potential += local.energy;
    add(assembler_.half, h);
  }
}

void Equations::predict_axial_force(const VectorX& step, VectorX& out) const {
  const ElasticCoefficients& k = *acting_;
  out.resize(model_.edge_count);
  for (int e = 0; e < model_.edge_count; ++e) {
    const int a = model_.node_dof[at(model_.edge_tail[at(e)])], b = model_.node_dof[at(model_.edge_head[at(e)])];
    const Vec3d& tangent = (energy_momentum_ ? end_ : middle_).edge[at(e)].tangent;
    const double t[3] = {tangent.x, tangent.y, tangent.z};
    double length = energy_momentum_ ? 0.5 * (start_.length(e) + end_.length(e)) : middle_.length(e);
    for (int i = 0; i < model_.dimension; ++i) length += t[i] * (step(b + i) - step(a + i));
    out(e) = k.stretch_stiffness(e) * (length / model_.edge_length(e) - 1.0 - k.stretch_natural(e));
  }
}

double Equations::advance(const State& state, const VectorX& q, State& next) {
  if (!model_.planar()) return std::acos(std::min(advance_configuration(model_, state, q, middle_, next), 1.0));
  compute_configuration(model_, state, q, middle_);
  next.q = q;
  return 0.0;
}

void Equations::evaluate_forces(const State& state, const Parameters& parameters, const VectorX& v, Evaluation& out) {
  set_parameters(parameters);
  state_ = &state;
  h_ = 0.0;
  energy_momentum_ = floor_current_ = false;
  acting_ = &elastic;
  last_z_ = state.q;
  out.potential = 0.0;
  const int n = model_.dof_count;
  gradient_.setZero(n + kPadding);
  magnitude_.setZero(n + kPadding);
  set_axial_forces(elastic, out);
  StencilBatch batch = regular_batch(elastic, nullptr, nullptr);
  if (model_.planar()) {
    stencil_kernels().planar_bend_forces(batch);
  } else {
    batch.velocity = v.data();
    batch.edge_inertia = parameters.edge_inertia.data();
    stencil_kernels().bend_forces(batch);
    for (int e : assembler_.regular.other_edges) {
      const int a = model_.tail_dof[at(e)], b = model_.head_dof[at(e)];
      const Vec3d rate{v[b] - v[a], v[b + 1] - v[a + 1], v[b + 2] - v[a + 2]};
      add_couple(e, spin_couple(e, v[model_.edge_dof[at(e)]], rate));
    }
  }
  add_other_elastic(elastic, state.q, false, nullptr, out);
  add_loads(state.q, false, out);
  out.full_residual = gradient_.head(n) - gravity_ - custom_force;
}

double Equations::dissipated(const VectorX& change) const {
  double work = drag_force_.dot(change) + flow_loss(change);
  if (!parameters_->viscous || h_ == 0.0) return work;
  Local local;
  const auto add = [&](const ElementTable& table, int i) {
    const int* dofs = table.dofs(i);
    for (int k = 0; k < table.width(); ++k)
      if (dofs[k] >= 0) work += local.gradient[k] * change[dofs[k]];
  };
  for (int e = 0; e < model_.edge_count; ++e) {
    stretch_local(model_, viscous_, middle_, e, false, nullptr, local);
    add(assembler_.stretch, e);
  }
  for (int b = 0; b < static_cast<int>(model_.bend.size()); ++b) {
    bend_local(model_, viscous_, middle_, b, false, local);
    add(assembler_.bend, b);
  }
  for (int h = 0; h < static_cast<int>(model_.half.size()); ++h) {
    half_local(model_, last_z_, viscous_, middle_, h, false, local);
    add(assembler_.half, h);
  }
  return work;
}

void Equations::load_force(VectorX& out) const {
  out = custom_force;
  Local local;
  for (std::size_t k = 0; k < loads_.pieces.size(); ++k) {
    load_local(model_, *state_, last_z_, middle_, loads_, loads_.pieces[k], local);
    const ElementTable& table = assembler_.loads[k];
    const int* dofs = table.dofs(0);
    for (int i = 0; i < table.width(); ++i)
      if (dofs[i] >= 0) out[dofs[i]] -= local.gradient[i];
  }
}

double Equations::load_work(const VectorX& change) const {
  load_force(load_force_);
  return load_force_.dot(change);
}

}  // namespace withe
