#include "steps/elastic_forces.hpp"

#include <algorithm>
#include <cmath>

#include "elasticity/discrete_elements.hpp"
#include "elasticity/stencil_kernels.hpp"
#include "elasticity/stretch.hpp"
#include "geometry/rotation.hpp"
#include "steps/inertia.hpp"
#include "steps/regular_stencils.hpp"

namespace withe {
namespace {

/// The ordinary stencils, as the kernels need them. The result refers to the data.
StencilBatch regular_batch(const ElasticCoefficients& k, StepData& data, const Assembler& assembler,
                           std::span<double> values, const double* axial_force) {
  StencilBatch batch = kernel_batch(assembler, k.measure, data.configuration, k.bend_natural, k.bend_stiffness);
  batch.lines = assembler.regular.lines.data();
  batch.lower = assembler.solver().symmetry() == Symmetry::symmetric;
  batch.by_rows = assembler.regular.by_rows;
  batch.force = data.force.data();
  batch.geometric = axial_force ? axial_force : data.force.data();
  batch.modulus = data.modulus.data();
  batch.residual = data.gradient.data();
  batch.magnitude = data.row_magnitude.data();
  if (!values.empty()) batch.values = values.data();
  return batch;
}

}  // namespace

const ElasticCoefficients& acting_coefficients(const StepProblem& problem, const StepData& data) {
  if (!problem.viscous_acts()) return problem.elastic;
  return problem.rule == StepRule::midpoint ? data.damped : problem.damped;
}

void ElasticForces::begin(StepProblem& problem) {
  const State& start = *problem.start;
  const bool viscous = problem.viscous_acts();
  if (viscous || problem.conserves_energy())
    compute_configuration(problem.model, start, start.q, problem.start_configuration);
  if (!viscous) return;
  set_viscous(problem.model, *problem.parameters, problem.start_configuration, problem.interval, problem.viscous);
  problem.damped = problem.elastic;
  add_coefficients(problem.viscous, problem.damped);
}

/// Computes configurations and, for a midpoint step, rates of strain from both ends. The Jacobian uses the rates in the
/// middle instead. Discrete gradients need no strains in the middle.
void ElasticForces::find(const StepProblem& problem, StepData& data, Assembler&, bool) {
  const Model& model = problem.model;
  const bool viscous = problem.viscous_acts() && problem.rule == StepRule::midpoint;
  (problem.conserves_energy() ? compute_frames : compute_configuration)(model, *problem.start, data.z,
                                                                        data.configuration);
  if (!problem.conserves_energy() && !viscous) return;
  problem.set_end(data.z, data.end);
  compute_configuration(model, *problem.start, data.end, data.end_configuration);
  if (!viscous) return;
  data.viscous = problem.viscous;
  refer_viscous_to_ends(model, problem.start_configuration, data.configuration, data.end_configuration, data.viscous);
  data.damped = problem.elastic;
  add_coefficients(data.viscous, data.damped);
}

void ElasticForces::add(const StepProblem& problem, StepData& data, const Assembler& assembler,
                        std::span<double> values) const {
  if (problem.conserves_energy())
    add_discrete_gradient(problem, data, assembler, values);
  else
    add_elastic(problem, acting_coefficients(problem, data), data, assembler, values, data.axial_force);
  if (problem.exact && !values.empty() && problem.viscous_acts() && problem.rule == StepRule::midpoint)
    add_rate_slopes(problem, data, assembler, values);
}

/// Axial forces of all edges and their energy.
void ElasticForces::set_axial_forces(const StepProblem& problem, const ElasticCoefficients& k, StepData& data) const {
  const int n = problem.model.edge_count;
  data.force.resize(n);
  data.modulus.resize(n);
  double energy = 0.0;
  for (int e = 0; e < n; ++e) {
    const double strain = data.configuration.length[e] * inverse_rest_[e] - 1.0 - k.stretch_natural[e];
    data.force[e] = k.stretch_stiffness[e] * strain;
    data.modulus[e] = k.stretch_stiffness[e] * inverse_rest_[e];
    energy += data.force[e] * strain * problem.model.edge_length[e];
  }
  data.potential += 0.5 * energy;
}

void ElasticForces::add_elastic(const StepProblem& problem, const ElasticCoefficients& k, StepData& data,
                                const Assembler& assembler, std::span<double> values, const double* axial_force) const {
  set_axial_forces(problem, k, data);
  const StencilBatch batch = regular_batch(k, data, assembler, values, axial_force);
  data.potential += problem.model.planar() ? stencil_kernels().planar_bend(batch) : stencil_kernels().bend(batch);
  add_others(problem, k, data, assembler, values, axial_force);
}

/// Adds elements without kernels: edges, and stencils of joints and of ends of rods at walls.
void ElasticForces::add_others(const StepProblem& problem, const ElasticCoefficients& k, StepData& data,
                               const Assembler& assembler, std::span<double> values, const double* axial_force) const {
  const Model& model = problem.model;
  const bool with_matrix = !values.empty();
  Local local;
  for (int e : assembler.regular.other_edges) {
    stretch_local(model, k, data.configuration, e, with_matrix, axial_force, local);
    add_element(assembler.stretch, e, local, data, values);
  }
  for (int b : assembler.regular.other_bend) {
    bend_local(model, bend_coefficients(k, b), data.configuration, b, with_matrix, local);
    data.potential += local.energy;
    add_element(assembler.bend, b, local, data, values);
  }
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    half_local(model, data.z, half_coefficients(k, h), data.configuration, h, with_matrix, local);
    data.potential += local.energy;
    add_element(assembler.half, h, local, data, values);
  }
}

