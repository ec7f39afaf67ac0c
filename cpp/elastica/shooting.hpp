#pragma once
/// Multiple shooting. A boundary value problem is cut into segments, and Newton's method solves for the states at the
/// cuts and a few parameters together. Single shooting multiplies an error of its parameters by exp(growth x length).
/// In multiple shooting no error grows over more than one segment, and the linear systems are solved with pivots across
/// the cuts [Ascher, Mattheij, Russell 1995, chapters 4.3 and 7.2].

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "common/dual.hpp"

namespace withe {

/// States at the cuts, the first one given by the problem, the last one at the tip; and the parameters.
template <int states, int parameters>
struct ShootingPath {
  std::vector<std::array<double, states>> nodes;
  std::array<double, parameters> values{};
};

/// The linearised equations: A dy(k) + B dp - dy(k + 1) = -gap of link k, and C dy(last) + D dp = -gap of the end.
template <int states, int parameters>
struct ShootingSystem {
  struct Link {
    double by_state[states][states], by_parameters[states][parameters], gap[states];
  };
  std::vector<Link> links;
  double end_by_state[parameters][states], end_by_parameters[parameters][parameters], end_gap[parameters];

  double residual() const {
    double largest = 0;
    const auto see = [&largest](double gap) {
      largest = std::isfinite(gap) ? std::max(largest, std::abs(gap)) : 1e300;
    };
    for (const Link& link : links)
      for (double gap : link.gap) see(gap);
    for (double gap : end_gap) see(gap);
    return largest;
  }
};

/// Solves the linearised equations by elimination from the start to the tip with partial pivoting over two links.
template <int states, int parameters>
class ShootingElimination {
 public:
  using System = ShootingSystem<states, parameters>;
  using Path = ShootingPath<states, parameters>;

  /// `step` receives the change of all nodes (0 at the first) and parameters; returns false if the system is singular.
  bool solve(const System& system, Path& step) {
    const std::size_t links = system.links.size();
    kept_.resize(links);
    step.nodes.resize(links + 1);
    step.nodes[0].fill(0.0);
    // Rows over dy(k + 1), dp and the right-hand side, from which all earlier unknowns are eliminated.
    double carried[states][kCarried] = {};
    put_link(system.links[0], carried);
    for (std::size_t k = 1; k < links; ++k) {
      double rows[2 * states][kRow] = {};
      for (int i = 0; i < states; ++i) {
        for (int j = 0; j < states; ++j) rows[i][j] = carried[i][j];
        for (int j = states; j < kCarried; ++j) rows[i][states + j] = carried[i][j];
        for (int j = 0; j < states; ++j) rows[states + i][j] = system.links[k].by_state[i][j];
        put_rest(system.links[k], i, rows[states + i] + states);
      }
      if (!eliminate<2 * states, kRow>(rows, states)) return false;
      for (int i = 0; i < states; ++i) {
        std::copy(rows[i], rows[i] + kRow, kept_[k][at_row(i)].begin());
        std::copy(rows[states + i] + states, rows[states + i] + kRow, carried[i]);
      }
    }
    return finish(system, carried, step);
  }

 private:
  static constexpr int kCarried = states + parameters + 1, kRow = 2 * states + parameters + 1;
  static constexpr std::size_t at_row(int i) { return static_cast<std::size_t>(i); }

  static void put_rest(const typename System::Link& link, int i, double* row) {
    row[i] = -1.0;
    for (int j = 0; j < parameters; ++j) row[states + j] = link.by_parameters[i][j];
    row[states + parameters] = -link.gap[i];
  }
  static void put_link(const typename System::Link& link, double (&rows)[states][kCarried]) {
    for (int i = 0; i < states; ++i) put_rest(link, i, rows[i]);
  }

  /// Brings the first `columns` columns to upper triangular form.
  template <int count, int width>
  static bool eliminate(double (&rows)[count][width], int columns) {
    for (int c = 0; c < columns; ++c) {
      int pivot = c;
      for (int i = c + 1; i < count; ++i)
        if (std::abs(rows[i][c]) > std::abs(rows[pivot][c])) pivot = i;
      if (!(std::abs(rows[pivot][c]) > 0)) return false;
      if (pivot != c) std::swap_ranges(rows[pivot], rows[pivot] + width, rows[c]);
      for (int i = c + 1; i < count; ++i) {
        const double factor = rows[i][c] / rows[c][c];
        if (factor == 0) continue;
        for (int j = c; j < width; ++j) rows[i][j] -= factor * rows[c][j];
      }
    }
    return true;
  }

