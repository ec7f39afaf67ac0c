#pragma once
/// Inertia of an edge about itself, on any scalar: packs of edges, or dual numbers for its derivatives. Its moment of
/// inertia is of the same type, or a double.

#include "geometry/finite_turn.hpp"
#include "geometry/frames.hpp"

namespace withe {

/// An edge in a step: its frame at z, its vectors at the start and (only for the midpoint rules) at the end, and the
/// motion of its angle.
template <class Scalar>
struct TurningEdge {
  Vec3<Scalar> tangent, spin;  ///< at z
  Scalar inverse_length;
  Vec3<Scalar> start_tangent, end_tangent;
  Scalar start_length, end_length;  ///< energy-momentum steps only
  Scalar change;                    ///< change of the angle from the start to z
  Scalar start_rate;                ///< [rad/s]
};

/// Contribution to the rows of the head (and minus it to those of the tail) and of the angle.
template <class Scalar>
struct TurningForce {
  Vec3<Scalar> head;
  Scalar torque;
};

/// An edge that spins at omega and turns also needs the couple I omega t x dt/dt: nodal forces +- I omega (dt/dt x t) /
/// l, which do no work. The result is the force at its head. `rate`: rate of the vector of the edge.
template <class Scalar, class Number>
Vec3<Scalar> spin_couple(const Number& inertia, const Scalar& omega, const Vec3<Scalar>& rate,
                         const Vec3<Scalar>& tangent, const Scalar& inverse_length) {
  return (inertia * omega * inverse_length * inverse_length) * cross(rate, tangent);
}

/// Inertia of a step of backward Euler over h. The edge turns by psi = theta + spin . e. Its inertia acts on the nodes
/// in the same way as its elastic torque. It does no work either, since spin is normal to the edge at the start and at
/// z.
template <class Scalar, class Number>
[[gnu::always_inline]] inline TurningForce<Scalar> euler_turning(const Number& inertia, double interval,
                                                                 const TurningEdge<Scalar>& edge,
                                                                 const Vec3<Scalar>& moved) {
  const double inverse = 1.0 / interval;
  const Scalar omega = inverse * edge.change;
  const Scalar torque = inertia * (omega - edge.start_rate) * inverse;
  return {spin_couple(inertia, omega, Scalar(inverse) * moved, edge.tangent, edge.inverse_length) + torque * edge.spin,
          torque};
}

/// Inertia of a step under the midpoint rules over dt, such that angular momentum is conserved exactly. The spin's part
/// of it, I omega t, changes in a step by dt m with m = I (omega1 t1 - omega0 t0) / dt. The moment m acts on the nodes
/// and the angle of the edge like any other moment, about the edge's position in the middle of the step. In
/// energy-momentum steps omega is 2 tan(D theta / 2) / dt, as in a rigid rotation of the whole. An axial force that
/// vanishes with the square of the step makes the work of m equal to the change of kinetic energy.
template <class Scalar, class Number>
[[gnu::always_inline]] inline TurningForce<Scalar> midpoint_turning(const Number& inertia, double dt,
                                                                    bool conserves_energy,
                                                                    const TurningEdge<Scalar>& edge) {
  const double inverse = 1.0 / dt;
  const Scalar change = 2.0 * edge.change;
  const Scalar turn = conserves_energy ? finite_turn(change) : change;
  const Vec3<Scalar>&t0 = edge.start_tangent, &t1 = edge.end_tangent;
  const Vec3<Scalar> moment =
      Scalar(inertia * inverse) * ((2.0 * inverse * turn - edge.start_rate) * t1 - edge.start_rate * t0);
  const Scalar torque = dot(moment, edge.tangent);
  Vec3<Scalar> force = edge.inverse_length * cross(moment, edge.tangent);
  // The torque on an edge also acts on its nodes, through spin . e. The torque of inertia cancels the effect of all
  // others.
  force += torque * edge.spin;
  if (conserves_energy) {
    const Vec3<Scalar> apart = t1 - t0;
    const Scalar mean = 0.5 * (edge.start_length + edge.end_length), cosine = 0.5 * dot(t0 + t1, edge.tangent);
    const Scalar rate = inverse * turn;
    force -= (inertia * rate * rate * dot(apart, apart) / (4.0 * mean * cosine)) * edge.tangent;
  }
  return {force, torque};
}

}  // namespace withe
