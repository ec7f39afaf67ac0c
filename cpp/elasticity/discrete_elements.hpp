#pragma once
/// Discrete gradients of one stencil over a step, in its own unknowns (see elements.hpp): forces whose work equals the
/// change of the energy. Derivatives are by the middle of the step. The end moves twice as far as the middle.
///   stretching: EA (eps0 + eps1) / 2 (e0 + e1) / (|e0| + |e1|)   [Simo, Tarnow and Doblare 1995];
///   bending, twisting: moments between frames, see discrete_gradient.hpp. A frame's row is the moment on it.

#include "elasticity/elements.hpp"
#include "elasticity/stretch.hpp"

namespace withe {

/// A step that is evaluated in the middle. Angles are measured from the frames of the start.
struct DiscreteStep {
  const Configuration &start, &middle, &end;
  const VectorX& end_q;
  const VectorX& change;  ///< change of the unknowns from the start to the end
  /// True if torques act on nodes through the transport of the directors. If false, forces do not change when
  /// the start and the end are exchanged.
  bool transported = true;
};

/// Force of an edge's mean strain.
struct MeanStretch {
  double force;         ///< EA (eps0 + eps1) / 2 [N]
  double modulus;       ///< EA / L [N / m]
  double inverse_mean;  ///< 2 / (l0 + l1) [1 / m]
};
inline MeanStretch mean_stretch(const Model& model, const ElasticCoefficients& elastic, const Configuration& start,
                                const Configuration& end, int edge) {
  const double EA = elastic.stretch_stiffness[edge], rest = model.edge_length[edge];
  const double sum = start.length[edge] + end.length[edge];
  return {axial_force(0.5 * sum, rest, EA, elastic.stretch_natural[edge]), EA / rest, 2.0 / sum};
}

/// Arm of a hinge: the torque on the hinge is m . arm for a moment m on the carried frame. The frame turns by the
/// Cayley vector w, and the hinge behind it by `angle` about `axis`. Together they rotate the carried frame by the
/// Cayley vector w + angle arm.
struct HingeArm {
  Vector3 arm;
  Matrix3 by_frame;  ///< derivative by w
  Vector3 by_angle;
};
HingeArm hinge_arm(const Vector3& w, const Vector3& axis, double angle);

/// `given_force`: axial force per edge for the matrix, instead of that of the mean strain, see add_stretch_hessian; or
/// null.
void discrete_stretch_local(const Model& model, const ElasticCoefficients& elastic, const DiscreteStep& step, int edge,
                            bool with_matrix, const double* given_force, Local& out);
void discrete_bend_local(const Model& model, const TurnCoefficients& elastic, const DiscreteStep& step, int stencil,
                         bool with_matrix, Local& out);
void discrete_half_local(const Model& model, const TurnCoefficients& elastic, const DiscreteStep& step, int stencil,
                         bool with_matrix, Local& out);

/// Frame that an edge is attached to, at both ends of a step, and the strains between edge and frame.
struct AttachedStep {
  EdgeFrame<double> start, end;
  Vec3d start_strain, end_strain;
  bool first;  ///< true if the stencil goes from the frame to the edge
};

/// Force of a half stencil with a prescribed frame, in the unknowns of its edge alone: tail, angle and head, or in a
/// plane tail and head. Returns the moment on the frame, whose work is that over the Cayley vector of its turn.
Vector3 discrete_held_local(const Model& model, const TurnCoefficients& elastic, const DiscreteStep& step, int edge,
                            const AttachedStep& hold, bool with_matrix, Local& out);
/// Derivatives of these rows (tail, angle and head, or in a plane tail and head) as the frame of the edge
/// turns at the end of the step, by a rotation vector [N/rad], [N m/rad].
Eigen::Matrix<double, 7, 3> discrete_held_spin(const Model& model, const TurnCoefficients& elastic,
                                               const DiscreteStep& step, int edge, const AttachedStep& hold);
/// Derivatives of the rows of a half stencil as an attached part turns against its frame; hinge axes do not turn.
/// In a plane tail, head and frame, by the normal.
Eigen::Matrix<double, kMaxLocal, 3> discrete_half_spin(const Model& model, const TurnCoefficients& elastic,
                                                       const DiscreteStep& step, int stencil);

}  // namespace withe
