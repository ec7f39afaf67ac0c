// Derivatives of elastic and viscous forces by stiffnesses, natural strains, viscous times and the start of the step.
//
// Forces are sums of k (s - n) g over strains s with gradients g, and of kv r g, kv = k tau / h, with r the strain's
// change from the start: s - s0 under backward Euler, (s1 - s0) / 2 under the midpoint rules. Everything but g is a
// number, so what multiplies rows^T is (s - n) times `along` = rows^T g, and so on.

#include <array>
#include <numeric>
#include <utility>

#include "elasticity/discrete_elements.hpp"
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

/// Of discrete gradients. They are functions of the two ends of a step alone, but for what torques leave nodes of the
/// directors' transport, spin times the torque; and those which exchange the ends leave alone. So derivatives by the
/// start are those by the end of the step backwards.
class DiscreteAdjoint {
 public:
  DiscreteAdjoint(const StepProblem& problem, const StepData& data, StepAdjoint& adjoint)
      : problem_(problem),
        adjoint_(adjoint),
        back_(-data.change),
        back_q_(problem.start->q),
        start_(problem.start_configuration),
        forth_{problem.start_configuration, data.configuration, data.end_configuration, data.end, data.change, false},
        backwards_{data.end_configuration, data.configuration, start_, back_q_, back_, false},
        rows_(adjoint.rows) {
    const Model& model = problem.model;
    for (int dof : model.frame_dof) {
      if (model.planar()) break;
      // Backwards a frame turns by the opposite Cayley vector. Its rows are moments.
      back_q_.segment<3>(dof) = back_.segment<3>(dof);
      rows_.segment<3>(dof) = (cayley_spin(data.z.segment<3>(dof)) * rows_.segment<3>(dof)).eval();
    }
    for (int e = 0; !model.planar() && e < model.edge_count; ++e) {
      // The start's angles as those of a step backwards: counted from where the end's tangents are.
      EdgeFrame<double>& start = start_.edge[at(e)];
      const Vec3d& source = data.end_configuration.edge[at(e)].tangent;
      start.spin = (-start.inverse_length / (1.0 + dot(source, start.tangent))) * cross(source, start.tangent);
      const Vec3d& spin = data.configuration.edge[at(e)].spin;
      const int tail = model.tail_dof[at(e)], head = model.head_dof[at(e)];
      for (int i = 0; i < 3; ++i) rows_[model.edge_dof[at(e)]] += spin[i] * (rows_[head + i] - rows_[tail + i]);
    }
  }

  /// `evaluate(step, k, with_matrix, local)`, with stiffnesses and natural strains `k`; `frame`: -1, or whose unknowns
  /// are among the element's.
  template <class Evaluate>
  void add_turning(const ElementTable& table, int i, const TurnCoefficients& k,
                   const std::vector<std::pair<int, int>>& angles, int frame, const Evaluate& evaluate,
                   Columns3& by_stiffness, Columns3& by_natural) {
    double rows[kMaxLocal];
    gather(table, i, rows_, rows);
    const auto work = [&](const TurnCoefficients& of) {
      Local local;
      evaluate(forth_, of, false, local);
      double sum = 0.0;
      for (int r = 0; r < table.width(); ++r) sum += rows[r] * local.gradient[r];
      return sum;
    };
    for (int s = 0; s < (problem_.model.planar() ? 1 : 3); ++s) {
      TurnCoefficients unit{k.measure, {}, k.natural};
      (s == 0 ? unit.stiffness.x : s == 1 ? unit.stiffness.y : unit.stiffness.z) = 1.0;
      const double now = work(unit);
      by_stiffness(i, s) += now;
      (s == 0 ? unit.natural.x : s == 1 ? unit.natural.y : unit.natural.z) += 1.0;
      by_natural(i, s) += k.stiffness[s] * (work(unit) - now);
    }
    const auto [start, end] = add_ends(table, i, rows, angles,
                                       [&](const DiscreteStep& step, Local& local) { evaluate(step, k, true, local); });
    if (frame < 0 || problem_.model.planar()) return;
    const int dof = problem_.model.frame_dof[at(frame)];
    const auto by_spin = [&](const VectorX& q, const LocalVector& by) -> Vector3 {
      return cayley_spin(q.segment<3>(dof)).transpose().inverse() * Eigen::Map<const Vector3>(by.data() + 7);
    };
    adjoint_.start_spin.row(frame) += by_spin(back_q_, start).transpose();
    adjoint_.end_spin.row(frame) += by_spin(forth_.end_q, end).transpose();
  }

