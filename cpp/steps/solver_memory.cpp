// Memory of solves for later solves: the matrix in use, contacts, the order of elimination, and the force of the fluid.

#include <algorithm>

#include "steps/equations.hpp"

namespace withe {

void Equations::forget_contacts() {
  contact()->forget();
  terms_.contact->rows().set(contact()->surfaces(), contact()->near());
  order_for_contacts();
}

/// Finds an order of elimination for the present contacts only.
void Equations::order_for_contacts() {
  assembler_.order_for(terms_.contact->rows().unknowns(), kContactUnknowns);
  ordered_ = terms_.contact->rows().keys();
}

EquationsMemory Equations::memory(bool with_matrix) const {
  EquationsMemory out;
  remember(out, with_matrix);
  return out;
}

void Equations::pass_mark() {
  if (mark_ != Mark::set) return;
  remember(at_mark_, true);
  mark_ = Mark::passed;
}

/// Allocates nothing if `out` already has the necessary sizes.
void Equations::remember(EquationsMemory& out, bool with_matrix) const {
  if (terms_.contact) {
    out.ordered = ordered_;
    out.coupled = terms_.contact->rows().keys();
  }
  out.groups = assembler_.groups();
  if (with_matrix) {
    const std::span<const double> values = assembler_.solver().values();
    out.matrix.assign(values.begin(), values.end());
  }
  if (terms_.stokeslets) {
    out.flow_excess = terms_.stokeslets->excess();
    out.fluid = terms_.stokeslets->memory();
  }
}

bool Equations::recall(const EquationsMemory& memory) {
  const bool regrouped = memory.groups != assembler_.groups();
  assembler_.set_groups(memory.groups);
  if (terms_.contact && (regrouped || memory.ordered != ordered_ || memory.coupled != terms_.contact->rows().keys())) {
    ContactRows& rows = terms_.contact->rows();
    rows.set(contact()->surfaces(), memory.ordered);
    if (regrouped || memory.ordered != ordered_) order_for_contacts();
    rows.set(contact()->surfaces(), memory.coupled);
    assembler_.couple(rows.unknowns(), kContactUnknowns);
  }
  // A scene with other options or friction may have a matrix of another form.
  const std::span<double> values = assembler_.solver().values();
  const bool fits = memory.matrix.size() == values.size();
  if (fits) std::copy(memory.matrix.begin(), memory.matrix.end(), values.begin());
  if (terms_.stokeslets) terms_.stokeslets->recall(memory.fluid, memory.flow_excess);
  return fits;
}

}  // namespace withe