void ElasticForces::add_explicit(const StepProblem& problem, StepData& data, const Assembler& assembler,
                                 const VectorX& v) const {
  set_axial_forces(problem, problem.elastic, data);
  StencilBatch batch = regular_batch(problem.elastic, data, assembler, {}, nullptr);
  if (problem.model.planar()) {
    stencil_kernels().planar_bend_forces(batch);
  } else {
    batch.velocity = v.data();
    batch.edge_inertia = problem.parameters->edge_inertia.data();
    stencil_kernels().bend_forces(batch);
    for (int e : assembler.regular.other_edges) add_explicit_spin_couple(problem, data, e, v);
  }
  add_others(problem, problem.elastic, data, assembler, {}, nullptr);
}

void ElasticForces::add_rounding(const StepProblem& problem, StepData& data) const {
  const Model& model = problem.model;
  const int size = model.dimension;
  for (int e = 0; e < model.edge_count; ++e) {
    const Vec3d& t = data.configuration.edge[at(e)].tangent;
    const double bound = data.rounding.axial[e];
    const double part[3] = {bound * std::abs(t.x), bound * std::abs(t.y), size == 2 ? 0.0 : bound * std::abs(t.z)};
    double *tail = &data.floor[model.tail_dof[at(e)]], *head = &data.floor[model.head_dof[at(e)]];
    for (int i = 0; i < size; ++i) {
      tail[i] += part[i];
      head[i] += part[i];
    }
  }
}

double ElasticForces::dissipated(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                                 const VectorX& change) const {
  if (!problem.viscous_acts()) return 0.0;
  if (problem.conserves_energy()) return discrete_dissipation(problem, data);
  const Model& model = problem.model;
  const ElasticCoefficients& viscous = problem.in_middle() ? data.viscous : problem.viscous;
  double work = 0.0;
  Local local;
  for (int e = 0; e < model.edge_count; ++e) {
    stretch_local(model, viscous, data.configuration, e, false, nullptr, local);
    work += work_of(assembler.stretch, e, local, change);
  }
  for (int b = 0; b < static_cast<int>(model.bend.size()); ++b) {
    bend_local(model, bend_coefficients(viscous, b), data.configuration, b, false, local);
    work += work_of(assembler.bend, b, local, change);
  }
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    half_local(model, data.z, half_coefficients(viscous, h), data.configuration, h, false, local);
    work += work_of(assembler.half, h, local, change);
  }
  return work;
}

