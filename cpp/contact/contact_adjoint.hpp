#pragma once
/// Derivatives of a contact's forces by what a step is given, times a vector: the part of contact in the adjoint method.
/// Second derivatives by hand where the Jacobian has them already, dual numbers elsewhere.

#include "contact/contact_problem.hpp"

namespace withe {

/// rows^T times the derivatives of minus the forces of a contact, at fixed q1.
struct ContactAdjoint {
  /// By its unknowns at the start of the step; frames are transported from the tangents there.
  double start[kContactUnknowns] = {};
  double along = 0, across = 0;  ///< by coefficients of friction
  double slip_tolerance = 0;     ///< [s/m]
};

/// `rows`: in the contact's unknowns, zero where there is none. Throws std::invalid_argument where it is not known.
ContactAdjoint contact_adjoint(const ContactProblem& problem, const Touching& t,
                               const double (&rows)[kContactUnknowns]);

}  // namespace withe
