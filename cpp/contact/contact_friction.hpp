#pragma once
/// Friction of the contacts of a step: see friction.hpp.

#include "contact/contact_linearisation.hpp"
#include "contact/contact_problem.hpp"
#include "contact/friction.hpp"

namespace withe {

/// True if friction grows with slip, so that its slip tolerance can be made greater for a while.
bool regularises_friction(const Model& model);
/// K / (2 dt), over the factor of the slip tolerance [1/m].
double slip_rate(const ContactProblem& problem, double regularisation);
/// True if there is friction on a contact in a step, of a kind or at all.
bool has_friction(const ContactProblem& problem, const Touching& t, FrictionKind kind);
bool rubs(const ContactProblem& problem, const Touching& t);
/// Stiffness of an anchor, for a contact of that stiffness [N/m].
double anchor_stiffness(const ContactPair& pair, FrictionKind kind, double stiffness);
/// Friction setting of a pressing contact, or of a lagged one in its state at the start. `regularisation`, `predicted`:
/// see `ContactLinearisation`; their references must outlive the setting.
FrictionSetting friction_setting(const ContactProblem& problem, const Touching& t, FrictionKind kind,
                                 double regularisation, const Vec3d* predicted);
/// Friction by the slip, at most [N/m].
double friction_slope(const ContactProblem& problem, const Touching& t, const ContactLinearisation& linearisation);
/// Adds minus the friction on a contact, and optionally its derivative. Returns false without friction.
bool add_friction(const ContactProblem& problem, const Touching& t, const ContactLinearisation& linearisation,
                  bool with_hessian, ContactLocal& out);
/// Work of anchors over the change of their elastic slip; with `mean`, of the mean force of both ends [J].
double anchor_work(const ContactProblem& problem, const Touching& t, bool mean);
/// Energy of an anchor at the end of a step, zero if the contact opens [J].
double anchor_energy(const ContactProblem& problem, const Touching& t);
/// Energy of an anchor at the start of a step: all of the last step, also if the surfaces now press too little for it.
/// The next step takes that, and counts it.
double kept_anchor_energy(const ContactProblem& problem, const Touching& t);
/// Work of an obstacle's turning against friction [J].
double turning_work(const ContactProblem& problem, const Touching& t);
/// Notes friction at the end of the step, where it is not lagged.
void record_friction(const ContactProblem& problem, const Touching& t, ContactRecord& record);
/// The same of a lagged one.
void record_lagged_friction(const ContactProblem& problem, const Touching& t, ContactRecord& record);

/// A contact's slip, its change by a change of the unknowns, and the friction on it.
struct Slipping {
  Vec3d slip{}, change{};
  ForceLaw law;
  double limit = 0;  ///< [N]
};
Slipping slipping(const ContactProblem& problem, const Touching& t, FrictionKind kind,
                  const ContactLinearisation& linearisation, const VectorX& change);
/// True if `change` makes all surfaces slip so little that the tangent is accurate.
bool slips_shortly(const ContactProblem& problem, const ContactLinearisation& linearisation, const VectorX& change);

/// Friction with J of the start, where frames have not turned yet, for contacts at the start.
LaggedFriction lag_friction(const ContactProblem& problem, const Touching& t);

}  // namespace withe