/// Viscosity kv / h (s - s0) acts on the mean strain s of a step, where h is half the length of the step. It therefore
/// acts on half of the change of the strain, and dissipates kv / (2 h) (s1 - s0)^2.
double ElasticForces::discrete_dissipation(const StepProblem& problem, const StepData& data) {
  const Model& model = problem.model;
  const ElasticCoefficients& viscous = problem.viscous;
  const Configuration& end = data.end_configuration;
  const VectorX stretched = (end.length - problem.start_configuration.length).cwiseQuotient(model.edge_length);
  const auto turned = [&](const Columns3& strain, const Columns3& stiffness, const Columns3& start) {
    double sum = 0.0;
    for (Eigen::Index i = 0; i < strain.rows(); ++i)
      sum += (measured(viscous.measure, strain.row(i)) - start.row(i)).cwiseAbs2().dot(stiffness.row(i));
    return sum;
  };
  return 0.5 * (viscous.stretch_stiffness.cwiseProduct(model.edge_length).dot(stretched.cwiseAbs2()) +
                turned(end.bend_strain, viscous.bend_stiffness, viscous.bend_natural) +
                turned(end.half_strain, viscous.half_stiffness, viscous.half_natural));
}

/// Axial forces of the mean strain.
void ElasticForces::set_mean_axial_forces(const StepProblem& problem, StepData& data) const {
  const int n = problem.model.edge_count;
  data.force.resize(n);
  data.modulus.resize(n);
  for (int e = 0; e < n; ++e) {
    const MeanStretch mean = mean_stretch(problem.model, acting_coefficients(problem, data),
                                          problem.start_configuration, data.end_configuration, e);
    data.force[e] = mean.force;
    data.modulus[e] = mean.modulus;
  }
}

/// Forces of the energy-momentum scheme: see elasticity/discrete_elements.hpp.
void ElasticForces::add_discrete_gradient(const StepProblem& problem, StepData& data, const Assembler& assembler,
                                          std::span<double> values) const {
  const Model& model = problem.model;
  const ElasticCoefficients& k = acting_coefficients(problem, data);
  const bool with_matrix = !values.empty();
  data.change = 2.0 * (data.z - problem.start->q);
  const DiscreteStep step = discrete_step(problem, data);
  Local local;
  set_mean_axial_forces(problem, data);
  const StencilKernels& kernels = stencil_kernels();
  (model.planar() ? kernels.planar_momentum_bend : kernels.momentum_bend)(
      regular_batch(k, data, assembler, values, data.axial_force),
      {.start_frames = frames_of(problem.start_configuration),
       .end_frames = frames_of(data.end_configuration),
       .start_strain = problem.start_configuration.bend_strain.data(),
       .end_strain = data.end_configuration.bend_strain.data()});
  for (int e : assembler.regular.other_edges) {
    discrete_stretch_local(model, k, step, e, with_matrix, data.axial_force, local);
    add_element(assembler.stretch, e, local, data, values);
  }
  for (int b : assembler.regular.other_bend) {
    discrete_bend_local(model, bend_coefficients(k, b), step, b, with_matrix, local);
    add_element(assembler.bend, b, local, data, values);
  }
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    discrete_half_local(model, half_coefficients(k, h), step, h, with_matrix, local);
    if (problem.exact && with_matrix && !model.planar()) {
      // Inertia converts the rows of frames from derivatives by a Cayley vector to moments. These rows are moments
      // already.
      Eigen::Map<Eigen::Matrix<double, 3, kMaxLocal, Eigen::RowMajor>> rows(&local.hessian[7][0]);
      const int frame = model.frame_dof[at(model.half[at(h)].frame)];
      rows = (cayley_spin(data.z.segment<3>(frame)).transpose() * rows).eval();
    }
    add_element(assembler.half, h, local, data, values);
  }
  data.elastic_rows = data.gradient.head(model.dof_count);
}

