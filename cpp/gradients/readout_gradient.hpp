#pragma once
/// From derivatives by what is read out of a state to those by the state itself, and by coefficients as far as these
/// enter the read-out directly: a tension EA (l/L - 1) by EA, a curvature by the natural one.

#include "assembly/assembler.hpp"
#include "gradients/step_gradient.hpp"

namespace withe {

/// Derivatives of a scalar by what `World` reads out; what is empty does not count. Stencils are those of one rod after
/// the other.
struct ReadoutAdjoint {
  MatrixX3 positions, velocities;  ///< per node [1/m], [s/m]
  MatrixX9 directors;              ///< per edge, by d1, d2, tangent
  MatrixX2 curvatures;             ///< per stencil [m]
  VectorX twists;                  ///< per stencil [m/rad]
  VectorX tensions, spins;         ///< per edge [1/N], [s/rad]
  SupportAdjoint reactions;        ///< those of the step that led to the state

  /// Throws std::invalid_argument where something has another size than the model.
  void check(const Model& model) const;
  bool has_reactions() const { return reactions.forces.size() != 0 || reactions.moments.size() != 0; }
  /// True if anything but reactions and velocities asks for where the state is, beyond positions of nodes.
  bool needs_state() const {
    return directors.size() != 0 || curvatures.size() != 0 || twists.size() != 0 || tensions.size() != 0;
  }
};

/// True if a scalar of a planar scene goes by what would leave the plane, which its unknowns do not have.
bool leaves_plane(const Model& model, const State& state, const ReadoutAdjoint& by);

/// Adds what positions, velocities and spins say, which are unknowns.
void add_unknowns(const Model& model, const ReadoutAdjoint& by, StateAdjoint& out);

/// Adds what all the others say but the reactions; `assembler`: of the model, whose tables say where the unknowns of
/// stencils are.
void add_readouts(const Model& model, const Assembler& assembler, const Parameters& parameters, const State& state,
                  const ReadoutAdjoint& by, StateAdjoint& out, CoefficientAdjoint& coefficients);

}  // namespace withe
