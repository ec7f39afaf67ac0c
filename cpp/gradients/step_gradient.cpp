#include "gradients/step_gradient.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/check.hpp"
#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"
#include "steps/inertia.hpp"

namespace withe {
namespace {

/// Relative stiffness added to neutral modes, relative stiffness below which a resistance is rounding, and largest
/// relative residual of a solve.
constexpr double kNeutral = 1e-12, kFree = 1e-14, kSolved = 1e-6;
constexpr const char* kSingular =
    "the state is not determined by the parameters, because the matrix is "
    "singular: a rod can move or spin freely, or the state is a limit point";

EquationOptions exact(EquationOptions options) {
  options.exact = true;
  return options;
}

}  // namespace

void add_axial_forces(const Model& model, const Parameters& parameters, const Configuration& configuration,
                      const VectorX& by, VectorX& unknowns, CoefficientAdjoint& coefficients) {
  for (int e = 0; e < model.edge_count; ++e) {
    const double inverse_rest = 1.0 / model.edge_length(e), stretch = configuration.length(e) * inverse_rest;
    const double stiffness = by(e) * parameters.edge_stretch(e);
    add_to_edge(model, e, (stiffness * inverse_rest) * configuration.edge[at(e)].tangent, unknowns);
    coefficients.stretch_stiffness(e) += by(e) * (stretch - parameters.edge_natural_stretch(e));
    coefficients.stretch_natural(e) -= stiffness;
    coefficients.rest_length(e) -= stiffness * stretch * inverse_rest;
  }
}

StepGradient::StepGradient(const Model& model, EquationOptions options) : equations_(model, exact(options)) {
  require(!model.has_bodies(), "gradients of scenes with rigid bodies are not available yet");
}

void StepGradient::begin(const StepTaken& step) {
  step_.emplace(step);
  const Model& model = equations_.model();
  const bool middle = step.rule == StepRule::midpoint || step.rule == StepRule::energy_momentum;
  const bool holds = !model.constraints.empty() && moves();
  if (holds && step.held_velocity)
    held_acceleration_ = (*step.held_velocity - step.start.v) / step.duration;
  else if (holds)
    held_acceleration_.setZero(model.dof_count);
  equations_.begin(step.start, step.parameters, step.rule, middle ? 0.5 * step.duration : step.duration,
                   step.prescribed, holds ? &held_acceleration_ : nullptr);
  if (step.rule == StepRule::energy_momentum) {
    z_ = step.end - step.start.q;
    set_velocity_rates(model, z_, step.duration, rates_);
  } else if (moves()) {
    rates_.setConstant(model.dof_count, (middle ? 2.0 : 1.0) / step.duration);
  }
  if (middle)
    z_ = 0.5 * (step.start.q + step.end);
  else
    z_ = step.end;
  equations_.evaluate(z_, true, nullptr, data_);
  end_ = &data_.configuration;
  if (middle && !model.planar()) {
    const StepProblem& problem = equations_.problem();
    const bool found = problem.conserves_energy() || problem.viscous_acts();
    if (!found) compute_configuration(model, step.start, step.end, own_end_);
    end_ = found ? &data_.end_configuration : &own_end_;
  }
  Assembler& assembler = equations_.assembler();
  LinearSolver& solver = assembler.solver();
  assembler.project_for_now();
  bool solved = solver.factorize().status == FactorStatus::ok;
  shifted_ = !solved;
  if (shifted_) {
    // Free motions are held by a small stiffness; see `solve`.
    rows_.setConstant(model.dof_count, kNeutral * assembler.greatest_diagonal());
    solved = solver.factorize({rows_.data(), static_cast<std::size_t>(rows_.size())}).status == FactorStatus::ok;
  }
  assembler.take_back_projection();
  if (!solved) throw std::invalid_argument(kSingular);
}

double StepGradient::imbalance() const {
  const double beyond_rounding = (data_.residual.cwiseAbs() - data_.floor).maxCoeff();
  return std::max(beyond_rounding, 0.0) / std::max(data_.magnitude.maxCoeff(), 1e-300);
}

/// From the state at the end, in its own coordinates, to q1.
void StepGradient::set_end(const StateAdjoint& state) {
  const Model& model = equations_.model();
  by_end_ = state.q;
  if (model.planar()) return;
  for (int e = 0; e < model.edge_count; ++e)
    add_to_edge(model, e, state.q[model.edge_dof[at(e)]] * end_->edge[at(e)].spin, by_end_);
  for (int dof : model.frame_dof)
    by_end_.segment<3>(dof) = cayley_spin(step_->end.segment<3>(dof)).transpose() * state.q.segment<3>(dof);
}

/// Computes rows = r + w with R_z^T r = -(zbar + R_z^T w) on the free unknowns, where w are the derivatives by rows of
/// supports. Also computes columns = R_z^T rows, which is -zbar on the free unknowns.
void StepGradient::solve() {
  const Assembler& assembler = equations_.assembler();
  const bool reacts = by_rows_.size() != 0;
  rows_ = -by_z_;
  if (reacts) {
    assembler.multiply_transposed(by_rows_, columns_);
    rows_ -= columns_;
  }
  const double size = rows_.cwiseAbs().maxCoeff();
  assembler.project(rows_);
  assembler.solver().solve_transposed({rows_.data(), static_cast<std::size_t>(rows_.size())});
  assembler.project(rows_);
  // A scalar that neutral modes leave alone has a gradient, one that goes with them has none.
  bool follows = moves() || kFree * assembler.greatest_diagonal() * rows_.cwiseAbs().maxCoeff() <= size;
  if (reacts) rows_ += by_rows_;
  columns_ = -by_z_;
  assembler.multiply_held_transposed(rows_, columns_);
  if (shifted_) {
    assembler.multiply_transposed(rows_, columns_);
    VectorX left = by_z_ + columns_;
    assembler.project(left);
    follows = follows && left.cwiseAbs().maxCoeff() <= kSolved * size;
  }
  if (!follows) throw std::invalid_argument(kSingular);
}

void StepGradient::pull_back(StateAdjoint& state, CoefficientAdjoint& by, HeldAdjoint& held,
                             const ReactionAdjoint* reactions, const VectorX* tensions) {
  const Model& model = equations_.model();
  const Assembler& assembler = equations_.assembler();
  const HandForces* yielding = equations_.hands();
  if (state.hands.positions.size() == 0) state.hands = HandAdjoint(model);
  VectorX rows;
  StepAdjoint adjoint(model, rows, state.approach, state.hands, by);
  set_end(state);
  if (yielding) yielding->add_slip_adjoint(equations_.problem(), step_->end, adjoint, by_end_);
  // v1 = rate (q1 - q0) - (end_rate - 1) v0, except that rates of angles may be those of finite rotations.
  VectorX start = VectorX::Zero(model.dof_count), velocity = start;
  if (moves()) {
    VectorX free = state.v;
    assembler.project(free);
    const VectorX moved = rates_.cwiseProduct(free);
    by_end_ += moved;
    start -= moved;
    velocity -= (end_rate() - 1.0) * free;
  }
  start -= (end_rate() - 1.0) * by_end_;
  by_z_ = end_rate() * by_end_;
  by_rows_.resize(0);
  if (reactions) add_reactions(*reactions, adjoint);
  if (tensions) add_axial_forces(model, step_->parameters, data_.configuration, *tensions, by_z_, by);
  solve();

  rows = rows_;
  if (step_->rule == StepRule::energy_momentum && !model.planar())
    for (int dof : model.frame_dof)
      rows.segment<3>(dof) = (cayley_spin(z_.segment<3>(dof)).inverse() * rows.segment<3>(dof)).eval();
  for (const std::unique_ptr<Term>& term : equations_.terms())
    term->add_adjoint(equations_.problem(), data_, assembler, adjoint);
  if (moves()) {
    start += adjoint.start;
    velocity += adjoint.velocity;
    if (!model.planar()) {
      add_transport(state, adjoint, start);
      add_frames(state, adjoint, start);
    }
  }
  add_held(adjoint, state.v, start, velocity, held);
  held.hands = adjoint.hands_end;
  held.hands.positions += state.hands.positions;
  held.hands.rotations += state.hands.rotations;
  held.obstacles = adjoint.obstacles_end;
  if (state.obstacles.size() != 0) held.obstacles += state.obstacles;
  if (!moves()) return;
  state.q = start;
  state.v = velocity;
  state.approach = std::move(adjoint.approach);
  state.hands = std::move(adjoint.hands);
  state.obstacles = std::move(adjoint.obstacles);
}

VectorX StepGradient::respond(const VectorX& residual, const VectorX& held) {
  if (shifted_) throw std::invalid_argument(kSingular);
  const Assembler& assembler = equations_.assembler();
  assembler.multiply(held, columns_);
  VectorX out = -residual - columns_;
  assembler.project(out);
  assembler.solver().solve({out.data(), static_cast<std::size_t>(out.size())});
  assembler.project(out);
  return out + held;
}

void StepGradient::add_work_along(const VectorX& motion, CoefficientAdjoint& by, HeldAdjoint& held) {
  const Model& model = equations_.model();
  const Assembler& assembler = equations_.assembler();
  StateAdjoint state{VectorX::Zero(model.dof_count), VectorX::Zero(model.dof_count)};
  state.hands = HandAdjoint(model);
  VectorX rows = rows_ = motion, velocity = state.v;
  by_z_.setZero(model.dof_count);
  columns_ = by_z_;
  assembler.multiply_held_transposed(rows_, columns_);
  StepAdjoint adjoint(model, rows, state.approach, state.hands, by);
  for (const std::unique_ptr<Term>& term : equations_.terms())
    term->add_adjoint(equations_.problem(), data_, assembler, adjoint);
  add_held(adjoint, state.v, state.q, velocity, held);
  held.hands = adjoint.hands_end;
  held.obstacles = adjoint.obstacles_end;
}

void StepGradient::add_frames(const StateAdjoint& state, const StepAdjoint& adjoint, VectorX& start) const {
  const Model& model = equations_.model();
  for (int f = 0; f < model.frame_count; ++f) {
    const int dof = model.frame_dof[at(f)];
    const Vector3 at_end = state.q.segment<3>(dof) + adjoint.end_spin.row(f).transpose();
    start.segment<3>(dof) = cayley(step_->end.segment<3>(dof)).transpose() * at_end +
                            cayley(z_.segment<3>(dof)).transpose() * adjoint.middle_spin.row(f).transpose() +
                            adjoint.start_spin.row(f).transpose();
  }
}

/// Transport of directors, with its torques on nodes, as far as it depends on the edges of the start.
void StepGradient::add_transport(const StateAdjoint& state, const StepAdjoint& adjoint, VectorX& start) const {
  const Model& model = equations_.model();
  for (int e = 0; e < model.edge_count; ++e) {
    const int angle = model.edge_dof[at(e)];
    const EdgeFrame<double>& f = data_.configuration.edge[at(e)];
    const EdgeFrame<double>& last = end_->edge[at(e)];
    const Vec3d e0 = edge_vector(model, step_->start.q, e);
    const double inverse0 = 1.0 / std::sqrt(dot(e0, e0));
    // If all angles of an edge, also at the start, grow equally and its reference director turns back, nothing changes.
    const double turns = columns_[angle] + adjoint.start[angle],
                 at_z = turns + adjoint.middle_turn[e] - adjoint.end_turn[e] - adjoint.start_turn[e];
    Vec3d by = (at_z * inverse0 / f.inverse_length) * f.spin +
               ((adjoint.end_turn[e] + state.q[angle]) * inverse0 / last.inverse_length) * last.spin;
    // Friction has its own derivatives of torques by the start.
    const double friction = data_.contact_gradient.size() != 0 ? data_.contact_gradient[angle] : 0.0,
                 torque = data_.full_residual[angle] - data_.inertia[angle] - friction;
    const Vec3d u = torque * edge_vector(model, rows_, e);
    const Vec3d s = inverse0 * e0;
    const double k = inverse0 / (1.0 + dot(s, f.tangent));
    const Vec3d by_s = (-k * f.inverse_length) * cross(f.tangent, u) - (k * dot(u, f.spin)) * f.tangent;
    by += by_s - dot(by_s, s) * s;
    add_to_edge(model, e, by, start);
  }
}

}  // namespace withe
