#include "integrators/equations.hpp"

#include <cmath>
#include <limits>

#include "geometry/rotation.hpp"

namespace withe {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

std::size_t at(int i) { return static_cast<std::size_t>(i); }

Symmetry symmetry_of(const Loads& loads, const Options& options) {
  return loads.unsymmetric || options.integrator == Integrator::energy_momentum ? Symmetry::unsymmetric
                                                                                : Symmetry::symmetric;
}

}  // namespace

VectorX mass_vector(const Model& model, const Parameters& p) {
  VectorX mass = VectorX::Zero(model.dof_count);
  for (int i = 0; i < model.node_count; ++i)
    mass.segment(model.node_dof[at(i)], model.dimension).setConstant(p.node_mass(i));
  for (int f = 0; f < model.frame_count; ++f)
    mass.segment(model.frame_dof[at(f)], model.frame_size()).setConstant(p.frame_inertia(f));
  for (std::size_t h = 0; h < model.hinges.size(); ++h)
    mass(model.hinges[h].dof) = p.hinge_inertia(static_cast<Eigen::Index>(h));
  if (!model.planar())
    for (int e = 0; e < model.edge_count; ++e) mass(model.edge_dof[at(e)]) = p.edge_inertia(e);
  return mass;
}

VectorX gravity_force(const Model& model, const Parameters& p) {
  VectorX force = VectorX::Zero(model.dof_count);
  for (int i = 0; i < model.node_count; ++i) {
    const int dof = model.node_dof[at(i)];
    if (model.planar())
      force.segment<2>(dof) =
          p.node_mass(i) * Vector2(p.gravity.dot(model.plane->first), p.gravity.dot(model.plane->second));
    else
      force.segment<3>(dof) = p.node_mass(i) * p.gravity;
  }
  return force;
}

Equations::Equations(const Model& model, const Options& options)
    : model_(model),
      loads_(resolve_loads(model)),
      assembler_(model, loads_, symmetry_of(loads_, options), options.solver) {
  custom_force = VectorX::Zero(model.dof_count);
  inverse_rest_ = model.edge_length.cwiseInverse();
  node_dof_drag_ = VectorX::Zero(model.dof_count);
  for (const LoadPiece& piece : loads_.pieces)
    if (piece.shape != LoadShape::dead_node) has_potential_ = false;
}

void Equations::set_parameters(const Parameters& parameters) {
  parameters_ = &parameters;
  if (version_ == parameters.version) return;
  version_ = parameters.version;
  mass = mass_vector(model_, parameters);
  gravity_ = gravity_force(model_, parameters);
  set_elastic(parameters, elastic);
  for (int i = 0; i < model_.node_count; ++i)
    node_dof_drag_.segment(model_.node_dof[at(i)], model_.dimension).setConstant(parameters.node_drag(i));
}

void Equations::begin(const State& state, const Parameters& parameters, double h, bool energy_momentum) {
  state_ = &state;
  h_ = h;
  energy_momentum_ = energy_momentum;
  set_parameters(parameters);
  const bool viscous = parameters.viscous && h != 0.0;
  if (viscous || energy_momentum) compute_configuration(model_, state, state.q, start_);
  if (viscous) {
    set_viscous(model_, parameters, start_, h, viscous_);
    if (!energy_momentum) {
      total_ = elastic;
      add_coefficients(viscous_, total_);
    }
  }
  acting_ = viscous && !energy_momentum ? &total_ : &elastic;
  floor_current_ = false;
}

void Equations::evaluate(const VectorX& z, bool with_matrix, const double* axial_force, Evaluation& out) {
  out.potential = 0.0;
  gradient_.setZero(model_.dof_count + kPadding);
  magnitude_.setZero(model_.dof_count + kPadding);
  last_z_ = z;
  const std::span<double> values = assembler_.solver().values();
  if (with_matrix) std::fill(values.begin(), values.end(), 0.0);
  compute_configuration(model_, *state_, z, middle_);
  if (energy_momentum_) {
    difference_ = 2.0 * (z - state_->q);
    end_q_ = 2.0 * z - state_->q;
    compute_configuration(model_, *state_, end_q_, end_);
    add_discrete_gradient(z, with_matrix, axial_force, out);
  } else {
    add_elastic(*acting_, z, with_matrix, axial_force, out);
  }
  add_loads(z, with_matrix, out);
  if (h_ != 0.0 && !model_.planar()) add_spin_couple(z);
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
  }
}

