#include "integrators/statics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <vector>

namespace withe {
namespace {

/// Greatest angle by which an edge has left its source frame [rad]; a load increment is cut beyond a right angle.
bool turned_too_far(const State& state, const Configuration& c, bool planar) {
  if (planar) return false;
  for (std::size_t e = 0; e < c.edge.size(); ++e)
    if (dot(state.tangent[e], c.edge[e].tangent) < 0.0) return true;
  return false;
}

class Statics {
 public:
  Statics(Equations& equations, const Newton& newton, const Options& options, const Parameters& parameters,
          State& state, NewtonWorkspace& work)
      : equations_(equations),
        newton_(newton),
        options_(options),
        parameters_(parameters),
        state_(state),
        work_(work) {}

  StaticResult run(const Boundary& boundary) {
    StaticResult result;
    const State start = state_;
    result.converged = load_steps(boundary, start, result.newton);
    if (!result.converged) {
      state_ = start;
      boundary(1.0, start, state_.q);
      accept(state_.q);
      result.converged = settle(result.newton) || (equations_.has_potential() && descend(1000, result.newton));
    }
    if (!result.converged) return result;
    result.stable = stable();
    for (int tries = 0; tries < 4 && !result.stable && equations_.has_potential(); ++tries) {
      leave_saddle(tries);
      result.converged = settle(result.newton) || descend(1000, result.newton);
      if (!result.converged) return result;
      result.stable = stable();
    }
    return result;
  }

 private:
  void begin() { equations_.begin(state_, parameters_, 0.0, false); }

  void accept(const VectorX& q) {
    if (Contact* contact = equations_.contact()) {
      contact->update(q);
      contact->accept(state_);
    }
    Configuration& c = scratch_;
    compute_configuration(equations_.model(), state_, q, c);
    accept_configuration(equations_.model(), q, c, state_);
  }

  /// Whether supports may move at once to where z has them without pushing centrelines through each other.
  bool clear_way(const VectorX& z) {
    return !equations_.contact() || equations_.allowed(state_.q, z - state_.q) == 1.0;
  }

  /// Moments and followers turn with the rod, so their dead imbalance would pull where they do not: they grow instead.
  void scale_turning_loads(double fraction) {
    Loads& loads = equations_.loads();
    for (const LoadPiece& piece : loads.pieces)
      if (piece.shape != LoadShape::dead_node)
        loads.values[static_cast<std::size_t>(piece.load)] =
            fraction * full_loads_[static_cast<std::size_t>(piece.load)];
  }

  bool load_steps(const Boundary& boundary, const State& start, NewtonResult& last) {
    full_loads_ = equations_.loads().values;
    const bool reached = load_steps_scaled(boundary, start, last);
    equations_.loads().values = full_loads_;
    return reached;
  }

  bool load_steps_scaled(const Boundary& boundary, const State& start, NewtonResult& last) {
    VectorX imbalance, target, z;
    double reached = 0.0, increment = 1.0;
    const int patience = equations_.has_potential() ? 4 : 12;
    for (int failures = 0; reached < 1.0;) {
      const double next = std::min(1.0, reached + increment);
      begin();
      if (imbalance.size() == 0) {
        // All at once first; on the way in steps, from what the start is out of balance by.
        scale_turning_loads(0.0);
        equations_.evaluate(state_.q, false, nullptr, work_.evaluation);
        imbalance = work_.evaluation.residual;
      }
      scale_turning_loads(next);
      z = state_.q;
      boundary(next, start, z);
      target = (1.0 - next) * imbalance;
      equations_.assembler().project(target);
      NewtonResult r;
      if (clear_way(z)) r = newton_.solve(equations_, z, &target, std::min(25, options_.max_iterations), work_);
      last.iterations += r.iterations;
      last.residual = r.residual;
      last.worst_row = r.worst_row;
      last.step = r.step;
      if (r.converged && !turned_too_far(state_, equations_.configuration(), equations_.model().planar())) {
        accept(z);
        reached = next;
        failures = 0;
        if (r.iterations <= 8) increment *= 2.0;
      } else {
        if (++failures > patience || increment < 1e-4) return false;
        increment *= increment == 1.0 ? 0.2 : 0.5;
      }
    }
    last.converged = true;
    return true;
  }

