#include "steps/contact_forces.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace withe {

namespace {

void add_coefficients(const ContactProblem& problem, const ContactPair& pair, const ContactAdjoint& by,
                      CoefficientAdjoint& out) {
  const FrictionOwner owner = problem.surfaces->friction_owner(pair);
  const Eigen::RowVector3d by_friction(by.friction[0], by.friction[1], by.friction[2]);
  out.slip_tolerance += by.slip_tolerance;
  out.gravity_size += by.gravity;
  problem.add_mass_slopes(pair, by.mass, out.edge_mass);
  if (pair.key.b < 0) out.obstacle_rolling(-1 - pair.key.b) += by.rolling;
  if (owner.pair >= 0)
    out.pair_friction.row(owner.pair) += by_friction;
  else if (owner.obstacle >= 0)
    out.obstacle_friction.row(owner.obstacle) += by_friction;
  else
    out.friction += by_friction.sum();
}

/// Adds derivatives by the position of an obstacle. Contact does not change if rods and obstacle move by the same
/// displacement. Therefore these derivatives are minus the sum of those by all nodes. The velocity of the obstacle is
/// its displacement in the step divided by the duration.
void add_obstacle(const Model& model, const ContactPair& pair, const int (&dofs)[kContactUnknowns],
                  const ContactAdjoint& by, const double (&by_end)[kContactUnknowns], double duration,
                  StepAdjoint& adjoint) {
  const int obstacle = -1 - pair.key.b;
  constexpr int kCoordinates = 12;  // number of unknowns of nodes; angles follow
  for (int k = 0; k < kCoordinates; ++k) {
    const int axis = k % 3;
    if (dofs[k] < 0 || axis >= model.dimension) continue;
    const double by_velocity = duration > 0.0 ? by.velocity[k] / duration : 0.0;
    adjoint.obstacles(obstacle, axis) += by_velocity - by.start[k];
    adjoint.obstacles_end(obstacle, axis) -= by_velocity + by_end[k];
  }
}

}  // namespace

ContactForces::ContactForces(const Model& model) : contact_(model) { rows_.set(contact_.surfaces(), contact_.near()); }

void ContactForces::begin(StepProblem& problem) {
  const bool at_end = problem.rule == StepRule::backward_euler || problem.rule == StepRule::settling;
  const Pressing pressing = problem.rule == StepRule::energy_momentum ? Pressing::mean_direction
                            : problem.rule == StepRule::midpoint      ? Pressing::mean
                            : at_end                                  ? Pressing::end
                                                                      : Pressing::still;
  contact_.begin(*problem.start, *problem.parameters, problem.slip_time, pressing, problem.prescribed->obstacles);
}

void ContactForces::find(const StepProblem& problem, StepData& data, Assembler& assembler, bool with_matrix) {
  problem.set_end(data.z, data.end);
  contact_.update(data.end);
  if (!with_matrix || rows_.hold(contact_)) return;
  rows_.set(contact_.surfaces(), contact_.near());
  assembler.couple(rows_.unknowns(), kContactUnknowns);
}

void ContactForces::add(const StepProblem& problem, StepData& data, const Assembler& assembler,
                        std::span<double> values) const {
  const int n = problem.model.dof_count;
  data.contact_gradient.setZero(n);
  data.contact_floor.setZero(n);
  const ContactLinearisation& linearisation = *data.contact;
  const double twice = problem.end_rate();
  const auto add_gradient = [&](int i, const double* gradient, const int* dofs, int unknowns) {
    const double rounding = contact_.rounding(i, data.rounding.reach, linearisation);
    for (int k = 0; k < unknowns; ++k) {
      if (dofs[k] < 0) continue;
      data.contact_gradient[dofs[k]] += gradient[k];
      data.row_magnitude[dofs[k]] += std::abs(gradient[k]);
      data.contact_floor[dofs[k]] += rounding;
    }
  };
  const bool with_matrix = !values.empty();
  OrderedLookup rows;
  ContactLocal local;
  PlaneLocal plane;
  int dofs[kContactUnknowns], plane_dofs[kPlaneUnknowns];
  for (int i = 0; i < contact_.count(); ++i) {
    if (contact_.plane_local(i, with_matrix, plane, linearisation)) {
      contact_.plane_unknowns(i, plane_dofs);
      add_gradient(i, plane.gradient, plane_dofs, kPlaneUnknowns);
      if (with_matrix)
        assembler.contact.add_dense_hessian(rows_.row(contact_.key(i), rows), plane.hessian, twice, values);
      continue;
    }
    contact_.local(i, with_matrix, local, linearisation);
    contact_.unknowns(i, dofs);
    add_gradient(i, local.gradient, dofs, kContactUnknowns);
    if (with_matrix) assembler.contact.add_hessian(rows_.row(contact_.key(i), rows), local.hessian, twice, values);
  }
  data.gradient.head(n) += data.contact_gradient;
  if (!contact_.frictional() && !problem.in_middle()) data.potential += contact_.energy();
}