/// Inertia, drag, gravity and custom forces, and what rounding leaves, in one pass over the unknowns.
void Equations::add_step(const VectorX& z, bool with_matrix, Evaluation& out) {
  const int n = model_.dof_count;
  if (!floor_current_) set_floor(z, floor_);
  floor_current_ = true;
  out.full_residual.resize(n);
  out.magnitude.resize(n);
  out.floor.resize(n);
  const double inverse = h_ != 0.0 ? 1.0 / h_ : 0.0;
  const auto x = z.array(), q0 = state_->q.array(), v0 = state_->v.array();
  const auto inertia = (inverse * mass.array()) * (inverse * (x - q0) - v0);
  const auto drag = (inverse * node_dof_drag_.array()) * (x - q0);
  out.full_residual = (gradient_.head(n).array() + inertia + drag - gravity_.array() - custom_force.array()).matrix();
  out.magnitude =
      (magnitude_.head(n).array() + inertia.abs() + drag.abs() + gravity_.array().abs() + custom_force.array().abs())
          .matrix();
  out.floor = floor_ + rounding_ * out.magnitude;
  out.potential -= gravity_.dot(z);
  out.residual = out.full_residual;
  if (with_matrix && h_ != 0.0) {
    const std::span<double> values = assembler_.solver().values();
    const std::vector<std::ptrdiff_t>& diagonal = assembler_.diagonal_offsets();
    for (int i = 0; i < n; ++i)
      values[static_cast<std::size_t>(diagonal[at(i)])] += (mass[i] * inverse + node_dof_drag_[i]) * inverse;
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
          .values = values};
}

void Equations::add_elastic(const ElasticCoefficients& k, const VectorX& z, bool with_matrix, const double* axial_force,
                            Evaluation& out) {
  const std::span<double> values = assembler_.solver().values();
  set_axial_forces(k, out);
  const StencilBatch batch = regular_batch(k, axial_force, with_matrix ? values.data() : nullptr);
  out.potential += model_.planar() ? stencil_kernels().planar_bend(batch) : stencil_kernels().bend(batch);

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

/// Gonzalez's correction with G = `metric` and u = G D: adds r u / (u . D) to the gradient and its derivative with
/// respect to z to the Hessian.
void Equations::correct(Local& local, const Local& end, double start_energy, const ElementTable& table, int element,
                        const double (*metric)[kMaxLocal]) {
  const int n = table.width();
  double D[kMaxLocal], u[kMaxLocal] = {}, HD[kMaxLocal] = {};
  gather_difference(table, element, D);
  double s = 0.0, r = end.energy - start_energy;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      u[i] += metric[i][j] * D[j];
      HD[i] += local.hessian[i][j] * D[j];
    }
    s += u[i] * D[i];
    r -= local.gradient[i] * D[i];
  }
  if (!(s > 1e-24)) return;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      local.hessian[i][j] += u[i] * (2.0 * (end.gradient[j] - local.gradient[j]) - HD[j]) / s +
                             2.0 * r * (metric[i][j] / s - 2.0 * u[i] * u[j] / (s * s));
  for (int i = 0; i < n; ++i) local.gradient[i] += r * u[i] / s;
}

