#pragma once
/// The table of forces.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "steps/contact_forces.hpp"
#include "steps/custom_term.hpp"
#include "steps/fluid_forces.hpp"
#include "steps/hand_forces.hpp"
#include "steps/loop_forces.hpp"

namespace withe {

/// The terms of a scene in the order in which they are added, and pointers to the terms that steps use by name (null if
/// the scene has no such term).
struct Terms {
  std::vector<std::unique_ptr<Term>> all;
  ContactForces* contact = nullptr;
  CustomTerm* custom = nullptr;
  HandForces* hands = nullptr;
  LoopForces* loops = nullptr;
  StokesletForces* stokeslets = nullptr;
};

/// `rule`: in statics there is no fluid. `exact`: the Jacobian has every derivative.
Terms make_terms(const Model& model, const Loads& loads, StepRule rule, bool exact);

/// Call add(node, energy [J]) for each spring, revolute joint and torsion spring, with the energy that it stores at q
/// and a node that it acts on. `c` is the configuration at q.
void for_each_stored(const Model& model, const PartNumbers& numbers, const VectorX& q, const Configuration& c,
                     const std::function<void(int, double)>& add);
/// Energy that all springs, revolute joints and torsion springs store at q [J].
double stored_energy(const Model& model, const PartNumbers& numbers, const VectorX& q, const Configuration& c);

/// Causes that make the Jacobian unsymmetric, in words.
std::vector<std::string> asymmetries_of(const Model& model, const Loads& loads, const Terms& terms, StepRule rule,
                                        bool exact);

}  // namespace withe
