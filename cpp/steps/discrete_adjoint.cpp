// Derivatives of discrete gradients, the elastic forces of energy-momentum steps; see elastic_adjoint.cpp.

#include "steps/discrete_adjoint.hpp"

namespace withe {
namespace {

/// By how what is attached to the frame of a half stencil is turned.
void add_attachment(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                    const DiscreteAdjoint& discrete, int h, CoefficientAdjoint& by) {
  const Model& model = problem.model;
  double rows[kMaxLocal] = {};
  gather(assembler.half, h, discrete.rows(), rows);
  const auto add = [&](const DiscreteStep& way, const Configuration& c, const VectorX& q) {
    const Eigen::Matrix<double, kMaxLocal, 3> by_spin =
        discrete_half_spin(model, half_coefficients(problem.elastic, h), way, h);
    by.attachment.row(h) +=
        Eigen::Map<const Eigen::Matrix<double, 1, kMaxLocal>>(rows) * by_spin * attached_axes(model, c, q, h);
  };
  add(discrete.forth(), data.end_configuration, data.end);
  add(discrete.backwards(), problem.start_configuration, problem.start->q);
}

}  // namespace

void ElasticForces::add_discrete_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                                         StepAdjoint& adjoint) const {
  const Model& model = problem.model;
  const ElasticCoefficients& k = problem.elastic;
  CoefficientAdjoint& by = adjoint.coefficients;
  DiscreteAdjoint discrete(problem, data, adjoint);
  double rows[kMaxLocal];
  const DiscreteStep& step = discrete.forth();
  VectorX axial(model.edge_count), modulus(model.edge_count);
  for (int e = 0; e < model.edge_count; ++e) {
    // The force is EA (mean strain - natural strain) along this.
    const MeanStretch mean = mean_stretch(model, k, step.start, step.end, e);
    const EdgeFrame<double>& f = step.middle.edge[at(e)];
    gather(assembler.stretch, e, discrete.rows(), rows);
    double along = 0.0;
    for (int i = 0; i < model.dimension; ++i) along += f.tangent[i] * (rows[model.dimension + i] - rows[i]);
    along *= mean.inverse_mean / f.inverse_length;
    const double stretch = 1.0 / (mean.inverse_mean * model.edge_length(e));
    by.stretch_stiffness(e) += (stretch - 1.0 - k.stretch_natural(e)) * along;
    by.stretch_natural(e) -= k.stretch_stiffness(e) * along;
    by.rest_length(e) -= k.stretch_stiffness(e) * stretch / model.edge_length(e) * along;
    axial[e] = mean.force;
    modulus[e] = mean.modulus;
  }
  const auto add_stretch = [&](int e) {
    gather(assembler.stretch, e, discrete.rows(), rows);
    discrete.add_ends(assembler.stretch, e, rows, {}, [&](const DiscreteStep& way, Local& out) {
      discrete_stretch_local(model, k, way, e, true, nullptr, out);
    });
  };
  if (model.planar()) {
    for (int e = 0; e < model.edge_count; ++e) add_stretch(e);
  } else {
    for (int e : assembler.regular.other_edges) add_stretch(e);
    discrete.add_regular(assembler, k, axial, modulus, by.bend_stiffness, by.bend_natural);
  }
  for_each_single_bend(model, assembler, [&](int b) {
    discrete.add_turning(
        assembler.bend, b, bend_coefficients(k, b), bend_angles(model, b), -1,
        [&](const DiscreteStep& way, const TurnCoefficients& of, bool with_matrix, Local& out) {
          discrete_bend_local(model, of, way, b, with_matrix, out);
        },
        by.bend_stiffness, by.bend_natural);
  });
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    discrete.add_turning(
        assembler.half, h, half_coefficients(k, h), half_angles(model, h), model.half[at(h)].frame,
        [&](const DiscreteStep& way, const TurnCoefficients& of, bool with_matrix, Local& out) {
          discrete_half_local(model, of, way, h, with_matrix, out);
        },
        by.half_stiffness, by.half_natural);
    add_attachment(problem, data, assembler, discrete, h, by);
  }
}

}  // namespace withe