/// The same in a plane with the quadratic invariants of the stencil (e0 . e0, e0 . e1, e1 . e1, e0 x e1), whose
/// derivatives at the middle times D are exactly their changes: it conserves angular momentum too.
void Equations::add_planar_invariants(int stencil, Local& local, const Local& end, double start_energy) const {
  constexpr int n = 6;
  double D[kMaxLocal], zm[n];
  gather_difference(assembler_.bend, stencil, D);
  const int* dofs = assembler_.bend.dofs(stencil);
  for (int i = 0; i < n; ++i) zm[i] = last_z_(dofs[i]);
  // Edges as linear maps of the six unknowns.
  const double e0[2] = {zm[2] - zm[0], zm[3] - zm[1]}, e1[2] = {zm[4] - zm[2], zm[5] - zm[3]};
  const double d0[2] = {D[2] - D[0], D[3] - D[1]}, d1[2] = {D[4] - D[2], D[5] - D[3]};
  // Gradients in (e0, e1); each invariant is bilinear with matrix B: value = e^T B e / 2, gradient B e.
  static constexpr double B[4][4][4] = {{{2, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}},
                                        {{0, 0, 1, 0}, {0, 0, 0, 1}, {1, 0, 0, 0}, {0, 1, 0, 0}},
                                        {{0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 2, 0}, {0, 0, 0, 2}},
                                        {{0, 0, 0, 1}, {0, 0, -1, 0}, {0, -1, 0, 0}, {1, 0, 0, 0}}};
  const double e[4] = {e0[0], e0[1], e1[0], e1[1]}, d[4] = {d0[0], d0[1], d1[0], d1[1]};
  double change[4] = {}, gradient[4][4] = {}, s = 0.0;
  for (int k = 0; k < 4; ++k) {
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) gradient[k][i] += B[k][i][j] * e[j];
    for (int i = 0; i < 4; ++i) change[k] += gradient[k][i] * d[i];
    s += change[k] * change[k];
  }
  const double length4 = (e[0] * e[0] + e[1] * e[1]) * (e[2] * e[2] + e[3] * e[3]);
  if (!(s > 1e-26 * length4)) return;
  double r = end.energy - start_energy, HD[n] = {};
  for (int i = 0; i < n; ++i) {
    r -= local.gradient[i] * D[i];
    for (int j = 0; j < n; ++j) HD[i] += local.hessian[i][j] * D[j];
  }
  // With respect to z: u = sum g_k c_k, du = sum c_k B_k + g_k (dc_k)^T, dc_k = 2 B_k e1 (q1), ds = 2 sum c_k dc_k.
  double u[4] = {}, du[4][4] = {}, ds[4] = {};
  for (int k = 0; k < 4; ++k) {
    double dc[4] = {};
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) dc[i] += B[k][i][j] * (2.0 * e[j] + d[j]);
    for (int i = 0; i < 4; ++i) {
      u[i] += gradient[k][i] * change[k];
      ds[i] += 2.0 * change[k] * dc[i];
      for (int j = 0; j < 4; ++j) du[i][j] += change[k] * B[k][i][j] + gradient[k][i] * dc[j];
    }
  }
  // From edges to nodes: node rows of e0 are (-1, +1, 0), of e1 (0, -1, +1).
  const auto spread = [](const double* edge, double* node) {
    node[0] = -edge[0], node[1] = -edge[1];
    node[2] = edge[0] - edge[2], node[3] = edge[1] - edge[3];
    node[4] = edge[2], node[5] = edge[3];
  };
  double un[n], dsn[n], half[4][n], dun[n][n];
  spread(u, un);
  spread(ds, dsn);
  for (int i = 0; i < 4; ++i) spread(du[i], half[i]);
  for (int j = 0; j < n; ++j) {
    const double column[4] = {half[0][j], half[1][j], half[2][j], half[3][j]};
    double full[n];
    spread(column, full);
    for (int i = 0; i < n; ++i) dun[i][j] = full[i];
  }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      local.hessian[i][j] += un[i] * (2.0 * (end.gradient[j] - local.gradient[j]) - HD[j]) / s +
                             r * (dun[i][j] / s - un[i] * dsn[j] / (s * s));
  for (int i = 0; i < n; ++i) local.gradient[i] += r * un[i] / s;
}

void Equations::gather_difference(const ElementTable& table, int element, double* difference) const {
  const int* dofs = table.dofs(element);
  for (int i = 0; i < table.width(); ++i) difference[i] = dofs[i] < 0 ? 0.0 : difference_(dofs[i]);
}