  /// Pseudo-transient: backward Euler from rest, over and over, with intervals that grow as the scene settles. Each
  /// one minimises the potential plus M |z - q|^2 / (2 h^2), so the potential falls; mixed Newton keeps slender
  /// rods from crawling. Where turning loads leave no potential, inertia still keeps each interval solvable.
  bool settle(NewtonResult& last) {
    const Model& model = equations_.model();
    begin();
    equations_.evaluate(state_.q, true, nullptr, work_.evaluation);
    double stiffness = 0.0;
    for (int i = 0; i < model.dof_count; ++i)
      stiffness = std::max(stiffness, equations_.assembler().diagonal(i) / std::max(equations_.mass().rows(i), 1e-300));
    double potential = work_.evaluation.potential;
    energy_scale_ = std::max(energy_scale_, std::abs(potential));
    double h = 1e2 / std::sqrt(stiffness);
    const double longest = 1e12 * h, shortest = 1e-6 * h;
    VectorX z;
    for (int k = 0; k < 400 && h > shortest; ++k) {
      state_.v.setZero();
      const bool at_rest = h >= longest;
      equations_.begin(state_, parameters_, at_rest ? 0.0 : h, false);
      z = state_.q;
      const NewtonResult r = newton_.solve(equations_, z, nullptr, at_rest ? 40 : 25, work_);
      last.iterations += r.iterations;
      last.residual = r.residual;
      last.worst_row = r.worst_row;
      const double rounding = 1e-10 * (std::abs(potential) + std::abs(work_.evaluation.potential)) + least_energy();
      const bool falls = !equations_.has_potential() || work_.evaluation.potential <= potential + rounding;
      if (r.converged && falls && !turned_too_far(state_, equations_.configuration(), model.planar())) {
        accept(z);
        if (at_rest) return true;
        potential = work_.evaluation.potential;
        h *= r.iterations <= 4 ? 10.0 : r.iterations <= 8 ? 3.0 : 1.0;
      } else {
        h = std::min(h, longest) * 0.25;
      }
    }
    return false;
  }

  /// Levenberg-Marquardt on the potential: every accepted step lowers it.
  bool descend(int max_steps, NewtonResult& last) {
    const Model& model = equations_.model();
    VectorX shift, z, step, weight;
    begin();
    weight = equations_.mass().rows;
    double damping = 0.0;
    for (int k = 0; k < max_steps; ++k) {
      work_.poll();
      begin();
      equations_.evaluate(state_.q, true, nullptr, work_.evaluation);
      const Evaluation here = work_.evaluation;
      const Balance balance = newton_.balance(here, last);
      if (damping == 0.0) {
        double stiffness = 0.0;
        for (int i = 0; i < model.dof_count; ++i)
          stiffness = std::max(stiffness, equations_.assembler().diagonal(i) / std::max(weight(i), 1e-300));
        damping = 1e-6 * stiffness;
        lowest_ = 1e-12 * stiffness;
      }
      if ((balance.floor || (balance.either && damping <= lowest_ * 1e2)) ||
          (k % 10 == 9 && damping <= lowest_ * 1e4)) {
        // Near a minimum full Newton steps finish the work, if they stay near.
        z = state_.q;
        const double energy = here.potential;
        const NewtonResult r = newton_.solve(equations_, z, nullptr, 30, work_);
        last.iterations += r.iterations;
        last.residual = r.residual;
        if (r.converged && work_.evaluation.potential <= energy + 1e-9 * std::abs(energy) + least_energy() &&
            !turned_too_far(state_, equations_.configuration(), model.planar())) {
          accept(z);
          return true;
        }
        begin();
        equations_.evaluate(state_.q, true, nullptr, work_.evaluation);
      }
      bool accepted = false;
      for (int tries = 0; tries < 40 && !accepted; ++tries) {
        shift = damping * weight.cwiseMax(1e-300);
        ++work_.counters.factorizations;
        LinearSolver& solver = equations_.assembler().solver();
        const Factorization f = solver.factorize({shift.data(), static_cast<std::size_t>(shift.size())});
        if (f.status != FactorStatus::ok || f.negative_pivots > 0) {
          damping *= 8.0;
          continue;
        }
        step = -here.residual;
        solver.solve({step.data(), static_cast<std::size_t>(step.size())});
        if (newton_.cap(step) < 1.0 || equations_.allowed(state_.q, step) < 1.0) {
          damping *= 4.0;
          continue;
        }
        z = state_.q + step;
        equations_.evaluate(z, false, nullptr, work_.evaluation);
        const double gain = here.residual.dot(step);  // negative
        const double rounding = 1e-13 * (std::abs(here.potential) + here.magnitude.cwiseAbs().dot(step.cwiseAbs()));
        if (std::isfinite(work_.evaluation.potential) &&
            work_.evaluation.potential - here.potential <= 0.1 * gain + rounding) {
          accepted = true;
        } else {
          damping *= 4.0;
        }
      }
      ++last.iterations;
      ++work_.counters.iterations;
      if (!accepted) return false;
      accept(z);
      damping = std::max(damping * 0.2, lowest_);
    }
    return false;
  }

