#pragma once
/// Work of contact over a step: forces per unknown, and their work.

#include "contact/contact_set.hpp"

namespace withe {

/// Energy that pressing has added over a step that ends at the set's q, `change` after its start: more than it stored
/// before, and friction apart [J]. Below zero along a straight way onto a surface; above it where surfaces slide over a
/// summit.
double pressing_gain(const ContactProblem& problem, const ContactSet& set, const VectorX& change);
/// Energy that friction dissipates over such a step, without the energy that anchors store [J].
double friction_loss(const ContactProblem& problem, const ContactSet& set, const VectorX& change);
/// The same of an explicit step, whose velocities change by the mean of the forces at both its ends; `start`, `end`:
/// `friction_force` there.
double mean_friction_loss(const ContactProblem& problem, const ContactSet& set, const VectorX& change,
                          const VectorX& start, const VectorX& end);
/// Minus the generalised forces of friction; empty without friction.
void friction_force(const ContactProblem& problem, const ContactSet& set, VectorX& out);
/// Minus the generalised forces of all contact.
void contact_force(const ContactProblem& problem, const ContactSet& set, VectorX& out);
/// Work of moving obstacles on rods and on the stored contact energy [J].
double obstacle_work(const ContactProblem& problem, const ContactSet& set);

}  // namespace withe