void Equations::add_discrete_gradient(const VectorX& z, bool with_matrix, const double* axial_force, Evaluation& out) {
  const std::span<double> values = assembler_.solver().values();
  Local local, end;
  const auto add = [&](const ElementTable& table, int i) {
    table.add_gradient(i, local.gradient, 1.0, gradient_, magnitude_);
    if (with_matrix) table.add_hessian(i, local.hessian, 1.0, values);
  };
  const int dim = model_.dimension;
  for (int e = 0; e < model_.edge_count; ++e) {
    const double rest = model_.edge_length(e), EA = elastic.stretch_stiffness(e);
    const double l0 = start_.length(e), l1 = end_.length(e), sum = l0 + l1;
    const double force = EA * (0.5 * sum / rest - 1.0), geometric = axial_force ? axial_force[e] : force;
    const int* dofs = assembler_.stretch.dofs(e);
    double mean[3];
    for (int i = 0; i < dim; ++i) mean[i] = 2.0 * (z(dofs[dim + i]) - z(dofs[i])) / sum;
    const Vec3d& t1 = end_.edge[at(e)].tangent;
    const double t[3] = {t1.x, t1.y, t1.z};
    for (int i = 0; i < dim; ++i) {
      local.gradient[i] = -force * mean[i];
      local.gradient[dim + i] = force * mean[i];
      for (int j = 0; j < dim; ++j) {
        const double h = mean[i] * t[j] * (EA / rest - 2.0 * geometric / sum) + (i == j ? 2.0 * geometric / sum : 0.0);
        local.hessian[i][j] = local.hessian[dim + i][dim + j] = h;
        local.hessian[i][dim + j] = local.hessian[dim + i][j] = -h;
      }
    }
    add(assembler_.stretch, e);
  }
  double metric[kMaxLocal][kMaxLocal] = {};
  const auto clear = [&] {
    for (auto& row : metric)
      for (double& m : row) m = 0.0;
  };
  const auto couple = [&](int a, int b, double weight) {
    for (int i = 0; i < dim; ++i) {
      metric[a + i][a + i] += weight;
      metric[b + i][b + i] += weight;
      metric[a + i][b + i] -= weight;
      metric[b + i][a + i] -= weight;
    }
  };
  for (int b = 0; b < static_cast<int>(model_.bend.size()); ++b) {
    bend_local(model_, elastic, middle_, b, true, local);
    bend_local(model_, elastic, end_, b, false, end);
    const BendTwistEnergy before = bend_energy_of(elastic, start_, b);
    if (model_.planar()) {
      add_planar_invariants(b, local, end, before.bend + before.twist);
    } else {
      const BendStencil& s = model_.bend[at(b)];
      clear();
      couple(0, 4, 1.0 / std::pow(model_.edge_length(s.edge[0]), 2));
      couple(4, 8, 1.0 / std::pow(model_.edge_length(s.edge[1]), 2));
      metric[3][3] = metric[7][7] = 1.0;
      correct(local, end, before.bend + before.twist, assembler_.bend, b, metric);
    }
    add(assembler_.bend, b);
  }
  for (int h = 0; h < static_cast<int>(model_.half.size()); ++h) {
    half_local(model_, z, elastic, middle_, h, true, local);
    half_local(model_, end_q_, elastic, end_, h, false, end);
    const BendTwistEnergy before = half_energy_of(elastic, start_, h);
    const double weight = 1.0 / std::pow(model_.edge_length(model_.half[at(h)].edge), 2);
    clear();
    couple(0, dim == 2 ? 2 : 4, weight);
    if (dim == 2)
      metric[4][4] = 1.0;
    else
      for (int i : {3, 7, 8, 9, 10}) metric[i][i] = 1.0;
    correct(local, end, before.bend + before.twist, assembler_.half, h, metric);
    add(assembler_.half, h);
  }
  if (!parameters_->viscous || h_ == 0.0) return;
  add_elastic(viscous_, z, with_matrix, nullptr, out);
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

/// An edge that spins at omega and turns also needs the couple I omega t x dt/dt: nodal forces
/// +- I omega (dt/dt x t) / l, which do no work. Its Jacobian is left out: it is a small part of the mass term.
void Equations::add_spin_couple(const VectorX& z) {
  const double inverse = 1.0 / h_;
  const double *q0 = state_->q.data(), *v0 = state_->v.data();
  for (int e = 0; e < model_.edge_count; ++e) {
    const int a = model_.tail_dof[at(e)], b = model_.head_dof[at(e)], angle = model_.edge_dof[at(e)];
    const double omega = (z[angle] - q0[angle]) * inverse, inertia = parameters_->edge_inertia[e];
    const EdgeFrame<double>& f = middle_.edge[at(e)];
    const Vec3d change{z[b] - z[a] - q0[b] + q0[a], z[b + 1] - z[a + 1] - q0[b + 1] + q0[a + 1],
                       z[b + 2] - z[a + 2] - q0[b + 2] + q0[a + 2]};
    const double couple = inertia * omega * f.inverse_length * f.inverse_length * inverse;
    // psi = theta + spin . e is what turns: the edge's inertia acts on the nodes as its elastic torque does. It does no
    // work either, since spin is normal to the edge before and now.
    const double torque = inertia * (omega - v0[angle]) * inverse;
    const Vec3d total = couple * cross(change, f.tangent) + torque * f.spin;
    const double component[3] = {total.x, total.y, total.z};
    for (int i = 0; i < 3; ++i) {
      gradient_[b + i] += component[i];
      gradient_[a + i] -= component[i];
    }
  }
}

/// Rounding of a strain is about eps |x| / l; its stiffness turns it into a force that no iteration removes.
void Equations::set_floor(const VectorX& z, VectorX& floor) {
  floor.setZero(model_.dof_count);
  double reach = 0.0;
  for (int i = 0; i < model_.node_count; ++i)
    reach = std::max(reach, z.segment(model_.node_dof[at(i)], model_.dimension).cwiseAbs().maxCoeff());
  const auto node_add = [&](int node, double value) {
    const int dof = model_.node_dof[at(node)];
    for (int i = 0; i < model_.dimension; ++i) floor(dof + i) += value;
  };
  const double unit = 4.0 * kEpsilon;
  rounding_ = unit * (reach / model_.edge_length.minCoeff() + 1.0);
  axial_floor_.resize(model_.edge_count);
  for (int e = 0; e < model_.edge_count; ++e)
    axial_floor_(e) = unit * acting_->stretch_stiffness(e) * (reach / model_.edge_length(e) + 1.0);
  const auto bend_add = [&](double stiffness, double length, std::initializer_list<int> nodes,
                            std::initializer_list<int> angles) {
    const double moment = 2.0 * unit * stiffness * (reach / length + 1.0);
    for (int node : nodes) node_add(node, moment / length);
    if (!model_.planar())
      for (int edge : angles) floor(model_.edge_dof[at(edge)]) += moment;
  };
  for (std::size_t b = 0; b < model_.bend.size(); ++b) {
    const BendStencil& s = model_.bend[b];
    bend_add(acting_->bend_stiffness.row(static_cast<Eigen::Index>(b)).maxCoeff(),
             std::min(model_.edge_length(s.edge[0]), model_.edge_length(s.edge[1])), {s.node[0], s.node[1], s.node[2]},
             {s.edge[0], s.edge[1]});
  }
  for (std::size_t h = 0; h < model_.half.size(); ++h) {
    const FrameStencil& s = model_.half[h];
    const double stiffness = acting_->half_stiffness.row(static_cast<Eigen::Index>(h)).maxCoeff();
    const double length = model_.edge_length(s.edge);
    bend_add(stiffness, length, {model_.edge_tail[at(s.edge)], model_.edge_head[at(s.edge)]}, {s.edge});
    const double moment = 2.0 * unit * stiffness * (reach / length + 1.0);
    for (int i = 0; i < model_.frame_size(); ++i) floor(model_.frame_dof[at(s.frame)] + i) += moment;
    if (s.hinge >= 0) floor(model_.hinges[at(s.hinge)].dof) += moment;
  }
  if (h_ != 0.0) floor += (4.0 * kEpsilon * std::max(reach, 1e-300) / (h_ * h_)) * mass;
}

VectorX Equations::dissipative_force() const {
  const double inverse = h_ != 0.0 ? 1.0 / h_ : 0.0;
  VectorX force = -inverse * node_dof_drag_.cwiseProduct(last_z_ - state_->q);
  if (!parameters_->viscous || h_ == 0.0) return force;
  VectorX gradient = VectorX::Zero(model_.dof_count), unused = gradient;
  Local local;
  for (int e = 0; e < model_.edge_count; ++e) {
    stretch_local(model_, viscous_, middle_, e, false, nullptr, local);
    assembler_.stretch.add_gradient(e, local.gradient, 1.0, gradient, unused);
  }
  for (int b = 0; b < static_cast<int>(model_.bend.size()); ++b) {
    bend_local(model_, viscous_, middle_, b, false, local);
    assembler_.bend.add_gradient(b, local.gradient, 1.0, gradient, unused);
  }
  for (int h = 0; h < static_cast<int>(model_.half.size()); ++h) {
    half_local(model_, last_z_, viscous_, middle_, h, false, local);
    assembler_.half.add_gradient(h, local.gradient, 1.0, gradient, unused);
  }
  return force - gradient;
}

VectorX Equations::load_force() const {
  VectorX gradient = VectorX::Zero(model_.dof_count), unused = gradient;
  Local local;
  for (std::size_t k = 0; k < loads_.pieces.size(); ++k) {
    load_local(model_, *state_, last_z_, middle_, loads_, loads_.pieces[k], local);
    assembler_.loads[k].add_gradient(0, local.gradient, 1.0, gradient, unused);
  }
  return custom_force - gradient;
}

}  // namespace withe
