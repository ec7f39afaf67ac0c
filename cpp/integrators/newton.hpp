#pragma once
/// Newton's method for one step, mixed in the axial forces.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "integrators/equations.hpp"

namespace withe {

struct Counters {
  long iterations = 0, factorizations = 0;
  double assembly_time = 0, solve_time = 0, fluid_time = 0;  ///< [s]
};

struct NewtonResult {
  bool converged = false;
  int iterations = 0;
  double residual = 0;  ///< greatest force out of balance [N]
  int worst_row = -1;
  double step = 0;   ///< greatest displacement of the last iteration [m]
  bool cut = false;  ///< less than half of the first step was kept, beside surfaces
};

/// How small the residuals are.
struct Balance {
  bool relative = true;  ///< all below the tolerance times the forces in the scene
  bool floor = true;     ///< all within what rounding leaves
  bool either = true;    ///< each one or the other
};

/// Where the matrix of an iteration was made: there, at an earlier iterate, or in an earlier time step.
enum class MatrixAge { fresh, within, across };

/// How a start has served that need not lead to the solution: what misses time and again is tried ever more rarely.
struct StartRecord {
  int misses = 0;  ///< in a row
  int waits = 0;   ///< solves to come without it

  bool skipped() { return waits > 0 && waits-- > 0; }
  void note(bool converged) {
    constexpr int kMostMisses = 6;
    misses = converged ? 0 : std::min(misses + 1, kMostMisses);
    waits = (1 << misses) - 1;
  }
};

/// How well factorisations and initial guesses have served.
struct NewtonHistory {
  double interval = 0;                                  ///< that a factorisation belongs to [s]
  std::array<double, 3> contraction{1e-2, 1e-2, 1e-2};  ///< per MatrixAge: error after an iteration over error before
  int waited = 0;                                       ///< time steps since one was last tried across
  bool tired = false;                                   ///< served the last time step slowly
  int plain_solves = 0;                                 ///< still to come before the mixed method is tried again
  std::array<StartRecord, 5> starts{};                  ///< per start of find_inner
  StartRecord cut;                                      ///< of those whose first step is cut
};

/// What the factorisation in a solver belongs to, and that history.
struct FactorRecord : NewtonHistory {
  const Equations* owner = nullptr;  ///< nothing: not to be used again
  int generation = 0;                ///< of the solver
};

/// Scratch of the solver; owned by the world, so that a step does not allocate.
struct NewtonWorkspace {
  Evaluation evaluation;
  VectorX step, axial_force, trial, next_step;
  FactorRecord factor;
  double finest = INFINITY;  ///< [m], a step tolerance that error control wants; that of the options is an upper bound
  Counters counters;
  std::function<void()> poll = [] {};  ///< asked once an iteration; what it throws ends the solve
};

/// A solution foreseen from another one on the same path, with its axial forces in work.axial_force. A guess that is
/// near enough is drawn in fast: where the first correction is longer than the prediction, or the corrections do not
/// halve, the path is lost, or another one not far [Deuflhard 2011, section 5.1].
struct Prediction {
  double length = 0;   ///< greatest displacement from the known solution [m]
  bool strict = true;  ///< whether to give up where the path may be lost
  double enough = 0;   ///< a correction after which no other is needed, for a point on the way [m]
};

class Newton {
 public:
  Newton(const Model& model, const Options& options);

  /// Finds z with F(z) = target (nothing: zero), starting at z. `mixed`: with the axial forces as unknowns of
  /// their own, where the options allow it. `interval`: of a time step, whose matrix may serve several iterations and
  /// the steps to come, as long as it makes steps small fast (0: a new one every iteration); the mixed method then sets
  /// out from work.axial_force. `impatient`: gives up where the first step is `cut`. `predicted`: how z was found, if
  /// it was from another solution.
  NewtonResult solve(Equations& equations, VectorX& z, const VectorX* target, int max_iterations, NewtonWorkspace& work,
                     bool mixed = true, double interval = 0.0, bool impatient = false,
                     const Prediction* predicted = nullptr) const;
  /// Whether residuals are small enough; also notes the worst one in `result`.
  Balance balance(const Evaluation& evaluation, NewtonResult& result) const;
  /// Factor by which a step is shortened, so that nothing moves or turns too far at once.
  double cap(const VectorX& step) const;
  double displacement(const VectorX& step) const;
  /// Greatest turn of an edge against its length [rad], or half the greatest rotation about a tangent or of a frame.
  double turn(const VectorX& step) const;
  /// Of the matrix as it is; a free mode (a rod that may spin about its axis) is held by a shift far below every
  /// stiffness.
  bool factorize(Equations& equations, NewtonWorkspace& work) const;
  /// Whether `cap` surely leaves a step alone in which no node moves, and nothing turns, by more than `most`.
  bool leaves_alone(double most) const { return most <= 0.5 * std::min({edge_scale_, model_.length_scale, 3.0}); }

  const std::vector<bool>& is_angle() const { return is_angle_; }

 private:
  double greatest_edge_turn(const VectorX& step) const;
  struct Progress;
  static bool loses_path(const Prediction& predicted, const Progress& progress, bool first);
  void plan_next(Progress& progress, FactorRecord& factor) const;
  double tolerance(const NewtonWorkspace& work) const {
    return std::min(options_.step_tolerance * model_.length_scale, work.finest);
  }
  static void evaluate_at(Equations& equations, const VectorX& z, bool matrix, const double* axial,
                          const VectorX* target, NewtonWorkspace& work);
  static void solve_for_step(Equations& equations, NewtonWorkspace& work, VectorX& step);
  /// How much of a step between surfaces is kept, and what is known of where it leads.
  struct Search {
    double kept = 1.0;
    bool evaluated = false;  ///< work.trial and work.evaluation
    bool solved = false;     ///< work.next_step, with the same matrix
    bool remade = false;     ///< the step, with a matrix that lacks geometric stiffness
  };
  /// What a step between surfaces must do to be kept.
  struct Demand {
    bool nearer = false;  ///< to the solution: to lead downhill is not enough
    double least = 0.0;   ///< more than this share of it
  };
  bool step_between_surfaces(Equations& equations, const VectorX& z, const VectorX* target, Demand demand,
                             double& shorten, NewtonWorkspace& work, Search& found) const;
  Search search(Equations& equations, const VectorX& z, const VectorX* target, Demand demand, double shorten,
                NewtonWorkspace& work) const;
  double shortened(Equations& equations, const VectorX& z, VectorX& step) const;
  double line_search(Equations& equations, const VectorX& z, const VectorX& step, const VectorX* target,
                     NewtonWorkspace& work) const;

  const Model& model_;
  Options options_;
  /// Unknowns that are one vector: a node's position, a frame's rotation, an angle.
  struct Block {
    int first, size;
  };
  double greatest(const std::vector<Block>& blocks, const VectorX& step) const;
  std::vector<bool> is_angle_;
  std::vector<Block> nodes_, angles_;
  double edge_scale_ = 1.0;
};

}  // namespace withe