  bool finish(const System& system, const double (&carried)[states][kCarried], Path& step) const {
    constexpr int kLast = states + parameters;
    double rows[kLast][kCarried];
    for (int i = 0; i < states; ++i) std::copy(carried[i], carried[i] + kCarried, rows[i]);
    for (int i = 0; i < parameters; ++i) {
      double* row = rows[states + i];
      std::copy(system.end_by_state[i], system.end_by_state[i] + states, row);
      std::copy(system.end_by_parameters[i], system.end_by_parameters[i] + parameters, row + states);
      row[kLast] = -system.end_gap[i];
    }
    if (!eliminate<kLast, kCarried>(rows, kLast)) return false;
    double last[kLast];
    for (int i = kLast - 1; i >= 0; --i) {
      double sum = rows[i][kLast];
      for (int j = i + 1; j < kLast; ++j) sum -= rows[i][j] * last[j];
      last[i] = sum / rows[i][i];
    }
    std::copy(last, last + states, step.nodes.back().begin());
    std::copy(last + states, last + kLast, step.values.begin());
    for (std::size_t k = system.links.size() - 1; k > 0; --k) {
      for (int i = states - 1; i >= 0; --i) {
        const auto& row = kept_[k][at_row(i)];
        double sum = row[kRow - 1];
        for (int j = 0; j < parameters; ++j) sum -= row[at_row(2 * states + j)] * step.values[at_row(j)];
        for (int j = 0; j < states; ++j) sum -= row[at_row(states + j)] * step.nodes[k + 1][at_row(j)];
        for (int j = i + 1; j < states; ++j) sum -= row[at_row(j)] * step.nodes[k][at_row(j)];
        step.nodes[k][at_row(i)] = sum / row[at_row(i)];
      }
    }
    return true;
  }

  std::vector<std::array<std::array<double, kRow>, states>> kept_;
};

struct ShootingOptions {
  int iterations = 20;
  double step_tolerance = 1e-7;  ///< Newton's method converges quadratically: the error after such a step is its square
  double smallest_damping = 1.0 / 64;
  double chord_step = 1e-2;        ///< after a shorter step, a chord iteration (with the same matrix) is tried
  double chord_tolerance = 1e-13;  ///< greatest remaining error, estimated from the rate of both steps
};

struct ShootingOutcome {
  bool converged = false;
  int iterations = 0;
};

/// Newton's method with halved steps. A Problem has kStates, kParameters and
/// `void linearise(const Path&, System&) const`, which fills links and end. The path is left at the last iterate. A
/// Problem that can compute gaps much faster than slopes also has `void put_gaps(const Path&, System&) const`.
template <class Problem>
class ShootingSolver {
 public:
  using Path = ShootingPath<Problem::kStates, Problem::kParameters>;

  ShootingOutcome solve(const Problem& problem, Path& path, const ShootingOptions& options = {}) {
    ShootingOutcome outcome;
    problem.linearise(path, system_);
    double residual = system_.residual();
    while (outcome.iterations < options.iterations) {
      ++outcome.iterations;
      if (!(residual < 1e100) || !elimination_.solve(system_, step_)) return outcome;
      const double size = largest(step_);
      if (!(size < 1e100)) return outcome;
      double damping = 1.0;
      while (true) {
        trial_ = path;
        add(damping, step_, trial_);
        if (size < options.step_tolerance ||
            (damping == 1.0 && size < options.chord_step && chord_ends(problem, size, options))) {
          std::swap(path, trial_);
          outcome.converged = true;
          return outcome;
        }
        problem.linearise(trial_, system_);
        const double next = system_.residual();
        if (next < (1.0 - 0.25 * damping) * residual || next < 1e-11) {
          residual = next;
          break;
        }
        damping /= 2;
        if (damping < options.smallest_damping) return outcome;
      }
      std::swap(path, trial_);
    }
    return outcome;
  }

 private:
  /// After a step of the given size, takes one more with the same matrix. Returns true if this is enough. The rate of
  /// convergence of such steps is the ratio of their sizes.
  bool chord_ends(const Problem& problem, double size, const ShootingOptions& options) {
    if constexpr (requires { problem.put_gaps(trial_, system_); }) {
      problem.put_gaps(trial_, system_);
      if (!elimination_.solve(system_, chord_)) return false;
      const double next = largest(chord_);
      if (!(next * next <= options.chord_tolerance * size)) return false;
      add(1.0, chord_, trial_);
      return true;
    }
    return false;
  }
  static double largest(const Path& step) {
    double size = 0;
    const auto see = [&size](double x) { size = std::isfinite(x) ? std::max(size, std::abs(x)) : 1e300; };
    for (const auto& node : step.nodes)
      for (double x : node) see(x);
    for (double x : step.values) see(x);
    return size;
  }
  static void add(double factor, const Path& step, Path& path) {
    for (std::size_t k = 0; k < path.nodes.size(); ++k)
      for (std::size_t i = 0; i < path.nodes[k].size(); ++i) path.nodes[k][i] += factor * step.nodes[k][i];
    for (std::size_t i = 0; i < path.values.size(); ++i) path.values[i] += factor * step.values[i];
  }

  ShootingSystem<Problem::kStates, Problem::kParameters> system_;
  ShootingElimination<Problem::kStates, Problem::kParameters> elimination_;
  Path step_, chord_, trial_;
};

/// Continuation. `ask(share, guess)` sets the problem at a share of the way from the problem that `path` solves to the
/// requested one, and may change the guess. Steps adapt. Returns false if a step below `least` would be needed. Then
/// `path` solves the last problem that had a solution.
template <class Problem, class Ask>
bool follow(ShootingSolver<Problem>& solver, const Problem& problem, double least,
            typename ShootingSolver<Problem>::Path& path, typename ShootingSolver<Problem>::Path& trial,
            const Ask& ask) {
  double done = 0, step = 1;
  while (done < 1) {
    const double next = std::min(1.0, done + step);
    trial = path;
    ask(next, trial);
    if (solver.solve(problem, trial).converged) {
      std::swap(path, trial);
      done = next;
      step *= 2;
    } else {
      step /= 2;
      if (step < least) return false;
    }
  }
  return true;
}

}  // namespace withe
