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
  /// Derivative by the rest length of each edge, at fixed natural curvature and twist [1/m]. The rest length changes
  /// lengths of stencils, masses, drag and loads along the edge. Only for rods outside of fluids, and not for chords of
  /// arcs.
  VectorX rest_length;
  /// Derivative by the turn of the frame of each edge in the drawing, a rotation vector, at the same natural shape
  /// [1/rad]. The frame changes the attachment of joints and clamps, the drawn strains where rods meet, and follower
  /// loads.
  MatrixX3 edge_turn;
  /// Derivatives by the drawn natural shapes, as far as drawn strains where rods meet are measured from them.
  std::vector<MatrixX2> drawn_curvature;
  std::vector<VectorX> drawn_twist;
};

ParameterGradient parameter_gradient(const Model& model, const Parameters& parameters, const CoefficientAdjoint& by);

}  // namespace withe
