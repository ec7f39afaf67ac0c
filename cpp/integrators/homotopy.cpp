#include "integrators/homotopy.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace withe {
namespace {

// Rotation of edges in a finite difference [rad], and its factor for yielding hands. A forward difference by d has a
// truncation error of about d and a rounding error of about epsilon / d: both are below 1e-6.
constexpr double kDifference = 1e-6;

bool turns(const LoadPiece& piece) { return piece.shape != LoadShape::dead_node && piece.load >= 0; }

/// Loads that turn with the rod grow from the share of them that the state carries already.
ActingPath growing_loads(Equations& equations, Parameters& parameters, const Prescribed& prescribed, const State& state,
                         NewtonWorkspace& work) {
  const std::vector<LoadPiece>& pieces = equations.loads().pieces;
  if (std::none_of(pieces.begin(), pieces.end(), turns)) return nullptr;
  const auto scale = [&pieces, full = parameters.loads](double share, MatrixX3& loads) {
    for (const LoadPiece& piece : pieces)
      if (turns(piece)) loads.row(piece.load) = share * full.row(piece.load);
  };
  // The residual is linear in them: the share by which the state is least out of balance.
  const auto out_of_balance = [&](double share) {
    scale(share, parameters.loads);
    equations.begin(state, parameters, StepRule::statics, 0.0, prescribed);
    equations.evaluate(state.q, false, nullptr, work.data);
    return work.data.residual;
  };
  const VectorX without = out_of_balance(0.0), change = out_of_balance(1.0) - without;
  const double square = change.squaredNorm();
  const double carried = square > 0.0 ? std::clamp(-without.dot(change) / square, 0.0, 1.0) : 0.0;
  return [scale, carried](double factor, Parameters& p) { scale(carried + factor * (1.0 - carried), p.loads); };
}

}  // namespace

ActingPath growing(Equations& equations, Parameters& parameters, const Prescribed& prescribed, const State& state,
                   NewtonWorkspace& work, const Actuation* before) {
  if (!before) return growing_loads(equations, parameters, prescribed, state, work);
  const ActingPath actuation = [&model = equations.model(), from = *before, to = actuation_of(parameters)](
                                   double factor, Parameters& p) { set_actuation_between(model, from, to, factor, p); };
  actuation(0.0, parameters);
  return
      [actuation, loads = growing_loads(equations, parameters, prescribed, state, work)](double factor, Parameters& p) {
        actuation(factor, p);
        if (loads) loads(factor, p);
      };
}

void Homotopy::start_out_of_balance() {
  imbalance_.setZero(state_.q.size());
  go_to(0.0);
  equations_.evaluate(state_.q, false, nullptr, work_.data);
  imbalance_ = work_.data.residual;
  if (const Contact* contact = equations_.contact()) deepest_ = std::max(kMaxDepth, contact->contacts().depth());
  go_to(0.0);
}

void Homotopy::apply(double factor) {
  if (acting_) acting_(factor, parameters_);
  if (boundary_.move) boundary_.move(factor);
  equations_.begin(state_, parameters_, StepRule::statics, 0.0, boundary_.prescribed);
}

void Homotopy::go_to(double factor) {
  factor_ = factor;
  apply(factor);
  if (imbalance_.size() == 0) imbalance_.setZero(state_.q.size());
  target_ = (1.0 - factor) * imbalance_;
}

void Homotopy::evaluate(const VectorX& z, bool with_matrix, const double* axial_force) {
  equations_.evaluate(z, with_matrix, axial_force, work_.data);
  work_.data.residual -= target_;
  work_.data.potential -= target_.dot(z);
}

bool Homotopy::stiffen_deep(const VectorX& q) {
  Contact* contact = equations_.contact();
  if (contact == nullptr) return false;
  contact->update(q);
  if (!(contact->contacts().depth() > deepest_)) return false;
  contact->accept_at_rest(state_, false, deepest_);
  if (contact->presses_alike()) return false;
  go_to(factor_);
  return true;
}

void Homotopy::accept(const VectorX& q) {
  const Model& model = equations_.model();
  present_ = factor_;
  if (Contact* contact = equations_.contact()) {
    contact->update(q);
    contact->accept_at_rest(state_, false, deepest_);
  }
  compute_configuration(model, state_, q, scratch_);
  accept_configuration(model, q, scratch_, state_);
  if (HandForces* hands = equations_.hands()) hands->accept(boundary_.prescribed.supports, scratch_, state_);
}

void Homotopy::find_pull(const VectorX& z, VectorX& pull, VectorX& held) {
  double part = boundary_.move ? kDifference : 1.0;
  for (int tries = 0; tries < 20; ++tries) {
    moved_ = z;
    const bool reached = boundary_.hold(present_, factor_ + part, moved_);
    held = moved_ - z;
    const double turn = reached ? newton_.norms().turn(held) : INFINITY;
    if (turn <= kDifference) break;
    part *= std::isfinite(turn) ? 0.9 * kDifference / turn : 1e-3;
  }
  const double farthest = z.cwiseProduct(newton_.norms().coordinates()).lpNorm<Eigen::Infinity>();
  // Places of supports at rest, found twice, differ by rounding alone.
  const bool any_moves = newton_.norms().displacement(held) > kMaxRounding * farthest;
  if (!any_moves) moved_ = z;
  held = any_moves ? (held / part).eval() : VectorX::Zero(z.size());
  moves_ = boundary_.move || any_moves;
  equations_.evaluate(z, false, nullptr, work_.data);
  pull = work_.data.residual;
  apply(factor_ + part);
  equations_.evaluate(moved_, false, nullptr, work_.data);
  apply(factor_);
  pull = (pull - work_.data.residual) / part - imbalance_;
}

void Homotopy::find_tangent(Tangent& out) {
  find_pull(state_.q, out.rate, held_);
  evaluate(state_.q, true, nullptr);
  LinearSolver& solver = equations_.assembler().solver();
  ++work_.counters.iterations;
  ++work_.counters.factorizations;
  if (hold_neutral_) shift_ = neutral_shift(equations_, kEpsilon);
  out.factorization = solver.factorize({shift_.data(), static_cast<std::size_t>(shift_.size())});
  out.found = out.factorization.status == FactorStatus::ok || factorize(equations_, work_);
  if (!out.found) return;
  solver.solve({out.rate.data(), static_cast<std::size_t>(out.rate.size())});
  out.rate += held_;
  equations_.expand(work_.data, out.rate);
  out.found = out.rate.allFinite();
  out.turn = newton_.norms().turn(out.rate);
}

}  // namespace withe
