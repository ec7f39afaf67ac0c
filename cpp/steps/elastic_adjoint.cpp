// Derivatives of elastic and viscous forces by stiffnesses, natural strains, viscous times and the start of the step.
//
// Forces are sums of k (s - n) g over strains s with gradients g, and of kv r g, kv = k tau / h, with r the strain's
// change from the start: s - s0 under backward Euler, (s1 - s0) / 2 under the midpoint rules. Everything but g is a
// number, so what multiplies rows^T is (s - n) times `along` = rows^T g, and so on.

#include "geometry/rotation.hpp"
#include "steps/regular_stencils.hpp"

namespace withe {
namespace {

/// Coefficients of bending and twisting in a step, and derivatives by them.
struct TurningNumbers {
  const Columns3 &stiffness, &natural;
  const VectorX& viscous_time;
  Columns3 &by_stiffness, &by_natural;
  VectorX& by_time;
  double rate;  ///< 1 / h; without viscosity 0
  bool elastic;

  /// `along`: rows^T times the strain's gradient; `change`: of the strain from the start, as viscosity takes it.
  void add(Eigen::Index i, int s, double along, double strain, double change) const {
    if (elastic) {
      by_stiffness(i, s) += (strain - natural(i, s)) * along;
      by_natural(i, s) -= stiffness(i, s) * along;
    }
    if (rate == 0.0) return;
    by_stiffness(i, s) += rate * viscous_time(i) * change * along;
    by_time(i) += rate * stiffness(i, s) * change * along;
  }
};

/// One stencil's part: its strains in the configurations that matter, and what its numbers are.
class StencilAdjoint {
 public:
  StencilAdjoint(const StepProblem& problem, const ElementTable& table, int element, StepAdjoint& adjoint)
      : problem_(problem), table_(table), element_(element), adjoint_(adjoint) {
    gather(table, element, adjoint.rows, rows_);
  }

  StrainGradients middle, start, end;

  double along(int strain) const {
    double sum = 0.0;
    for (int i = 0; i < table_.width(); ++i) sum += rows_[i] * middle.gradient[strain][i];
    return sum;
  }
  const double (&rows() const)[kMaxLocal] { return rows_; }

  /// By how much a strain has changed, as viscosity takes it.
  double change(int strain) const {
    return problem_.in_middle() ? 0.5 * (end.strain[strain] - start.strain[strain])
                                : middle.strain[strain] - start.strain[strain];
  }

  /// Adds what follows from the start's strain, and from that at q1 = 2 z - q0; `viscous`: kv.
  void add_start(int strain, double viscous) {
    const double factor = viscous * along(strain), share = problem_.in_middle() ? 0.5 : 1.0;
    add_configuration(start.gradient[strain], -share * factor, 1.0, adjoint_.start_turn);
    if (problem_.in_middle()) add_configuration(end.gradient[strain], share * factor, -1.0, adjoint_.end_turn);
  }

  /// `gradient` in a configuration that q0 counts `by_start` times in.
  void add_configuration(const double* gradient, double factor, double by_start, VectorX& turn) {
    const int* dofs = table_.dofs(element_);
    for (int i = 0; i < table_.width(); ++i)
      if (dofs[i] >= 0) adjoint_.start[dofs[i]] += factor * by_start * gradient[i];
    for (int i = 0; i < angles.count; ++i) turn[angles.edge[i]] += factor * gradient[angles.place[i]];
  }

  void add_turning(const TurningNumbers& numbers, const Columns3& viscous_stiffness) {
    for (int s = 0; s < middle.count; ++s) {
      const bool viscous = numbers.rate != 0.0;
      numbers.add(element_, s, along(s), middle.strain[s], viscous ? change(s) : 0.0);
      if (viscous) add_start(s, viscous_stiffness(element_, s));
    }
  }

  Angles angles;

