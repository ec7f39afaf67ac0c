// Derivatives of elastic and viscous forces by stiffnesses, natural strains, viscous times and the start of the step.
//
// Forces are sums of k (s - n) g over strains s with gradients g, and of kv r g, kv = k tau / h, with r the strain's
// change from the start: s - s0 under backward Euler, (s1 - s0) / 2 under the midpoint rules. Everything but g is a
// number, so what multiplies rows^T is (s - n) times `along` = rows^T g, and so on.

#include <stdexcept>

#include "geometry/rotation.hpp"
#include "steps/elastic_forces.hpp"

namespace withe {
namespace {

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
    for (const auto& [place, edge] : angles) turn[edge] += factor * gradient[place];
  }

  std::vector<std::pair<int, int>> angles;  ///< where angles are among the unknowns, and of which edges

 private:
  const StepProblem& problem_;
  const ElementTable& table_;
  int element_;
  StepAdjoint& adjoint_;
  double rows_[kMaxLocal];
};

}  // namespace

void ElasticForces::add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                                StepAdjoint& adjoint) const {
  if (problem.conserves_energy()) throw std::invalid_argument("no gradient is known through energy-momentum steps yet");
  const Model& model = problem.model;
  const ElasticCoefficients &k = problem.elastic, &kv = problem.viscous;
  const bool viscous = problem.viscous_acts(), middle = problem.in_middle();
  const double rate = problem.moves() ? 1.0 / problem.interval : 0.0;
  CoefficientAdjoint& by = adjoint.coefficients;

  for (int e = 0; e < model.edge_count; ++e) {
    StencilAdjoint part(problem, assembler.stretch, e, adjoint);
    stretch_gradients(model, data.configuration, e, part.middle);
    const double along = model.edge_length(e) * part.along(0);
    by.stretch_stiffness(e) += (part.middle.strain[0] - k.stretch_natural(e)) * along;
    if (!viscous) continue;
    stretch_gradients(model, problem.start_configuration, e, part.start);
    if (middle) stretch_gradients(model, data.end_configuration, e, part.end);
    by.stretch_stiffness(e) += rate * problem.parameters->edge_viscous_time(e) * part.change(0) * along;
    by.stretch_time(e) += rate * k.stretch_stiffness(e) * part.change(0) * along;
    part.add_start(0, model.edge_length(e) * kv.stretch_stiffness(e));
  }

  const auto add_turning = [&](StencilAdjoint& part, int i, const Columns3& stiffness, const Columns3& natural,
                               double viscous_time, const Columns3& viscous_stiffness, Columns3& by_stiffness,
                               Columns3& by_natural, double& by_time) {
    for (int s = 0; s < part.middle.count; ++s) {
      const double along = part.along(s);
      by_stiffness(i, s) += (part.middle.strain[s] - natural(i, s)) * along;
      by_natural(i, s) -= stiffness(i, s) * along;
      if (!viscous) continue;
      by_stiffness(i, s) += rate * viscous_time * part.change(s) * along;
      by_time += rate * stiffness(i, s) * part.change(s) * along;
      part.add_start(s, viscous_stiffness(i, s));
    }
  };
  for (int b = 0; b < static_cast<int>(model.bend.size()); ++b) {
    StencilAdjoint part(problem, assembler.bend, b, adjoint);
    bend_gradients(model, k.measure, data.configuration, b, part.middle);
    if (viscous) {
      bend_gradients(model, k.measure, problem.start_configuration, b, part.start);
      if (middle) bend_gradients(model, k.measure, data.end_configuration, b, part.end);
    }
    if (!model.planar()) part.angles = {{3, model.bend[at(b)].edge[0]}, {7, model.bend[at(b)].edge[1]}};
    add_turning(part, b, k.bend_stiffness, k.bend_natural, problem.parameters->bend_viscous_time(b), kv.bend_stiffness,
                by.bend_stiffness, by.bend_natural, by.bend_time(b));
  }
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    StencilAdjoint part(problem, assembler.half, h, adjoint);
    half_gradients(model, data.z, k.measure, data.configuration, h, part.middle);
    if (viscous) {
      half_gradients(model, problem.start->q, k.measure, problem.start_configuration, h, part.start);
      if (middle) half_gradients(model, data.end, k.measure, data.end_configuration, h, part.end);
    }
    if (!model.planar()) part.angles = {{3, model.half[at(h)].edge}};
    add_turning(part, h, k.half_stiffness, k.half_natural, problem.parameters->half_viscous_time(h), kv.half_stiffness,
                by.half_stiffness, by.half_natural, by.half_time(h));
    if (model.planar() || !problem.moves()) continue;
    // How the frame's turns enter, beyond its unknowns.
    const int frame = model.half[at(h)].frame;
    const Vector3 w = data.z.segment<3>(model.frame_dof[at(frame)]);
    Local local;
    half_local(model, data.z, half_coefficients(acting_coefficients(problem, data), h), data.configuration, h, true,
               local);
    Vector3 spin = Vector3::Zero(), start = spin, end = spin;
    const auto& rows = part.rows();
    for (int i = 0; i < 3; ++i) {
      for (int r = 0; r < kMaxLocal; ++r) spin(i) += rows[r] * local.hessian[r][7 + i];
      for (int s = 0; viscous && s < part.middle.count; ++s) {
        const double factor = kv.half_stiffness(h, s) * part.along(s);
        if (!middle) {
          start(i) -= factor * part.start.gradient[s][7 + i];
          continue;
        }
        spin(i) -= factor * part.middle.gradient[s][7 + i];
        start(i) -= 0.5 * factor * part.start.gradient[s][7 + i];
        end(i) += 0.5 * factor * part.end.gradient[s][7 + i];
      }
    }
    const Matrix3 J = cayley_spin(w);
    const Vector3 moment = J.transpose().inverse() * Eigen::Map<const Vector3>(local.gradient + 7);
    spin -= cayley_moment_slope(w, moment).transpose() * Eigen::Map<const Vector3>(rows + 7);
    adjoint.middle_spin.row(frame) += (J.transpose().inverse() * spin).transpose();
    adjoint.start_spin.row(frame) += start.transpose();
    if (middle && viscous) {
      const Matrix3 at_end = cayley_spin(data.end.segment<3>(model.frame_dof[at(frame)]));
      adjoint.end_spin.row(frame) += (at_end.transpose().inverse() * end).transpose();
    }
  }
}

}  // namespace withe
