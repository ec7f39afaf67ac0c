/// What solves leave for those to come: factorisations that may serve again, orders of elimination, guesses.

#include "common/check.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

std::size_t at(System which) { return static_cast<std::size_t>(which); }

}  // namespace

/// Nothing where there are none of their own.
Equations* World::Implementation::system(System which) {
  switch (which) {
    case System::scheme:
      return equations.get();
    case System::statics:
      return static_equations.get();
  }
  return nullptr;
}

Lagged World::Implementation::lagged() {
  Lagged out;
  const MatrixRecord& matrix = work.newton.matrix;
  out.matrix = matrix;
  out.guesses = work.newton.guesses;
  for (const System which : kSystems) {
    const Equations* known = system(which);
    if (!known) continue;
    const bool owns = matrix.owner == known && matrix.generation == known->assembler().generation();
    if (owns) out.owner = which;
    out.systems[at(which)] = known->memory(owns);
  }
  return out;
}

/// The same matrix makes the same factorisation.
void World::Implementation::recall(const Lagged& past) {
  bool fits = true;
  for (const System which : kSystems) {
    const auto& memory = past.systems[at(which)];
    if (!memory && which == System::statics) static_equations.reset();
    if (!memory) continue;
    if (which == System::statics) statics();
    require(system(which) != nullptr, "equations of another scene");
    if (!system(which)->recall(*memory) && past.owner == which) fits = false;
  }
  MatrixRecord& matrix = work.newton.matrix;
  static_cast<MatrixHistory&>(matrix) = past.matrix;
  matrix.owner = nullptr;
  work.newton.guesses = past.guesses;
  if (past.owner && fits) factorize_again(*past.owner);
}

/// With the matrix as it is; users count what steps factorise.
void World::Implementation::factorize_again(System which) {
  Equations& owner = *system(which);
  const Counters counters = work.newton.counters;
  require(factorize(owner, work.newton), "a matrix of another scene");
  work.newton.counters = counters;
  work.newton.matrix.owner = &owner;
  work.newton.matrix.generation = owner.assembler().generation();
  work.newton.matrix.factorized = true;
}

void World::Implementation::mark() {
  marked_history = *this;
  marked_matrix = work.newton.matrix;
  marked_guesses = work.newton.guesses;
  for (const System which : kSystems)
    if (Equations* known = system(which)) known->mark();
}

void World::Implementation::return_to_mark() {
  static_cast<StepHistory&>(*this) = marked_history;
  if (!equations->marked()) {  // made anew since, for other supports or outside of a plane
    forget_matrix();
    return;
  }
  if (static_equations && !static_equations->marked()) static_equations.reset();
  work.newton.matrix = marked_matrix;
  work.newton.guesses = marked_guesses;
  for (const System which : kSystems) {
    Equations* known = system(which);
    const EquationsMemory* before = known ? known->since_mark() : nullptr;
    if (!before) continue;
    if (known->recall(*before) && marked_matrix.owner == known) factorize_again(which);
  }
}

void World::Implementation::take_callbacks(const Implementation& other) {
  callback = other.callback;
  force_function = other.force_function;
  poll = other.poll;
}

void World::Implementation::forget_contacts() {
  for (const System which : kSystems)
    if (Equations* known = system(which); known && known->contact()) known->forget_contacts();
}

void World::Implementation::forget_matrix() {
  work.newton.matrix = MatrixRecord{};
  work.newton.guesses = GuessRecords{};
  for (const System which : kSystems)
    if (Equations* known = system(which)) known->forget_flow();
}

}  // namespace withe
