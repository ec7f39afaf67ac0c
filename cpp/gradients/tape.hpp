#pragma once
/// A run as the adjoint method needs it: what each step led to, so that states come again without a solve.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gradients/parameter_gradient.hpp"
#include "gradients/step_gradient.hpp"

namespace withe {

/// Derivatives of a scalar by the state that a run began with.
struct InitialGradient {
  MatrixX3 positions;   ///< per node [1/m]; directors turn along with their edges, without spin
  MatrixX3 velocities;  ///< per node [s/m]
};

struct RunGradient {
  ParameterGradient parameters;
  InitialGradient initial;
};

/// Derivatives of the state at the end of a run by that at its start and by what acts, a row each for the numbers of a
/// state vector (state_vector.hpp).
struct RunJacobian {
  MatrixX state;
  std::vector<RunGradient> rows;  ///< without the state at the start
};

/// What a scalar depends on at a moment of a run: after so many steps.
struct MomentAdjoint {
  long steps = 0;
  MatrixX3 positions, velocities;  ///< per node; or empty
};

/// Adds to the places of nodes what is given per node, in the axes of space.
void add_to_nodes(const Model& model, const MatrixX3& by, VectorX& out);

class Tape {
 public:
  /// Of a run that begins so; these are kept.
  Tape(const Model& model, EquationOptions options, State first, Parameters parameters);

  long count() const { return static_cast<long>(steps_.size()); }
  /// Notes a step to q1 that has been accepted, at whose end the state is `after`; `unknown`: why no gradient goes
  /// through it, unless it is cut off again.
  void record(StepRule rule, double duration, const VectorX& end, const State& after, const char* unknown = nullptr);
  /// Forgets all but so many.
  void cut(long count, const State& after);
  /// Says why no gradient goes through this run; the first reason stays.
  void refuse(const std::string& why);
  /// Whether that is what the last step led to, and what acts is what acted.
  bool continues(const State& state, const Parameters& parameters) const;

  /// Throws std::invalid_argument where none is known.
  RunGradient gradient(std::vector<MomentAdjoint> moments) const;
  /// Likewise; costs a solve of each step for every row.
  RunJacobian jacobian() const;

 private:
  struct Step {
    StepRule rule;
    double duration;
    VectorX end;
    VectorX held;  ///< velocities at its end of what supports hold, one after the other; none: they rest, as before it
    std::vector<ContactRecord> contacts;  ///< at its end
    const char* unknown;                  ///< why no gradient goes through it, if so
  };
  class Player;
  VectorX held_velocities(const VectorX& v) const;

  void check_known() const;
  /// Goes back through the steps: `visit(k, gradient)` with that of step k, begun.
  void walk_back(const std::function<void(std::size_t, StepGradient&)>& visit) const;

  Model model_;
  EquationOptions options_;
  State first_;
  Parameters parameters_;
  std::vector<Step> steps_;
  VectorX last_, last_velocity_;  ///< what the last step led to
  std::string refused_;
};

}  // namespace withe
