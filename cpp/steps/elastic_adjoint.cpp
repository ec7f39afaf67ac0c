// Derivatives of elastic and viscous forces by stiffnesses, natural strains, viscous times and the start of the step.
//
// Forces are sums of k (s - n) g over strains s with gradients g, and of kv r g with kv = k tau / h. Here r is the
// change of the strain since the start: s - s0 under backward Euler, (s1 - s0) / 2 under the midpoint rules. All
// factors except g are numbers. The product with rows^T is therefore (s - n) times `along` = rows^T g, and so on.

#include "geometry/rotation.hpp"
#include "steps/strain_adjoint.hpp"

namespace withe {
namespace {

/// Adjoint of stretching: EA (eps - n) and kv times the change of eps act along an edge.
void add_stretch(const StepProblem& problem, const StepData& data, StepAdjoint& adjoint) {
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
    const double now = strain(data.configuration);
    by.stretch_stiffness(e) += (now - k.stretch_natural(e)) * along;
    by.stretch_natural(e) -= k.stretch_stiffness(e) * along;
    by.rest_length(e) -= k.stretch_stiffness(e) * (1.0 + now) / length * along;
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

/// Adjoint of ordinary stencils in space, all at once: see StencilAdjoint.
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

/// Derivatives by rotations of a half stencil's frame, beyond its unknowns, and of the parts attached to it.
void add_half_turns(const StepProblem& problem, const StepData& data, int h, const StencilAdjoint& part,
                    StepAdjoint& adjoint) {
  const Model& model = problem.model;
  const ElasticCoefficients& kv = problem.viscous;
  const bool viscous = problem.viscous_acts(), middle = problem.in_middle(), planar = model.planar();
  const int frame = model.half[at(h)].frame, first = planar ? 4 : 7, count = model.frame_size();
  Local local;
  half_local(model, data.z, half_coefficients(acting_coefficients(problem, data), h), data.configuration, h, true,
             local);
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
  // The axis of a hinge rotates with the frame, not with the attached part.
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
  if (problem.conserves_energy()) return add_discrete_adjoint(problem, data, assembler, adjoint);
  const ElasticCoefficients &k = problem.elastic, &kv = problem.viscous;
  const bool viscous = problem.viscous_acts(), middle = problem.in_middle();
  const double rate = problem.moves() ? 1.0 / problem.interval : 0.0;
  CoefficientAdjoint& by = adjoint.coefficients;
  add_stretch(problem, data, adjoint);
  const TurningNumbers numbers{k.bend_stiffness,    k.bend_natural,  problem.parameters->bend_viscous_time,
                               by.bend_stiffness,   by.bend_natural, by.bend_time,
                               viscous ? rate : 0.0};
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
  const ElasticCoefficients &k = problem.elastic, &kv = problem.viscous;
  const bool viscous = problem.viscous_acts(), middle = problem.in_middle();
  CoefficientAdjoint& by = adjoint.coefficients;
  const TurningNumbers numbers{
      k.half_stiffness, k.half_natural, problem.parameters->half_viscous_time, by.half_stiffness,
      by.half_natural,  by.half_time,   viscous ? 1.0 / problem.interval : 0.0};
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    StencilAdjoint part(problem, assembler.half, h, adjoint);
    half_gradients(model, data.z, k.measure, data.configuration, h, part.middle);
    if (viscous) {
      half_gradients(model, problem.start->q, k.measure, problem.start_configuration, h, part.start);
      if (middle) half_gradients(model, data.end, k.measure, data.end_configuration, h, part.end);
    }
    part.angles = half_angles(model, h);
    part.add_turning(numbers, kv.half_stiffness);
    add_half_turns(problem, data, h, part, adjoint);
  }
}

}  // namespace withe
