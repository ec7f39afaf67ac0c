#pragma once
/// Forces of a hand that yields on one held edge, and their derivatives.

#include "elasticity/bend_twist.hpp"
#include "elasticity/discrete_elements.hpp"
#include "elasticity/put_local.hpp"
#include "forces/hand.hpp"
#include "model/edge_vectors.hpp"
#include "steps/hand_forces.hpp"

namespace withe {

inline Vector3 held_point(const Model& model, const VectorX& q, const TouchedEdge& touched) {
  const Vector3 tail = node_position(model, q, model.edge_tail[at(touched.edge)]),
                head = node_position(model, q, model.edge_head[at(touched.edge)]);
  return tail + touched.place * (head - tail);
}

inline EdgeFrame<double> frame_of(const Matrix3& grip) {
  return {to_vec3(grip.col(2)), to_vec3(grip.col(0)), to_vec3(grip.col(1)), 1.0, {}, {}};
}

/// Displacement of an edge from its pose when it was grasped.
struct Shift {
  Matrix3 grip;       ///< G
  Vector3 point, by;  ///< x [m]; u, in the axes of G [m]
};

inline Shift shift_of(const Model& model, const VectorX& q, const HandState& hand, const SupportPose& pose,
                      const TouchedEdge& touched, std::size_t i) {
  Shift out;
  out.grip = pose.rotation * hand.edges[i];
  out.point = held_point(model, q, touched);
  out.by = out.grip.transpose() * (out.point - pose.position - pose.rotation * hand.points[i]) - hand.slip[i];
  return out;
}

inline Vector3 shift_stiffness(const HandDescription& hand, double share) {
  return share * Vector3(hand.stiffness[0], hand.stiffness[1], hand.stiffness[2]);
}

/// Bending towards d1 turns about d2.
inline BendTwistStiffness<double> turn_stiffness(const HandDescription& hand, double share) {
  return {share * hand.stiffness[4], share * hand.stiffness[3], share * hand.stiffness[5]};
}

/// In a plane a hand turns only about the normal of the plane.
inline double planar_stiffness(const Model& model, const HandDescription& hand, double share, const Matrix3& grip) {
  const Vector3 n = grip.transpose() * model.plane->normal;
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) sum += share * hand.stiffness[at(3 + i)] * n[i] * n[i];
  return sum;
}

/// Direction of the grasped edge, as an edge of unit length in the axes of the plane.
inline PlanarEdge<double> planar_grip(const Model& model, const Matrix3& grip) {
  const Vector3 t = grip.col(2);
  return {{t.dot(model.plane->first), t.dot(model.plane->second)}, 1.0};
}

inline PlanarBend<double> planar_turn(const Model& model, const BendMeasure& measure, const HandDescription& hand,
                                      double share, const Matrix3& grip, const EdgeFrame<double>& edge) {
  const PlanarEdge<double> from = planar_grip(model, grip);
  const double kappa = planar_kappa(from.tangent.x, from.tangent.y, edge.tangent.x, edge.tangent.y);
  return planar_bend(measure, kappa, 0.0, planar_stiffness(model, hand, share, grip));
}

/// Adds derivatives by the held point to the rows of the nodes of its edge.
inline void add_to_point(const Model& model, const TouchedEdge& touched, const Vector3& by, VectorX& out) {
  add_to_node(model, model.edge_tail[at(touched.edge)], (1.0 - touched.place) * by, out);
  add_to_node(model, model.edge_head[at(touched.edge)], touched.place * by, out);
}

/// Converts derivatives by the stiffnesses of both bendings and of twist, or of the one bending in a plane, into
/// derivatives by the stiffnesses about d1, d2, t.
inline void add_turn_stiffness(const Model& model, const Matrix3& grip, double share, const Vector3& by, int support,
                               MatrixX6& out) {
  if (model.planar())
    out.row(support).tail<3>() += share * by.x() * (grip.transpose() * model.plane->normal).cwiseAbs2().transpose();
  else
    out.row(support).tail<3>() += share * Vector3(by.y(), by.x(), by.z()).transpose();
}

/// One edge that a hand holds, in one evaluation.
struct HandForces::Piece {
  const TouchedEdge& touched;
  const HandDescription& hand;
  Shift shift;
  Vector3 stiffness;
  CappedForce elastic;  ///< -f, in the axes of G
  Matrix3 by;           ///< d(-f) / dx
};

/// Attachment of such an edge over an energy-momentum step.
struct HandForces::Grip {
  AttachedStep attached;
  TurnCoefficients elastic;
};

}  // namespace withe