 private:
  const StepProblem& problem_;
  const ElementTable& table_;
  int element_;
  StepAdjoint& adjoint_;
  double rows_[kMaxLocal];
};

/// Of stretching: EA (eps - n) and kv times the change of eps act along an edge.
void add_stretch(const StepProblem& problem, const StepData& data, bool elastic, StepAdjoint& adjoint) {
  const Model& model = problem.model;
  const ElasticCoefficients &k = problem.elastic, &kv = problem.viscous;
  const bool viscous = problem.viscous_acts(), middle = problem.in_middle();
  const double share = middle ? 0.5 : 1.0;
  CoefficientAdjoint& by = adjoint.coefficients;
  for (int e = 0; e < model.edge_count; ++e) {
    const int tail = model.tail_dof[at(e)], head = model.head_dof[at(e)];
    const double length = model.edge_length(e);
    const auto strain = [&](const Configuration& c) { return c.length(e) / length - 1.0; };
    double along = 0.0;
    for (int i = 0; i < model.dimension; ++i)
      along += data.configuration.edge[at(e)].tangent[i] * (adjoint.rows[head + i] - adjoint.rows[tail + i]);
    if (elastic) {
      const double now = strain(data.configuration);
      by.stretch_stiffness(e) += (now - k.stretch_natural(e)) * along;
      by.stretch_natural(e) -= k.stretch_stiffness(e) * along;
      by.rest_length(e) -= k.stretch_stiffness(e) * (1.0 + now) / length * along;
    }
    if (!viscous) continue;
    const Configuration &start = problem.start_configuration,
                        &end = middle ? data.end_configuration : data.configuration;
    const double change = share * (strain(end) - strain(start)),
                 force = share * kv.stretch_stiffness(e) / length * along, rate = 1.0 / problem.interval;
    by.stretch_stiffness(e) += rate * problem.parameters->edge_viscous_time(e) * change * along;
    by.stretch_time(e) += rate * k.stretch_stiffness(e) * change * along;
    by.rest_length(e) -= kv.stretch_stiffness(e) * change / length * along;
    for (int i = 0; i < model.dimension; ++i) {
      double by_start = -force * start.edge[at(e)].tangent[i];
      if (middle) by_start -= force * end.edge[at(e)].tangent[i];  // q1 = 2 z - q0
      adjoint.start[head + i] += by_start;
      adjoint.start[tail + i] -= by_start;
    }
  }
}

/// Sum of factors times gradients of strains f (kappa1, kappa2, tau), which are `strain`, of ordinary stencils in
/// space.
VectorX strain_forces(const Model& model, const Assembler& assembler, const BendMeasure& measure,
                      const Configuration& c, const Columns3& strain, const Columns3& factors) {
  // Of the energy k (s - n)^2 / 2 with s - n = 1.
  const Columns3 natural = strain.array() - 1.0;
  const VectorX none = VectorX::Zero(model.edge_count);
  VectorX out = VectorX::Zero(model.dof_count + kPadding), magnitude = out;
  StencilBatch batch = kernel_batch(assembler, measure, c, natural, factors);
  batch.force = none.data();
  batch.residual = out.data();
  batch.magnitude = magnitude.data();
  stencil_kernels().bend(batch);
  return out;
}

/// Of ordinary stencils in space, all at once: see StencilAdjoint.
void add_regular(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                 const TurningNumbers& numbers, StepAdjoint& adjoint) {
  const Model& model = problem.model;
  const BendMeasure& measure = problem.elastic.measure;
  const Columns3 strain = measured_strains(measure, data.configuration);
  Columns3 along = Columns3::Zero(strain.rows(), 3), change = along, start, end;
  stencil_kernels().strain_changes(
      kernel_batch(assembler, measure, data.configuration, numbers.natural, numbers.stiffness), adjoint.rows.data(),
      along.data());
  const bool viscous = numbers.rate != 0.0, middle = problem.in_middle();
  if (viscous) {
    start = measured_strains(measure, problem.start_configuration);
    if (middle) end = measured_strains(measure, data.end_configuration);
    change = middle ? Columns3(0.5 * (end - start)) : Columns3(strain - start);
  }
  for (int b : assembler.regular.stencil)
    for (int s = 0; s < 3; ++s) numbers.add(b, s, along(b, s), strain(b, s), change(b, s));
  if (!viscous) return;
  const double share = middle ? 0.5 : 1.0;
  const Columns3 factors = share * problem.viscous.bend_stiffness.cwiseProduct(along);
  const auto add = [&](const Configuration& c, const Columns3& strains, double sign, double by_start, VectorX& turn) {
    const VectorX force = strain_forces(model, assembler, measure, c, strains, factors);
    adjoint.start += (sign * by_start) * force.head(model.dof_count);
    for (int e = 0; e < model.edge_count; ++e) turn[e] += sign * force[model.edge_dof[at(e)]];
  };
  add(problem.start_configuration, start, -1.0, 1.0, adjoint.start_turn);
  if (middle) add(data.end_configuration, end, 1.0, -1.0, adjoint.end_turn);
}

/// How turns of a half stencil's frame enter, beyond its unknowns, and those of what is attached to it.
void add_half_turns(const StepProblem& problem, const StepData& data, int h, const StencilAdjoint& part,
                    StepAdjoint& adjoint) {
  const Model& model = problem.model;
  const ElasticCoefficients& kv = problem.viscous;
  const bool viscous = problem.viscous_acts(), middle = problem.in_middle(), planar = model.planar();
  const int frame = model.half[at(h)].frame, first = planar ? 4 : 7, count = model.frame_size();
  const ElasticCoefficients& acting = problem.conserves_energy() ? data.viscous : acting_coefficients(problem, data);
  Local local;
  half_local(model, data.z, half_coefficients(acting, h), data.configuration, h, true, local);
  Vector3 spin = Vector3::Zero(), start = spin, end = spin;
  const auto& rows = part.rows();
  for (int i = 0; i < count; ++i) {
    for (int r = 0; r < (planar ? 5 : kMaxLocal); ++r) spin(i) += rows[r] * local.hessian[r][first + i];
    for (int s = 0; viscous && s < part.middle.count; ++s) {
      const double factor = kv.half_stiffness(h, s) * part.along(s);
      if (!middle) {
        start(i) -= factor * part.start.gradient[s][first + i];
        continue;
      }
      spin(i) -= factor * part.middle.gradient[s][first + i];
      start(i) -= 0.5 * factor * part.start.gradient[s][first + i];
      end(i) += 0.5 * factor * part.end.gradient[s][first + i];
    }
  }
  auto attachment = adjoint.coefficients.attachment.row(h);
  if (planar) {
    attachment += (spin(0) + start(0) + end(0)) * model.plane->normal.transpose();
    return;
  }
  const int dof = model.frame_dof[at(frame)];
  const Vector3 w = data.z.segment<3>(dof);
  const Matrix3 back = cayley_spin(w).transpose().inverse();
  const Vector3 moment = back * Eigen::Map<const Vector3>(local.gradient + 7);
  spin = back * (spin - cayley_moment_slope(w, moment).transpose() * Eigen::Map<const Vector3>(rows + 7));
  if (middle && viscous) end = cayley_spin(data.end.segment<3>(dof)).transpose().inverse() * end;
  if (problem.moves()) {
    adjoint.middle_spin.row(frame) += spin.transpose();
    adjoint.start_spin.row(frame) += start.transpose();
    adjoint.end_spin.row(frame) += end.transpose();
  }
  const int hinge = model.half[at(h)].hinge;
  // A hinge's axis goes with the frame, not with what is attached.
  if (hinge >= 0) spin -= rows[10] * (data.configuration.frame[at(frame)] * model.hinges[at(hinge)].axis).cross(moment);
  attachment += (attached_axes(model, data.configuration, data.z, h).transpose() * spin).transpose();
  if (!viscous) return;
  attachment +=
      (attached_axes(model, problem.start_configuration, problem.start->q, h).transpose() * start).transpose();
  if (middle) attachment += (attached_axes(model, data.end_configuration, data.end, h).transpose() * end).transpose();
}

}  // namespace

void ElasticForces::add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                                StepAdjoint& adjoint) const {
  const Model& model = problem.model;
  if (problem.conserves_energy()) {
    add_discrete_adjoint(problem, data, assembler, adjoint);
    if (!problem.viscous_acts()) return;
  }
  const bool elastic = !problem.conserves_energy();
  const ElasticCoefficients &k = problem.elastic, &kv = problem.viscous;
  const bool viscous = problem.viscous_acts(), middle = problem.in_middle();
  const double rate = problem.moves() ? 1.0 / problem.interval : 0.0;
  CoefficientAdjoint& by = adjoint.coefficients;
  add_stretch(problem, data, elastic, adjoint);
  const TurningNumbers numbers{k.bend_stiffness,     k.bend_natural,  problem.parameters->bend_viscous_time,
                               by.bend_stiffness,    by.bend_natural, by.bend_time,
                               viscous ? rate : 0.0, elastic};
  if (!model.planar()) add_regular(problem, data, assembler, numbers, adjoint);
  for_each_single_bend(model, assembler, [&](int b) {
    StencilAdjoint part(problem, assembler.bend, b, adjoint);
    bend_gradients(model, k.measure, data.configuration, b, part.middle);
    if (viscous) {
      bend_gradients(model, k.measure, problem.start_configuration, b, part.start);
      if (middle) bend_gradients(model, k.measure, data.end_configuration, b, part.end);
    }
    part.angles = bend_angles(model, b);
    part.add_turning(numbers, kv.bend_stiffness);
  });
  add_half_adjoint(problem, data, assembler, adjoint);
}

void ElasticForces::add_half_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                                     StepAdjoint& adjoint) const {
  const Model& model = problem.model;
  const bool elastic = !problem.conserves_energy();
  const ElasticCoefficients &k = problem.elastic, &kv = problem.viscous;
  const bool viscous = problem.viscous_acts(), middle = problem.in_middle();
  CoefficientAdjoint& by = adjoint.coefficients;
  const TurningNumbers numbers{
      k.half_stiffness, k.half_natural, problem.parameters->half_viscous_time,  by.half_stiffness,
      by.half_natural,  by.half_time,   viscous ? 1.0 / problem.interval : 0.0, elastic};
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    StencilAdjoint part(problem, assembler.half, h, adjoint);
    half_gradients(model, data.z, k.measure, data.configuration, h, part.middle);
    if (viscous) {
      half_gradients(model, problem.start->q, k.measure, problem.start_configuration, h, part.start);
      if (middle) half_gradients(model, data.end, k.measure, data.end_configuration, h, part.end);
    }
    part.angles = half_angles(model, h);
    part.add_turning(numbers, kv.half_stiffness);
    if (elastic || viscous) add_half_turns(problem, data, h, part, adjoint);
  }
}

}  // namespace withe