void ContactForces::add_adjoint(const StepProblem& problem, const StepData&, const Assembler&,
                                StepAdjoint& adjoint) const {
  if (contact_.count() == 0) return;
  const auto& shares = problem.parameters->surfaces.pair_shares;
  if (std::any_of(shares.begin(), shares.end(), [](const VectorX& s) { return s.size() > 0; }))
    throw std::invalid_argument(
        "no gradient is available with friction that varies along a rod or over an "
        "obstacle");
  int dofs[kContactUnknowns];
  double rows[kContactUnknowns];
  ContactLocal local;
  for (int i = 0; i < contact_.count(); ++i) {
    const Touching& t = contact_.contacts()[i];
    contact_.unknowns(i, dofs);
    for (int k = 0; k < kContactUnknowns; ++k) rows[k] = dofs[k] >= 0 ? adjoint.rows[dofs[k]] : 0.0;
    const auto after = adjoint.approach_after.find(t.pair.key);
    const bool remembered = t.lagged < 0 && after != adjoint.approach_after.end();
    const ContactAdjoint by = contact_.adjoint(i, rows, remembered ? after->second : 0.0);
    const bool obstacle = t.pair.key.b < 0;
    double by_end[kContactUnknowns] = {};
    if (problem.in_middle() || obstacle) {
      contact_.local(i, true, local);
      for (int k = 0; k < kContactUnknowns; ++k)
        for (int j = 0; j < kContactUnknowns; ++j) by_end[k] += rows[j] * local.hessian[j][k];
    }
    for (int k = 0; k < kContactUnknowns; ++k) {
      if (dofs[k] < 0) continue;
      adjoint.start[dofs[k]] += by.start[k];
      adjoint.velocity[dofs[k]] += by.velocity[k];
      if (problem.in_middle()) adjoint.start[dofs[k]] -= by_end[k];  // q1 = 2 z - q0
    }
    if (obstacle) add_obstacle(problem.model, t.pair, dofs, by, by_end, contact_.problem().duration, adjoint);
    if (by.approach != 0.0) adjoint.approach[t.pair.key] += by.approach;
    add_coefficients(contact_.problem(), t.pair, by, adjoint.coefficients);
  }
}

void ContactForces::add_rounding(const StepProblem&, StepData& data) const { data.floor += data.contact_floor; }

double ContactForces::allowed(const StepProblem& problem, const VectorX& z, const VectorX& step) {
  problem.set_end(z, end_);
  change_ = problem.end_rate() * step;
  return contact_.allowed(end_, change_);
}

bool ContactForces::touches(const StepProblem& problem, const VectorX& z) {
  problem.set_end(z, end_);
  contact_.update(end_);
  return contact_.count() > 0;
}

void ContactForces::predict_friction(const StepProblem& problem, const VectorX& step, double kept,
                                     ContactLinearisation& linearisation) {
  change_ = (problem.end_rate() / kept) * step;
  contact_.predict_friction(change_, linearisation);
}

double ContactForces::loss(const StepData& data, const VectorX& change, double obstacle_work) const {
  return data.contact_gradient.dot(change) + obstacle_work - (contact_.energy() - contact_.start_energy());
}

}  // namespace withe
