// Contact among the equations.

#include <cmath>

#include "integrators/equations.hpp"

namespace withe {

void Equations::set_contact_end(const VectorX& z) {
  contact_end_ = inner_ == Inner::middle ? VectorX(2.0 * z - state_->q) : z;
}

void Equations::find_contacts(const VectorX& z, bool with_matrix) {
  set_contact_end(z);
  contact_->update(contact_end_);
  if (!with_matrix || contact_rows_.hold(*contact_)) return;
  contact_rows_.set(contact_->surfaces(), contact_->near());
  const int before = assembler_.generation();
  assembler_.couple(contact_rows_.unknowns(), kContactUnknowns);
  if (assembler_.generation() != before) ordered_ = contact_rows_.keys();
}

/// Contact acts at the end of the step: its forces are those there, and its matrix counts twice where z is the middle.
void Equations::add_contacts(bool with_matrix, const ContactLinearisation& linearisation, Evaluation& out) {
  contact_gradient_.setZero(model_.dof_count);
  contact_floor_.setZero(model_.dof_count);
  const double twice = end_rate();
  ContactLocal local;
  int dofs[kContactUnknowns];
  for (int i = 0; i < contact_->count(); ++i) {
    contact_->local(i, with_matrix, local, linearisation);
    contact_->unknowns(i, dofs);
    const double rounding = contact_->rounding(i, reach_, linearisation);
    for (int k = 0; k < kContactUnknowns; ++k) {
      if (dofs[k] < 0) continue;
      contact_gradient_[dofs[k]] += local.gradient[k];
      magnitude_[dofs[k]] += std::abs(local.gradient[k]);
      contact_floor_[dofs[k]] += rounding;
    }
    if (with_matrix)
      assembler_.contact.add_hessian(contact_rows_.row(contact_->key(i)), local.hessian, twice,
                                     assembler_.solver().values());
  }
  gradient_.head(model_.dof_count) += contact_gradient_;
  if (has_potential_ && inner_ == Inner::end) out.potential += contact_->energy();
}

double Equations::allowed(const VectorX& z, const VectorX& step) {
  if (!contact_) return 1.0;
  set_contact_end(z);
  contact_change_ = end_rate() * step;
  return contact_->allowed(contact_end_, contact_change_);
}

void Equations::predict_friction(const VectorX& step, double kept, ContactLinearisation& linearisation) {
  if (!contact_) return;
  contact_change_ = (end_rate() / kept) * step;
  contact_->predict_friction(contact_change_, linearisation);
}

double Equations::contact_loss(const VectorX& change, double obstacle_work) const {
  return contact_gradient_.dot(change) + obstacle_work - (contact_->energy() - contact_->start_energy());
}

}  // namespace withe
