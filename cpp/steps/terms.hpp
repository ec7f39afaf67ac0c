#pragma once
/// The table of forces.

#include <memory>
#include <string>
#include <vector>

#include "steps/contact_forces.hpp"
#include "steps/custom_term.hpp"
#include "steps/elastic_forces.hpp"
#include "steps/fluid_forces.hpp"

namespace withe {

/// The terms of a scene in the order in which they are added, and those of them that steps ask by name (nothing where
/// the scene does without).
struct Terms {
  std::vector<std::unique_ptr<Term>> all;
  ElasticForces* elastic = nullptr;
  ContactForces* contact = nullptr;
  CustomTerm* custom = nullptr;
  StokesletForces* stokeslets = nullptr;
};

/// `rule`: statics know no fluid.
Terms make_terms(const Model& model, const Loads& loads, StepRule rule);

/// In words, what makes the Jacobian unsymmetric. `exact`: it has every derivative.
std::vector<std::string> asymmetries_of(const Model& model, const Loads& loads, const Terms& terms, StepRule rule,
                                        bool exact);

}  // namespace withe
