// What solves leave for those to come: the matrix in use, contacts and the order of elimination, the fluid's force.

#include <algorithm>

#include "integrators/equations.hpp"

namespace withe {

void Equations::forget_contacts() {
  contact_->forget();
  contact_rows_.set(contact_->surfaces(), contact_->near());
  order_for_contacts();
}

/// Finds an order of elimination for the contacts that are coupled now, and no others.
void Equations::order_for_contacts() {
  assembler_.order_for(contact_rows_.unknowns(), kContactUnknowns);
  ordered_ = contact_rows_.keys();
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

/// Without allocation where `out` has had the sizes before.
void Equations::remember(EquationsMemory& out, bool with_matrix) const {
  if (contact_) {
    out.ordered = ordered_;
    out.coupled = contact_rows_.keys();
  }
  out.groups = assembler_.groups();
  if (with_matrix) {
    const std::span<const double> values = assembler_.solver().values();
    out.matrix.assign(values.begin(), values.end());
  }
  if (fluid_) {
    out.flow_excess = flow_excess_;
    out.fluid = fluid_->memory();
  }
}

bool Equations::recall(const EquationsMemory& memory) {
  const bool regrouped = memory.groups != assembler_.groups();
  assembler_.set_groups(memory.groups);
  if (contact_ && (regrouped || memory.ordered != ordered_ || memory.coupled != contact_rows_.keys())) {
    contact_rows_.set(contact_->surfaces(), memory.ordered);
    if (regrouped || memory.ordered != ordered_) order_for_contacts();
    contact_rows_.set(contact_->surfaces(), memory.coupled);
    assembler_.couple(contact_rows_.unknowns(), kContactUnknowns);
  }
  // A scene with other options or friction may have a matrix of another form.
  const std::span<double> values = assembler_.solver().values();
  const bool fits = memory.matrix.size() == values.size();
  if (fits) std::copy(memory.matrix.begin(), memory.matrix.end(), values.begin());
  if (fluid_) {
    flow_excess_ = memory.flow_excess;
    flow_version_ = -1;
    fluid_->recall(memory.fluid);
  }
  return fits;
}

}  // namespace withe
