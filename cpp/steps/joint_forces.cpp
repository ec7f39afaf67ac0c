#include "steps/joint_forces.hpp"

#include <cmath>
#include <stdexcept>

#include "steps/rounding.hpp"

namespace withe {
namespace {

/// Torque T in the step [N m]. It depends on the angles of the turning part and of the part against which it turns, at
/// z and at the start.
template <class Scalar>
Scalar torque_on(const StepProblem& problem, const JointTorque& torque, const JointAngle& joint, const Scalar (&z)[2],
                 const Scalar (&start)[2], double entry_rate) {
  const double rate = problem.resists() ? 1.0 / problem.interval : 0.0;
  const Scalar angle = joint.sign * (z[0] - z[1]), before = joint.sign * (start[0] - start[1]);
  JointChange<Scalar> change{angle, rate * (angle - before), angle, angle, entry_rate};
  if (problem.in_middle()) {
    change.from = before;
    change.to = 2.0 * angle - before;
  }
  const Scalar out = torque_of(torque, change);
  if (!problem.conserves_energy() || joint.against < 0) return out;
  return out * share_of_turns(2.0 * (z[0] - start[0]), 2.0 * (z[1] - start[1]));
}

double unknown(const VectorX& q, int dof) { return dof < 0 ? 0.0 : q[dof]; }

/// Rate at which a joint has met the stop that it is in, or will in this step [rad/s].
double entry_rate(const StepProblem& problem, const JointAngle& joint) {
  if (joint.stops.impact_loss == 0.0) return 0.0;
  const auto number = &joint - problem.model.joint_angles.data();
  const State& start = *problem.start;
  const double known = number < start.stop_rates.size() ? start.stop_rates[number] : 0.0;
  return known > 0.0 ? known : std::abs(joint.angle(start.v));
}

/// Torque at z.
double torque_now(const StepProblem& problem, const StepData& data, const JointTorque& torque,
                  const JointAngle& joint) {
  const double z[2] = {unknown(data.z, joint.turning), unknown(data.z, joint.against)};
  const double start[2] = {unknown(problem.start->q, joint.turning), unknown(problem.start->q, joint.against)};
  return torque_on(problem, torque, joint, z, start, entry_rate(problem, joint));
}

/// T, its derivatives by both unknowns at z, and its derivatives by both unknowns at the start.
Dual<4> torque_with_slopes(const StepProblem& problem, const StepData& data, const JointTorque& torque,
                           const JointAngle& joint) {
  using D = Dual<4>;
  const VectorX& q0 = problem.start->q;
  const D z[2] = {D::unknown(unknown(data.z, joint.turning), 0), D::unknown(unknown(data.z, joint.against), 1)};
  const D start[2] = {D::unknown(unknown(q0, joint.turning), 2), D::unknown(unknown(q0, joint.against), 3)};
  return torque_on(problem, torque, joint, z, start, entry_rate(problem, joint));
}

/// Adds derivatives by the stiffness, the rest angle and the greatest torque of a servo. Its torque is
/// -k c(e0, e1, L / k) for its elongations e0 and e1 at the ends of the change, and c is homogeneous of degree 1.
void add_servo_adjoint(const StepProblem& problem, const StepData& data, const JointTorque& torque,
                       const JointAngle& joint, double apart, int number, CoefficientAdjoint& out) {
  const double z[2] = {unknown(data.z, joint.turning), unknown(data.z, joint.against)};
  const double start[2] = {unknown(problem.start->q, joint.turning), unknown(problem.start->q, joint.against)};
  const double angle = joint.sign * (z[0] - z[1]), before = joint.sign * (start[0] - start[1]);
  using D = Dual<2>;
  const D shift = D::unknown(0.0, 0), scale = D::unknown(1.0, 1);
  // c(s e0, s e1, m) with s = 1 has the derivative c - m dc/dm.
  const D from = scale * ((problem.in_middle() ? before : angle) - torque.rest_angle - shift),
          to = scale * ((problem.in_middle() ? 2.0 * angle - before : angle) - torque.rest_angle - shift);
  const D mean = mean_within(from, to, torque.most());
  const double by_most = (mean.value - mean.slope[1]) / torque.most();
  const double factor = apart * torque_now(problem, data, {.moment = 1.0}, joint);  // with the scale of finite turns
  out.joint_rest_angle[number] -= factor * torque.stiffness * mean.slope[0];
  out.joint_max_torque[number] -= factor * by_most;
  out.joint_stiffness[number] -= factor * mean.slope[1];
}

}  // namespace

JointTorque joint_torque(const Model& model, const Parameters& p, const ElasticCoefficients& elastic, int joint) {
  return {elastic.joint_stiffness[joint], elastic.joint_natural[joint],        p.joint_damping[joint],
          p.joint_moment[joint],          model.joint_angles[at(joint)].stops, p.joint_max_torque[joint]};
}

JointForces::JointForces(const Model& model) {
  std::vector<int> dofs;
  for (const JointAngle& joint : model.joint_angles) {
    dofs.push_back(joint.turning);
    dofs.push_back(joint.against);
    stops_dissipate_ = stops_dissipate_ || (joint.stops.stiffness != 0.0 && joint.stops.impact_loss > 0.0);
  }
  table_ = ElementTable(2, std::move(dofs));
}

bool JointForces::dissipates(const Parameters& parameters) const {
  return stops_dissipate_ || (parameters.joint_damping.array() > 0.0).any();
}

void JointForces::add(const StepProblem& problem, StepData& data, const Assembler& assembler,
                      std::span<double> values) const {
  const bool symmetric = assembler.solver().symmetry() == Symmetry::symmetric;
  Local local;
  for (int j = 0; j < table_.count(); ++j) {
    const JointAngle& joint = problem.model.joint_angles[at(j)];
    const JointTorque torque = joint_torque(problem.model, *problem.parameters, problem.elastic, j);
    if (!joint.turns() || !torque.acts()) continue;
    const Dual<4> T = torque_with_slopes(problem, data, torque, joint);
    for (int i = 0; i < 2; ++i) {
      const double row = i == 0 ? -joint.sign : joint.sign;
      local.gradient[i] = row * T.value;
      for (int k = 0; k < 2; ++k) local.hessian[i][k] = row * T.slope[k];
    }
    if (symmetric) local.hessian[0][1] = local.hessian[1][0] = 0.5 * (local.hessian[0][1] + local.hessian[1][0]);
    add_element(table_, j, local, data, values);
    // In energy-momentum steps the rows of planar frames are by Cayley vectors, like the rows of elastic forces.
    if (problem.conserves_energy() && joint.against >= 0)
      for (int i = 0; i < 2; ++i) data.elastic_rows[table_.dofs(j)[i]] += local.gradient[i];
    const double angle = joint.angle(data.z);
    data.potential += torque.energy(angle) - torque.moment * angle;
  }
}

void JointForces::add_adjoint(const StepProblem& problem, const StepData& data, const Assembler&,
                              StepAdjoint& adjoint) const {
  double rows[kMaxLocal];
  for (int j = 0; j < table_.count(); ++j) {
    const JointAngle& joint = problem.model.joint_angles[at(j)];
    if (!joint.turns()) continue;
    if (joint.stops.impact_loss > 0.0)
      throw std::invalid_argument("no gradient is available with restitution of stops below 1");
    gather(table_, j, adjoint.rows, rows);
    const double apart = -joint.sign * (rows[0] - rows[1]);
    const JointTorque torque = joint_torque(problem.model, *problem.parameters, problem.elastic, j);
    const auto by = [&](const JointTorque& unit) { return apart * torque_now(problem, data, unit, joint); };
    CoefficientAdjoint& out = adjoint.coefficients;
    if (torque.saturates()) {
      add_servo_adjoint(problem, data, torque, joint, apart, j, out);
    } else {
      out.joint_stiffness[j] += by({.stiffness = 1.0, .rest_angle = torque.rest_angle});
      out.joint_rest_angle[j] += torque.stiffness * by({.moment = 1.0});
    }
    out.joint_damping[j] += by({.damping = 1.0});
    out.joint_moment[j] += by({.moment = 1.0});
    const Dual<4> T = torque_with_slopes(problem, data, torque, joint);
    for (int i = 0; i < 2; ++i)
      if (const int dof = table_.dofs(j)[i]; dof >= 0) adjoint.start[dof] += apart * T.slope[2 + i];
  }
}

void JointForces::add_rounding(const StepProblem& problem, StepData& data) const {
  const double rate = problem.resists() ? 1.0 / problem.interval : 0.0;
  for (int j = 0; j < table_.count(); ++j) {
    const JointAngle& joint = problem.model.joint_angles[at(j)];
    const JointTorque torque = joint_torque(problem.model, *problem.parameters, problem.elastic, j);
    if (!joint.turns() || !torque.acts()) continue;
    const double greatest = std::abs(unknown(data.z, joint.turning)) + std::abs(unknown(data.z, joint.against));
    const double bound = kRounding * (torque.stiffness + torque.stops.stiffness + 2.0 * torque.damping * rate) *
                         (greatest + std::abs(torque.rest_angle));
    for (int dof : {joint.turning, joint.against})
      if (dof >= 0) data.floor[dof] += bound;
  }
}

double JointForces::dissipated(const StepProblem& problem, const StepData& data, const Assembler&,
                               const VectorX& change) const {
  double work = 0.0;
  for (int j = 0; problem.moves() && j < table_.count(); ++j) {
    const JointAngle& joint = problem.model.joint_angles[at(j)];
    const double damping = problem.parameters->joint_damping[j];
    if (!joint.turns()) continue;
    if (damping != 0.0) work -= torque_now(problem, data, {.damping = damping}, joint) * joint.angle(change);
    if (joint.stops.stiffness == 0.0 || joint.stops.impact_loss == 0.0) continue;
    JointStops elastic = joint.stops;
    elastic.impact_loss = 0.0;
    work -= (torque_now(problem, data, {.stops = joint.stops}, joint) -
             torque_now(problem, data, {.stops = elastic}, joint)) *
            joint.angle(change);
  }
  return work;
}

void JointForces::add_applied(const StepProblem& problem, const StepData& data, const Assembler&,
                              VectorX& force) const {
  for (int j = 0; j < table_.count(); ++j) {
    const JointAngle& joint = problem.model.joint_angles[at(j)];
    const double moment = problem.parameters->joint_moment[j];
    if (!joint.turns() || moment == 0.0) continue;
    const double torque = joint.sign * torque_now(problem, data, {.moment = moment}, joint);
    force[joint.turning] += torque;
    if (joint.against >= 0) force[joint.against] -= torque;
  }
}

void enter_stops(const StepProblem& problem, const VectorX& q1, State& state) {
  const std::vector<JointAngle>& joints = problem.model.joint_angles;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const JointAngle& joint = joints[j];
    if (joint.stops.stiffness == 0.0 || joint.stops.impact_loss == 0.0 || !joint.turns()) continue;
    if (state.stop_rates.size() == 0) state.stop_rates = VectorX::Zero(static_cast<Eigen::Index>(joints.size()));
    const double angle = joint.angle(q1);
    const bool is_in = angle > joint.stops.high || angle < joint.stops.low;
    state.stop_rates[static_cast<Eigen::Index>(j)] = is_in ? entry_rate(problem, joint) : 0.0;
  }
}

double joint_row(const StepProblem& problem, const StepData& data, int joint) {
  const JointAngle& angle = problem.model.joint_angles[at(joint)];
  if (!angle.turns()) return 0.0;
  const JointTorque torque = joint_torque(problem.model, *problem.parameters, problem.elastic, joint);
  return angle.sign * torque_now(problem, data, torque, angle);
}

double joint_energy(const Model& model, const PartNumbers& numbers, const VectorX& q, int joint) {
  const JointAngle& angle = model.joint_angles[at(joint)];
  const JointTorque torque{.stiffness = numbers.joint_stiffness[joint],
                           .rest_angle = numbers.joint_rest_angle[joint],
                           .stops = angle.stops,
                           .max_torque = numbers.joint_max_torque[joint]};
  return torque.energy(angle.angle(q));
}

}  // namespace withe
