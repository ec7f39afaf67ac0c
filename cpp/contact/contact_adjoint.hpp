#pragma once
/// Derivatives of a contact's forces by the inputs of a step, times a vector: the part of contact in the adjoint
/// method. Second derivatives use the existing Jacobian where possible, and dual numbers elsewhere.

#include "contact/contact_problem.hpp"

namespace withe {

/// rows^T times the derivatives of minus the forces of a contact, at fixed q1.
struct ContactAdjoint {
  /// By its unknowns at the start of the step, and by their rates; frames are transported from the tangents there.
  double start[kContactUnknowns] = {}, velocity[kContactUnknowns] = {};
  double approach = 0;        ///< by the approach speed of its record at the start [s/m]
  double friction[3] = {};    ///< by its coefficients, see `SurfaceParameters::obstacle_friction`
  double rolling = 0;         ///< by its coefficient of rolling friction
  double slip_tolerance = 0;  ///< [s/m]
  double gravity = 0;         ///< by the magnitude of gravity [s^2/m]
  double mass = 0;            ///< by the mass at the contact, `ContactProblem::mass_of` [1/kg]
};

/// `rows` are in the contact's unknowns, zero for missing ones. `by_approach` is the derivative by the approach speed
/// of its record at the end. Throws std::invalid_argument if the derivative is not available.
ContactAdjoint contact_adjoint(const ContactProblem& problem, const Touching& t, const double (&rows)[kContactUnknowns],
                               double by_approach);

}  // namespace withe
