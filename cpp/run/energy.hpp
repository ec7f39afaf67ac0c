#pragma once
/// Energies of a scene as functions of its state, and the ledger of work and losses that they are balanced with.

#include "contact/contact.hpp"
#include "elasticity/elements.hpp"
#include "model/mass_matrix.hpp"

namespace withe {

struct Energy {  // [J]
  double kinetic = 0, stretch = 0, bend = 0, twist = 0, gravity = 0;
  double loads = 0;  ///< minus the work done by loads and custom forces since the start
  double contact = 0;
  double spring = 0;      ///< of springs, of revolute joints, and of hands that yield
  double total = 0;       ///< sum of the above
  double work = 0;        ///< done by supports and actuation since the start
  double dissipated = 0;  ///< by viscosity, drag, dampers, fluids and contact since the start

  /// Stored in what is deformed, but for contact.
  double elastic() const { return stretch + bend + twist + spring; }
};

/// Work and losses since the start [J].
struct Ledger {
  double support_work = 0, actuation_work = 0, dissipated = 0, load_work = 0;
};

/// Coefficients of energies, from parameters.
struct EnergyCoefficients {
  ElasticCoefficients elastic;
  MassMatrix mass;
  VectorX node_mass;                        ///< [kg]
  Vector3 gravity;                          ///< [m/s^2]
  PartNumbers numbers;                      ///< numbers of parts, such as springs
  long version = -1, natural_version = -1;  ///< of the parameters

  void set(const Model& model, const Parameters& parameters);
};

/// Per connected component: kinetic energy beside a frame that travels along with it, what that leaves out, elastic
/// energy [J]; mass [kg], momentum [kg m/s], velocity of the frame [m/s].
struct ComponentEnergies {
  VectorX kinetic, travelling, elastic, mass, held_nodes;
  MatrixX3 momentum, frame;
};

/// Scratch for energies.
struct EnergyScratch {
  Configuration configuration;
  EnergyCoefficients coefficients;
  ContactAtRest contact;
  ComponentEnergies components;

  /// Sets configuration and coefficients to those of a state.
  void set(const Model& model, const Parameters& parameters, const State& state);
};

/// Energy of a state, with the work and the losses up to it. `contact`: none where nothing touches.
Energy energy_of(const Model& model, const Parameters& parameters, const Contact* contact, const State& state,
                 const Ledger& ledger, EnergyScratch& scratch);
/// Energy of a rod. A node's part goes to the rods that meet there, by the masses of their half edges; so does an added
/// mass.
Energy rod_energy(const Model& model, const Parameters& parameters, const State& state, int rod,
                  EnergyScratch& scratch);
/// Energy of stretching, bending, twisting and joints [J].
double elastic_energy(const Model& model, const Parameters& parameters, const State& state, EnergyScratch& scratch);
/// Change of the energy of a state since the coefficients were `before` [J]. Those of `scratch` become the present
/// ones.
double change_by_settings(const Model& model, const EnergyCoefficients& before, const Parameters& parameters,
                          const State& state, EnergyScratch& scratch);
/// Energies of each connected component, in `scratch.components`.
void find_component_energies(const Model& model, const Parameters& parameters, const State& state,
                             EnergyScratch& scratch);
/// Kinetic and elastic energy of components that touch anything [J]. The kinetic energy is that about their common
/// centre of mass. Where a component is held or touches an obstacle, it is that in a frame that rests or goes with the
/// obstacle; the greatest of several counts.
double touching_energy(const Model& model, const Parameters& parameters, const Contact& contact, const State& state,
                       EnergyScratch& scratch);

/// Energy balance, which an exact integrator leaves constant [J].
double balance_of(const Energy& e);
/// Rounding error bound of a balance [J]. A scene at rest has no energy but that of its weight.
double rounding_of(const Energy& e, int unknowns);

}  // namespace withe
