#pragma once
/// From derivatives by the coefficients of steps to those by the parameters that a user sets.

#include "steps/step_adjoint.hpp"

namespace withe {

/// Derivatives of a scalar by `Parameters` and by the values of loads, shaped like them.
struct ParameterGradient : PartNumbers {
  VectorX edge_stretch;
  MatrixX2 edge_bend;
  VectorX edge_twist, edge_density, edge_rotary, edge_viscous_time, edge_drag;
  VectorX added_mass;
  Vector3 gravity = Vector3::Zero();
  std::vector<MatrixX2> natural_curvature;
  std::vector<VectorX> natural_twist, natural_stretch;
  MatrixX3 loads;
  double fluid_viscosity = 0, friction = 0, slip_tolerance = 0;
  MatrixX3 obstacle_friction, pair_friction;
  VectorX obstacle_rolling;
  MatrixX6 hand_stiffness;  ///< per support, see `HandDescription`
  VectorX hand_limit;
  /// Per edge, of rods outside of fluids that are no chords of arcs: by its rest length, and so by lengths of stencils,
  /// masses, drag and loads along it, at fixed natural curvature and twist [1/m].
  VectorX rest_length;
  /// Per edge, by how its frame is turned in the drawing, a rotation vector: by what joints and clamps attach, strains
  /// that a drawing has where rods meet, and loads that follow, at the same natural shape [1/rad].
  MatrixX3 edge_turn;
  /// By the natural shapes that were drawn, as far as what was drawn where rods meet is counted from them.
  std::vector<MatrixX2> drawn_curvature;
  std::vector<VectorX> drawn_twist;
};

ParameterGradient parameter_gradient(const Model& model, const Parameters& parameters, const CoefficientAdjoint& by);

}  // namespace withe
