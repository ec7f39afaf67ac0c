#pragma once
/// Masses of a scene's unknowns.
///
/// The velocity of an edge goes linearly from one node's to the other's, so an edge of mass m has the kinetic energy
///   m (|va|^2 + va . vb + |vb|^2) / 6 = (m / 2) (|va|^2 + |vb|^2) / 2 - (m / 12) |vb - va|^2,
/// and rows of the mass matrix read m / 6, 4 m / 6, m / 6 [any textbook on finite elements: the consistent matrix]. The
/// matrix is positive definite, and its row sums are the masses m / 2 at either end. It is a scalar matrix times the
/// identity of space, so it conserves momentum and angular momentum as lumped masses do. Bending waves gain most: their
/// frequencies have errors of O(l^4). Lumped masses leave errors of O(l^2), mainly at free ends.
///
/// A node that a support holds acts on its neighbours through the coupling terms. For example, a bar of one edge that
/// hangs on a pin has the moment of inertia m l^2 / 3, and lags behind when the pin moves. The velocity of a held node
/// at the end of a step is known to second order only (`find_held_velocity`). Fourth-order steps therefore lump the
/// mass of edges at held nodes (`Parameters::held_lumped`).
///
/// A frame of a joint or a clamp carries a quarter of the rotary inertia of each attached edge, which is the part
/// within half of its stencil. The edge carries the rest and turns in its middle. About the axis of the edge, the sum
/// is the inertia of the edge. A hinge has an equal inertia relative to its frame, because no mass may vanish.
///
/// A rigid body turns with its frame: the moment of inertia of the frame is a matrix, R J R^T, which changes as the
/// body turns. `rows` contains its mean, and `bodies` the rest, at the frames given last.
///
/// Rods whose edges are chords of arcs, of more than a radian in all, have lumped masses. A chord that spins about the
/// centre of its arc is nearer to the centre than the arc. By this the consistent matrix loses kappa^2 l^2 / 6 of the
/// energy, and the lumped matrix nothing. An explicit scheme divides by masses, and uses the row sums alone
/// (`Parameters::lumped`).

#include "model/state.hpp"

namespace withe {

/// Share of an edge's rotary inertia that a frame at its end carries.
inline constexpr double kFrameShare = 0.25;

struct MassMatrix {
  VectorX rows;                 ///< per unknown, row sums [kg], [kg m^2]
  VectorX inverse;              ///< of `rows`
  VectorX coupling;             ///< per edge: m / 6 off the diagonal between its nodes, less on it [kg]
  std::vector<Matrix3> bodies;  ///< per body in space: its inertia without the mean of its principal moments [kg m^2]
};

/// Bodies are as drawn; `turn_bodies` must follow where there are any, and the scene has moved.
void set_mass(const Model& model, const Parameters& parameters, MassMatrix& mass);
/// Turns the inertia of bodies to the frames of a state.
void turn_bodies(const Model& model, const Parameters& parameters, const State& state, MassMatrix& mass);
/// Moment of inertia of a body about its centre of mass at a state, in the axes of space [kg m^2].
Matrix3 inertia_in_space(const Model& model, const Parameters& parameters, const State& state, int body);
/// Drag with the same interpolation of velocities, in N s/m. It therefore damps every mode of a uniform rod at the same
/// rate, drag over mass, for any wavelength.
void set_drag(const Model& model, const Parameters& parameters, MassMatrix& drag);
/// out = M x.
void multiply(const Model& model, const MassMatrix& mass, const VectorX& x, VectorX& out);
/// Adds the derivatives of rows . M x by the numbers of M.
void add_mass_adjoint(const Model& model, const VectorX& x, const VectorX& rows, VectorX& by_rows,
                      VectorX& by_coupling);
/// v . M v / 2 [J].
double kinetic_energy(const Model& model, const MassMatrix& mass, const VectorX& v);

}  // namespace withe