  bool stable() {
    begin();
    equations_.evaluate(state_.q, true, nullptr, work_.evaluation);
    ++work_.counters.factorizations;
    LinearSolver& solver = equations_.assembler().solver();
    const Factorization f = solver.factorize();
    if (solver.symmetry() == Symmetry::unsymmetric) return f.status == FactorStatus::ok;
    if (f.status == FactorStatus::ok && f.negative_pivots == 0) return true;
    // A neutral mode (a rod that may spin about its axis) comes out on either side of zero by rounding.
    const VectorX mode = lowest_mode(0);
    VectorX image(mode.size()), greatest(mode.size());
    const auto view = [](VectorX& v) { return std::span<double>(v.data(), static_cast<std::size_t>(v.size())); };
    const std::span<const double> direction(mode.data(), static_cast<std::size_t>(mode.size()));
    solver.multiply(direction, view(image));
    const VectorX size = mode.cwiseAbs();
    for (double& value : solver.values()) value = std::abs(value);
    solver.multiply({size.data(), static_cast<std::size_t>(size.size())}, view(greatest));
    return mode.dot(image) > -64.0 * std::numeric_limits<double>::epsilon() * size.dot(greatest);
  }

  /// Direction of most negative curvature against mass, by inverse iteration on a matrix shifted until it is
  /// definite. Needs the matrix of the last evaluation.
  VectorX lowest_mode(int seed) {
    const Model& model = equations_.model();
    LinearSolver& solver = equations_.assembler().solver();
    const VectorX weight = equations_.mass().rows.cwiseMax(1e-300);
    double stiffness = 0.0;
    for (int i = 0; i < model.dof_count; ++i)
      stiffness = std::max(stiffness, equations_.assembler().diagonal(i) / weight(i));
    VectorX shift;
    for (double damping = 1e-16 * stiffness; damping < 1e3 * stiffness; damping *= 2.0) {
      shift = damping * weight;
      const Factorization f = solver.factorize({shift.data(), static_cast<std::size_t>(shift.size())});
      if (f.status == FactorStatus::ok && f.negative_pivots == 0) break;
    }
    std::mt19937 random(static_cast<unsigned>(seed + 1));
    std::normal_distribution<double> normal;
    VectorX direction(model.dof_count);
    for (Eigen::Index i = 0; i < direction.size(); ++i) direction(i) = normal(random);
    for (int k = 0; k < 20; ++k) {
      direction = direction.cwiseProduct(weight);
      equations_.assembler().project(direction);
      solver.solve({direction.data(), static_cast<std::size_t>(direction.size())});
      direction /= direction.norm();
    }
    return direction;
  }

  void leave_saddle(int seed) {
    begin();
    equations_.evaluate(state_.q, true, nullptr, work_.evaluation);
    VectorX direction = lowest_mode(seed);
    direction *= 1e-3 * equations_.model().length_scale / std::max(newton_.displacement(direction), 1e-300);
    direction *= newton_.cap(direction);
    accept(state_.q + direction);
  }

  /// What the potential rounds to where little of it is left: a coil that relaxes into its natural shape ends at none.
  double least_energy() const { return 1e-14 * energy_scale_; }

  Equations& equations_;
  const Newton& newton_;
  const Options& options_;
  const Parameters& parameters_;
  State& state_;
  NewtonWorkspace& work_;
  double energy_scale_ = 0.0;  ///< greatest potential met [J]
  Configuration scratch_;
  std::vector<Vector3> full_loads_;
  double lowest_ = 0.0;
};

}  // namespace

StaticResult find_equilibrium(Equations& equations, const Newton& newton, const Options& options,
                              const Parameters& parameters, const Boundary& boundary, State& state,
                              NewtonWorkspace& work) {
  return Statics(equations, newton, options, parameters, state, work).run(boundary);
}

}  // namespace withe
