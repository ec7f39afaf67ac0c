#pragma once
/// Derivatives of a contact's forces by what a step is given, times a vector: the part of contact in the adjoint
/// method. Second derivatives by hand where the Jacobian has them already, dual numbers elsewhere.

#include "contact/contact_problem.hpp"

namespace withe {

/// rows^T times the derivatives of minus the forces of a contact, at fixed q1.
struct ContactAdjoint {
  /// By its unknowns at the start of the step, and by their rates; frames are transported from the tangents there.
  double start[kContactUnknowns] = {}, velocity[kContactUnknowns] = {};
  double approach = 0;        ///< by the speed of approach that its record had at the start [s/m]
  double friction[3] = {};    ///< by its coefficients, see `SurfaceParameters::obstacle_friction`
  double rolling = 0;         ///< by its coefficient of rolling friction
  double slip_tolerance = 0;  ///< [s/m]
  double gravity = 0;         ///< by its size [s^2/m]
  double mass = 0;            ///< by what the contact holds up, `ContactProblem::mass_of` [1/kg]
};

/// `rows`: in the contact's unknowns, zero where there is none. `by_approach`: what the speed of approach does that its
/// record has at the end. Throws std::invalid_argument where it is not known.
ContactAdjoint contact_adjoint(const ContactProblem& problem, const Touching& t, const double (&rows)[kContactUnknowns],
                               double by_approach);

}  // namespace withe
