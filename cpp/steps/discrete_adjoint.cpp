// Derivatives of discrete gradients, the elastic forces of energy-momentum steps; see elastic_adjoint.cpp.

#include "steps/discrete_adjoint.hpp"

#include "steps/strain_adjoint.hpp"

namespace withe {
namespace {

/// Adds derivatives by the rotation of the part that is attached to the frame of a half stencil.
void add_attachment(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                    const DiscreteAdjoint& discrete, int h, CoefficientAdjoint& by) {
  const Model& model = problem.model;
  double rows[kMaxLocal] = {};
  gather(assembler.half, h, discrete.rows(), rows);
  const auto add = [&](const DiscreteStep& way, const Configuration& c, const VectorX& q) {
    const Eigen::Matrix<double, kMaxLocal, 3> by_spin =
        discrete_half_spin(model, half_coefficients(acting_coefficients(problem, data), h), way, h);
    by.attachment.row(h) +=
        Eigen::Map<const Eigen::Matrix<double, 1, kMaxLocal>>(rows) * by_spin * attached_axes(model, c, q, h);
  };
  add(discrete.forth(), data.end_configuration, data.end);
  add(discrete.backwards(), problem.start_configuration, problem.start->q);
}

/// Adds derivatives by rotations of the frame of a half stencil, and of the attached part, through the strain at the
/// start.
void add_start_turns(const StepProblem& problem, int h, const StencilAdjoint& part, const std::array<double, 3>& factor,
                     StepAdjoint& adjoint) {
  const Model& model = problem.model;
  const int first = model.planar() ? 4 : 7;
  Vector3 start = Vector3::Zero();
  for (int s = 0; s < part.start.count; ++s)
    for (int i = 0; i < model.frame_size(); ++i) start(i) += factor[at(s)] * part.start.gradient[s][first + i];
  auto attachment = adjoint.coefficients.attachment.row(h);
  if (model.planar()) {
    attachment += start(0) * model.plane->normal.transpose();
    return;
  }
  adjoint.start_spin.row(model.half[at(h)].frame) += start.transpose();
  attachment +=
      (attached_axes(model, problem.start_configuration, problem.start->q, h).transpose() * start).transpose();
}

}  // namespace

/// With viscosity the moment on a mean strain s is k (s - n) + kv (s - s0).
void ElasticForces::add_discrete_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                                         StepAdjoint& adjoint) const {
  const Model& model = problem.model;
  const ElasticCoefficients &k = problem.elastic, &kv = problem.viscous, &acting = acting_coefficients(problem, data);
  const bool viscous = problem.viscous_acts();
  const double rate = viscous ? 1.0 / problem.interval : 0.0;
  CoefficientAdjoint& by = adjoint.coefficients;
  DiscreteAdjoint discrete(problem, data, adjoint.rows, adjoint);
  double rows[kMaxLocal];
  const DiscreteStep& step = discrete.forth();
  VectorX axial(model.edge_count), modulus(model.edge_count);
  for (int e = 0; e < model.edge_count; ++e) {
    // The force is EA (mean strain - natural strain) along `mean`.
    const MeanStretch mean = mean_stretch(model, acting, step.start, step.end, e);
    const EdgeFrame<double>& f = step.middle.edge[at(e)];
    gather(assembler.stretch, e, discrete.rows(), rows);
    double along = 0.0;
    for (int i = 0; i < model.dimension; ++i) along += f.tangent[i] * (rows[model.dimension + i] - rows[i]);
    along *= mean.inverse_mean / f.inverse_length;
    const double length = model.edge_length(e), stretch = 1.0 / (mean.inverse_mean * length);
    by.stretch_stiffness(e) += (stretch - 1.0 - k.stretch_natural(e)) * along;
    by.stretch_natural(e) -= k.stretch_stiffness(e) * along;
    by.rest_length(e) -= k.stretch_stiffness(e) * stretch / length * along;
    axial[e] = mean.force;
    modulus[e] = mean.modulus;
    if (!viscous) continue;
    const double change = 0.5 * (step.end.length(e) - step.start.length(e)) / length;
    by.stretch_stiffness(e) += rate * problem.parameters->edge_viscous_time(e) * change * along;
    by.stretch_time(e) += rate * k.stretch_stiffness(e) * change * along;
    by.rest_length(e) -= kv.stretch_stiffness(e) * change / length * along;
    for (int i = 0; i < model.dimension; ++i) {
      const double by_start = -kv.stretch_stiffness(e) / length * along * step.start.edge[at(e)].tangent[i];
      adjoint.start[model.head_dof[at(e)] + i] += by_start;
      adjoint.start[model.tail_dof[at(e)] + i] -= by_start;
    }
  }
  const auto add_stretch = [&](int e) {
    gather(assembler.stretch, e, discrete.rows(), rows);
    discrete.add_ends(assembler.stretch, e, rows, {}, [&](const DiscreteStep& way, Local& out) {
      discrete_stretch_local(model, acting, way, e, true, nullptr, out);
    });
  };
  const TurningNumbers bending{k.bend_stiffness,
                               k.bend_natural,
                               problem.parameters->bend_viscous_time,
                               by.bend_stiffness,
                               by.bend_natural,
                               by.bend_time,
                               rate};
  if (model.planar()) {
    for (int e = 0; e < model.edge_count; ++e) add_stretch(e);
  } else {
    for (int e : assembler.regular.other_edges) add_stretch(e);
    const Columns3 along = discrete.add_regular(assembler, acting, axial, modulus);
    const Columns3 start = measured_strains(k.measure, step.start), end = measured_strains(k.measure, step.end);
    for (int b : assembler.regular.stencil)
      for (int s = 0; s < 3; ++s)
        bending.add(b, s, along(b, s), 0.5 * (start(b, s) + end(b, s)), 0.5 * (end(b, s) - start(b, s)));
    if (viscous) {
      const VectorX force = strain_forces(model, assembler, k.measure, problem.start_configuration, start,
                                          kv.bend_stiffness.cwiseProduct(along));
      adjoint.start -= force.head(model.dof_count);
      for (int e = 0; e < model.edge_count; ++e) adjoint.start_turn[e] -= force[model.edge_dof[at(e)]];
    }
  }
  const auto add_rates = [](const TurningNumbers& numbers, const Columns3& stiffness, int i,
                            const std::array<double, 3>& along, StencilAdjoint& part) {
    std::array<double, 3> factor{};
    for (int s = 0; s < part.start.count; ++s) {
      numbers.add_rate(i, s, along[at(s)], part.change(s));
      factor[at(s)] = -stiffness(i, s) * along[at(s)];
      part.add_start(s, factor[at(s)]);
    }
    return factor;
  };
  for_each_single_bend(model, assembler, [&](int b) {
    const std::array<double, 3> along = discrete.add_turning(
        assembler.bend, b, bend_coefficients(k, b), bend_coefficients(acting, b), bend_angles(model, b), -1,
        [&](const DiscreteStep& way, const TurnCoefficients& of, bool with_matrix, Local& out) {
          discrete_bend_local(model, of, way, b, with_matrix, out);
        },
        by.bend_stiffness, by.bend_natural);
    if (!viscous) return;
    StencilAdjoint part(problem, assembler.bend, b, adjoint);
    part.angles = bend_angles(model, b);
    bend_gradients(model, k.measure, step.start, b, part.start);
    bend_gradients(model, k.measure, step.end, b, part.end);
    add_rates(bending, kv.bend_stiffness, b, along, part);
  });
  const TurningNumbers attaching{k.half_stiffness,
                                 k.half_natural,
                                 problem.parameters->half_viscous_time,
                                 by.half_stiffness,
                                 by.half_natural,
                                 by.half_time,
                                 rate};
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    const std::array<double, 3> along = discrete.add_turning(
        assembler.half, h, half_coefficients(k, h), half_coefficients(acting, h), half_angles(model, h),
        model.half[at(h)].frame,
        [&](const DiscreteStep& way, const TurnCoefficients& of, bool with_matrix, Local& out) {
          discrete_half_local(model, of, way, h, with_matrix, out);
        },
        by.half_stiffness, by.half_natural);
    add_attachment(problem, data, assembler, discrete, h, by);
    if (!viscous) continue;
    StencilAdjoint part(problem, assembler.half, h, adjoint);
    part.angles = half_angles(model, h);
    half_gradients(model, problem.start->q, k.measure, step.start, h, part.start);
    half_gradients(model, data.end, k.measure, step.end, h, part.end);
    add_start_turns(problem, h, part, add_rates(attaching, kv.half_stiffness, h, along, part), adjoint);
  }
}

}  // namespace withe