/// Under the midpoint rules the rate of a strain s is the difference of the ends, (s1 - s0) / dt. The matrix contains
/// k g g^T in place of k g g1^T, where g and g1 are the gradients of s in the middle and at the end.
void ElasticForces::add_rate_slopes(const StepProblem& problem, StepData& data, const Assembler& assembler,
                                    std::span<double> values) const {
  const Model& model = problem.model;
  const ElasticCoefficients& k = problem.viscous;
  StrainGradients middle, end;
  double hessian[kMaxLocal][kMaxLocal];
  const auto add = [&](const ElementTable& table, int element, const double* stiffness, Eigen::Index stride) {
    const int width = table.width();
    for (int i = 0; i < width; ++i)
      for (int j = 0; j < width; ++j) {
        hessian[i][j] = 0.0;
        for (int s = 0; s < middle.count; ++s)
          hessian[i][j] += stiffness[s * stride] * middle.gradient[s][i] * (end.gradient[s][j] - middle.gradient[s][j]);
      }
    table.add_hessian(element, hessian, 1.0, values);
  };
  for (int e = 0; e < model.edge_count; ++e) {
    stretch_gradients(model, data.configuration, e, middle);
    stretch_gradients(model, data.end_configuration, e, end);
    const double stiffness = k.stretch_stiffness[e] * model.edge_length[e];
    add(assembler.stretch, e, &stiffness, 1);
  }
  if (!model.planar())
    stencil_kernels().rate_slopes(regular_batch(k, data, assembler, values, nullptr),
                                  {.start_frames = nullptr,
                                   .end_frames = frames_of(data.end_configuration),
                                   .start_strain = nullptr,
                                   .end_strain = data.end_configuration.bend_strain.data()});
  for_each_single_bend(model, assembler, [&](int b) {
    bend_gradients(model, k.measure, data.configuration, b, middle);
    bend_gradients(model, k.measure, data.end_configuration, b, end);
    add(assembler.bend, b, &k.bend_stiffness(b, 0), k.bend_stiffness.rows());
  });
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    half_gradients(model, data.z, k.measure, data.configuration, h, middle);
    half_gradients(model, data.end, k.measure, data.end_configuration, h, end);
    add(assembler.half, h, &k.half_stiffness(h, 0), k.half_stiffness.rows());
  }
}

double largest_turn(const Model& model, const VectorX& q0, const VectorX& q1) {
  double smallest = 1.0;  // square of the cosine, with its sign
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.tail_dof[at(e)], b = model.head_dof[at(e)];
    double before = 0.0, after = 0.0, across = 0.0;
    for (int i = 0; i < model.dimension; ++i) {
      const double start = q0(b + i) - q0(a + i), end = q1(b + i) - q1(a + i);
      before += start * start;
      after += end * end;
      across += start * end;
    }
    const double square = across * std::abs(across) / (before * after);
    if (!(square >= smallest)) smallest = square;
  }
  return std::isfinite(smallest) ? std::acos(std::copysign(std::sqrt(std::min(std::abs(smallest), 1.0)), smallest))
                                 : INFINITY;
}

void predict_axial_force(const StepProblem& problem, const StepData& data, const VectorX& step, VectorX& out) {
  const Model& model = problem.model;
  const ElasticCoefficients& k = acting_coefficients(problem, data);
  const bool mean = problem.conserves_energy();
  out.resize(model.edge_count);
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.tail_dof[at(e)], b = model.head_dof[at(e)];
    const Vec3d& tangent = (mean ? data.end_configuration : data.configuration).edge[at(e)].tangent;
    const double t[3] = {tangent.x, tangent.y, tangent.z};
    double length = mean ? 0.5 * (problem.start_configuration.length(e) + data.end_configuration.length(e))
                         : data.configuration.length(e);
    for (int i = 0; i < model.dimension; ++i) length += t[i] * (step(b + i) - step(a + i));
    out(e) = axial_force(length, model.edge_length(e), k.stretch_stiffness(e), k.stretch_natural(e));
  }
}

}  // namespace withe
