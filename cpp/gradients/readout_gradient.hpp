#pragma once
/// Maps derivatives by read-outs to derivatives by the state, and by coefficients that enter a read-out directly. A
/// tension EA (l/L - 1) depends on EA, and a curvature on the natural curvature.

#include "assembly/assembler.hpp"
#include "gradients/step_gradient.hpp"

namespace withe {

/// Derivatives of a scalar by the read-outs of `World`; an empty member means zero. Stencils are in the order of rods.
struct ReadoutAdjoint {
  MatrixX3 positions, velocities;  ///< per node [1/m], [s/m]
  MatrixX9 directors;              ///< per edge, by d1, d2, tangent
  MatrixX2 curvatures;             ///< per stencil [m]
  VectorX twists;                  ///< per stencil [m/rad]
  VectorX tensions, spins;         ///< per edge [1/N], [s/rad]
  SupportAdjoint reactions;        ///< by the reactions of the step that led to the state

  /// Throws std::invalid_argument if a size differs from the model.
  void check(const Model& model) const;
  bool has_reactions() const { return reactions.forces.size() != 0 || reactions.moments.size() != 0; }
  /// True if a member other than reactions, velocities and positions is set.
  bool needs_state() const {
    return directors.size() != 0 || curvatures.size() != 0 || twists.size() != 0 || tensions.size() != 0;
  }
};

/// True if the scalar of a planar scene depends on motion out of the plane, for which there are no unknowns.
bool leaves_plane(const Model& model, const State& state, const ReadoutAdjoint& by);

/// Adds derivatives by positions, velocities and spins, which are unknowns.
void add_unknowns(const Model& model, const ReadoutAdjoint& by, StateAdjoint& out);

/// Adds derivatives by all other read-outs except reactions. The tables of the model's `assembler` locate the unknowns
/// of stencils.
void add_readouts(const Model& model, const Assembler& assembler, const Parameters& parameters, const State& state,
                  const ReadoutAdjoint& by, StateAdjoint& out, CoefficientAdjoint& coefficients);

}  // namespace withe
