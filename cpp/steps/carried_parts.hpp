#pragma once
/// Parts that rigid bodies carry: nodes at fixed places of a body, and bodies that turn about a hinge of another body.
/// Their unknowns follow those of the body, and forces on them act on the body.
///
/// In a step a body turns by the rotation with the Cayley vector w, R1 = cay(w) R0, so a point at R a from the base of
/// the body moves exactly by
///   R1 a - R0 a = w x (R0 a + R1 a) / 2.
/// Under the midpoint rules the node is in the middle of its chord. There its lever is (R0 a + R1 a) / 2, and a force f
/// on it has the moment of this lever, whose work over w is the work of f over the chord. Every discrete gradient of a
/// potential therefore keeps its work, and its zero sum of moments. The lever is not R(w / 2) a, which loses energy.
///
/// A body B on a hinge of a body A turns by w_B = w_A + arm D phi, where the arm is along the mean of the hinge's axes
/// at both ends of the step (`hinge_arm`). A moment on B acts on A, and its product with the arm acts on the angle phi.
///
/// An edge of the surface of a body turns about itself by 2 atan(w . t0 / 2), against a frame that is transported in
/// parallel. Here t0 is its tangent at the start. R1 R0^T is this twist about t0, followed by a rotation about an axis
/// normal to t0. A moment m about the edge is the moment m (t0 + t) / (1 + t0 . t) of the body, where t is the tangent
/// of the edge at z.
///
/// Rows of a frame are moments in energy-momentum steps, else generalised forces S(w)^T m, where S dw is the spin.

#include <vector>

#include "assembly/assembler.hpp"
#include "steps/step_problem.hpp"

namespace withe {

/// Puts all carried parts where their bodies have them at z.
void place_carried(const StepProblem& problem, VectorX& z);

/// Adds the rows of carried parts to those of their bodies, and clears them.
void fold_rows(const StepProblem& problem, const VectorX& z, VectorX& rows, VectorX& magnitude);
/// The same, and sets the derivatives at z of parts on which forces act, one per carried part.
void fold_rows(const StepProblem& problem, const VectorX& z, VectorX& rows, VectorX& magnitude,
               std::vector<Carrying>& carrying);

/// Sets the derivatives at z of a part on which no forces act.
void find_carrying(const StepProblem& problem, const VectorX& z, std::size_t i, Carrying& out);

/// Adds the rows and columns of carried parts in the matrix at z to those of their bodies. `carrying`: derivatives, of
/// which those are found that are needed and not known.
void fold_matrix(const StepProblem& problem, const VectorX& z, std::vector<Carrying>& carrying, Assembler& assembler);

/// Adds bounds on the rounding errors of carried parts to those of their bodies.
void fold_bounds(const StepProblem& problem, VectorX& bounds);

/// Adds the rows of carried parts to those of their bodies without clearing them: rows of a carried part are then those
/// of everything that its body carries there.
void sum_rows(const StepProblem& problem, const VectorX& z, VectorX& rows);

/// Sets the displacements of carried parts in a step from z by those of their bodies.
void expand_step(const StepProblem& problem, const VectorX& z, VectorX& step);

/// Sets the velocities at the end of a midpoint step of nodes whose bodies are held. They have no dynamics of their
/// own, and the midpoint formula would oscillate for ever. `velocity`: of all unknowns; true if any has changed.
bool follow_held_bodies(const StepProblem& problem, const VectorX& z, VectorX& velocity);

}  // namespace withe