  using LocalVector = std::array<double, kMaxLocal>;
  /// q1 = 2 z - q0, and matrices of steps are twice derivatives by their ends. Returns those by the start and by the
  /// end.
  template <class Evaluate>
  std::pair<LocalVector, LocalVector> add_ends(const ElementTable& table, int element, const double* rows,
                                               const std::vector<std::pair<int, int>>& angles,
                                               const Evaluate& evaluate) {
    Local by_end, by_start;
    evaluate(forth_, by_end);
    evaluate(backwards_, by_start);
    const int* dofs = table.dofs(element);
    LocalVector end{}, start{};
    for (std::size_t c = 0; c < static_cast<std::size_t>(table.width()); ++c) {
      for (int r = 0; r < table.width(); ++r) {
        end[c] += 0.5 * rows[r] * by_end.hessian[r][c];
        start[c] += 0.5 * rows[r] * by_start.hessian[r][c];
      }
      if (dofs[c] >= 0) adjoint_.start[dofs[c]] += start[c] - end[c];
    }
    for (const auto& [angle, edge] : angles) {
      const auto place = static_cast<std::size_t>(angle);
      adjoint_.start_turn[edge] += start[place];
      adjoint_.end_turn[edge] += end[place];
      // From angles so counted to turns of directors that are carried along with the edge.
      const int tail = problem_.model.tail_dof[at(edge)], head = problem_.model.head_dof[at(edge)];
      for (int i = 0; i < 3; ++i) {
        adjoint_.start[head + i] -= start[place] * start_.edge[at(edge)].spin[i];
        adjoint_.start[tail + i] += start[place] * start_.edge[at(edge)].spin[i];
      }
    }
    return {start, end};
  }

  const DiscreteStep& forth() const { return forth_; }
  const VectorX& rows() const { return rows_; }

 private:
  const StepProblem& problem_;
  StepAdjoint& adjoint_;
  VectorX back_, back_q_;
  Configuration start_;
  DiscreteStep forth_, backwards_;
  VectorX rows_;  ///< with what those of nodes make of torques among those of angles
};

}  // namespace

void ElasticForces::add_discrete_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                                         StepAdjoint& adjoint) const {
  const Model& model = problem.model;
  const ElasticCoefficients& k = problem.elastic;
  CoefficientAdjoint& by = adjoint.coefficients;
  DiscreteAdjoint discrete(problem, data, adjoint);
  Local local;
  double rows[kMaxLocal];
  // Of EA = 1 N, and of a natural strain of one less, which pulls by as much more.
  ElasticCoefficients unit, strained;
  unit.stretch_stiffness = strained.stretch_stiffness = VectorX::Ones(model.edge_count);
  unit.stretch_natural = k.stretch_natural;
  strained.stretch_natural = k.stretch_natural.array() - 1.0;
  for (int e = 0; e < model.edge_count; ++e) {
    gather(assembler.stretch, e, discrete.rows(), rows);
    const auto along = [&](const ElasticCoefficients& of) {
      discrete_stretch_local(model, of, discrete.forth(), e, false, nullptr, local);
      return std::inner_product(rows, rows + assembler.stretch.width(), local.gradient, 0.0);
    };
    const double pull = along(unit);
    by.stretch_stiffness(e) += pull;
    by.stretch_natural(e) -= k.stretch_stiffness(e) * (along(strained) - pull);
    discrete.add_ends(assembler.stretch, e, rows, {}, [&](const DiscreteStep& step, Local& out) {
      discrete_stretch_local(model, k, step, e, true, nullptr, out);
    });
  }
  const bool planar = model.planar();
  for (int b = 0; b < static_cast<int>(model.bend.size()); ++b) {
    std::vector<std::pair<int, int>> angles;
    if (!planar) angles = {{3, model.bend[at(b)].edge[0]}, {7, model.bend[at(b)].edge[1]}};
    discrete.add_turning(
        assembler.bend, b, bend_coefficients(k, b), angles, -1,
        [&](const DiscreteStep& step, const TurnCoefficients& of, bool with_matrix, Local& out) {
          discrete_bend_local(model, of, step, b, with_matrix, out);
        },
        by.bend_stiffness, by.bend_natural);
  }
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    std::vector<std::pair<int, int>> angles;
    if (!planar) angles = {{3, model.half[at(h)].edge}};
    discrete.add_turning(
        assembler.half, h, half_coefficients(k, h), angles, model.half[at(h)].frame,
        [&](const DiscreteStep& step, const TurnCoefficients& of, bool with_matrix, Local& out) {
          discrete_half_local(model, of, step, h, with_matrix, out);
        },
        by.half_stiffness, by.half_natural);
  }
}

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

  for (int e = 0; e < model.edge_count; ++e) {
    StencilAdjoint part(problem, assembler.stretch, e, adjoint);
    stretch_gradients(model, data.configuration, e, part.middle);
    const double along = model.edge_length(e) * part.along(0);
    if (elastic) by.stretch_stiffness(e) += (part.middle.strain[0] - k.stretch_natural(e)) * along;
    if (elastic) by.stretch_natural(e) -= k.stretch_stiffness(e) * along;
    if (elastic)
      by.rest_length(e) -= k.stretch_stiffness(e) * (1.0 + part.middle.strain[0]) / model.edge_length(e) * along;
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
      if (elastic) {
        by_stiffness(i, s) += (part.middle.strain[s] - natural(i, s)) * along;
        by_natural(i, s) -= stiffness(i, s) * along;
      }
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
    if (model.planar() || !problem.moves() || (!elastic && !viscous)) continue;
    // How the frame's turns enter, beyond its unknowns.
    const int frame = model.half[at(h)].frame;
    const Vector3 w = data.z.segment<3>(model.frame_dof[at(frame)]);
    Local local;
    const ElasticCoefficients& acting = elastic ? acting_coefficients(problem, data) : data.viscous;
    half_local(model, data.z, half_coefficients(acting, h), data.configuration, h, true, local);
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
