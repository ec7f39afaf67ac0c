#pragma once
/// Record of a run for its gradients: which steps it has, and why some have none.

#include <memory>
#include <vector>

#include "contact/contact.hpp"
#include "gradients/tape.hpp"
#include "integrators/options.hpp"
#include "run/running.hpp"

namespace withe {

// Reasons why there is no gradient.
inline constexpr const char* kStiffnessHasNoGradient =
    "the contact stiffness was chosen automatically; use "
    "enable_contact(stiffness=) with a value that is high enough";
inline constexpr const char* kRingHasNoGradient = "a rod slides through a ring; use a hand without slides=True";

bool has_rings(const Model& model);

/// Begins a record at the present state. `contact`: in time steps; none where nothing can touch.
std::shared_ptr<Tape> start_tape(const Model& model, const Options& options, const Contact* contact,
                                 const Settings& settings, const Moving& now);
/// Before a step: refuses a record whose state or loads were changed between steps.
void check_tape(Tape& tape, const State& state, const Parameters& parameters);

struct JournalEntry {
  StepRule rule;
  double dt;            ///< [s]
  const VectorX& move;  ///< of the unknowns in the step
  bool begins;          ///< the first part of a time step
};
/// Records a step that ends in the present state.
void record_step(Tape& tape, const Model& model, const Contact* contact, const Settings& settings, const Moving& now,
                 const JournalEntry& step);

}  // namespace withe
