// Derivatives of the forces of yielding hands by their poses, by slips, and by their stiffness.
//
// The force f on one edge has -f = G C(K u) and u = G^T (x - p - R a) - s. An energy-momentum step uses the means of G
// and u at both ends. A hand that is displaced by dp and turned by w changes
//   G by w x G,    u by -G^T (dp + w x (x - p)).

#include <optional>

#include "common/check.hpp"
#include "geometry/rotation.hpp"
#include "steps/discrete_adjoint.hpp"
#include "steps/hand_piece.hpp"

namespace withe {
namespace {

/// Multiplier of a force at the held point.
Vector3 rows_of_point(const Model& model, const VectorX& rows, const TouchedEdge& touched) {
  return (1.0 - touched.place) * node_vector(model, rows, model.edge_tail[at(touched.edge)]) +
         touched.place * node_vector(model, rows, model.edge_head[at(touched.edge)]);
}

}  // namespace

/// Converts derivatives by the pose where forces act into derivatives by the poses at both ends of the step.
void HandForces::add_pose(const StepProblem& problem, int support, const Vector3& by_position,
                          const Vector3& by_rotation, StepAdjoint& adjoint) const {
  const double share = problem.in_middle() ? 0.5 : 1.0;
  adjoint.hands_end.positions.row(support) += share * by_position.transpose();
  adjoint.hands.positions.row(support) += (1.0 - share) * by_position.transpose();
  if (!problem.in_middle()) {
    adjoint.hands_end.rotations.row(support) += by_rotation.transpose();
    return;
  }
  // exp(v / 2) R0 with exp(v) = R1 R0^T.
  const Vector3 v =
      rotation_log(end_pose(problem, support).rotation * problem.start->hands[at(support)].rotation.transpose());
  const Matrix3 by_end = 0.5 * rotation_spin(0.5 * v) * rotation_spin(v).inverse(),
                by_start = rotation_exp(0.5 * v) - by_end * rotation_exp(v);
  adjoint.hands_end.rotations.row(support) += (by_end.transpose() * by_rotation).transpose();
  adjoint.hands.rotations.row(support) += (by_start.transpose() * by_rotation).transpose();
}

void HandForces::add_shift_adjoint(const StepProblem& problem, const StepData& data, int element,
                                   const Vector3& by_force, StepAdjoint& adjoint) const {
  const Held& held = held_[at(element)];
  const Piece p = piece(problem, data, element);
  const Vector3 along = p.shift.grip.transpose() * by_force, by_elastic = capped_slope(p.elastic).transpose() * along,
                by_shift = p.stiffness.cwiseProduct(by_elastic);
  adjoint.hands.slips.row(element) -= by_shift.transpose();
  CoefficientAdjoint& by = adjoint.coefficients;
  by.hand_stiffness.row(held.support).head<3>() += p.touched.share * by_elastic.cwiseProduct(p.shift.by).transpose();
  if (p.elastic.share < 1.0) by.hand_limit(held.support) += p.touched.share * along.dot(p.elastic.force.normalized());

  struct ByEnd {
    Vector3 point, rotation;
  };
  const auto by_end = [&](const Shift& end, const Vector3& position, double share) {
    const Vector3 by_point = share * end.grip * by_shift;
    return ByEnd{by_point,
                 (share * end.grip * p.elastic.force).cross(by_force) - (end.point - position).cross(by_point)};
  };
  if (!problem.conserves_energy()) {
    const ByEnd found = by_end(p.shift, now_[at(held.support)].position, 1.0);
    add_pose(problem, held.support, -found.point, found.rotation, adjoint);
    return;
  }
  const HandState& hand = problem.start->hands[at(held.support)];
  const SupportPose from{hand.position, hand.rotation}, to = end_pose(problem, held.support);
  const auto shift_at = [&](const VectorX& q, const SupportPose& pose) {
    return shift_of(model_, q, hand, pose, p.touched, at(held.touched));
  };
  const ByEnd start = by_end(shift_at(problem.start->q, from), from.position, 0.5),
              end = by_end(shift_at(data.end, to), to.position, 0.5);
  adjoint.hands.positions.row(held.support) -= start.point.transpose();
  adjoint.hands.rotations.row(held.support) += start.rotation.transpose();
  adjoint.hands_end.positions.row(held.support) -= end.point.transpose();
  adjoint.hands_end.rotations.row(held.support) += end.rotation.transpose();
  add_to_point(model_, p.touched, start.point - end.point, adjoint.start);  // q1 = 2 z - q0
}

/// Returns the derivative by the rotation of the hand where forces act.
Vector3 HandForces::add_turn_adjoint(const StepProblem& problem, const StepData& data, int element, const double* rows,
                                     CoefficientAdjoint& by) const {
  const Piece p = piece(problem, data, element);
  const int support = held_[at(element)].support;
  const EdgeFrame<double>& edge = data.configuration.edge[at(p.touched.edge)];
  const BendMeasure& measure = problem.parameters->measure;
  const Matrix3& G = p.shift.grip;
  if (model_.planar()) {
    const PlanarEdge<double> both[2] = {planar_grip(model_, G), planar_edge(edge)};
    const Vec2<double> apart{rows[2] - rows[0], rows[3] - rows[1]};
    PlanarForces<double> unit, forces;
    const double kappa = planar_kappa(both[0].tangent.x, both[0].tangent.y, both[1].tangent.x, both[1].tangent.y);
    planar_bend_forces<false>(planar_bend(measure, kappa, 0.0, 1.0), both, unit);
    add_turn_stiffness(model_, G, p.touched.share, {dot(apart, unit.force[1]), 0.0, 0.0}, support, by.hand_stiffness);
    planar_bend_forces<true>(planar_turn(model_, measure, p.hand, p.touched.share, G, edge), both, forces);
    const Vec2<double> turn = turned(both[0].tangent);
    double sum = 0.0;
    for (int i = 0; i < 2; ++i)
      sum += apart[i] * (forces.by[1][0].row[i][0] * turn.x + forces.by[1][0].row[i][1] * turn.y);
    return sum * model_.plane->normal;
  }
  const EdgeFrame<double> grip = frame_of(G);
  const BendTwistStrain<double> strain =
      bend_twist_strain(grip, edge, problem.start->hands[at(support)].twist(held_[at(element)].touched));
  const Vec3d apart{rows[4] - rows[0], rows[5] - rows[1], rows[6] - rows[2]};
  BendTwistDerivatives<double> d;
  Vector3 by_stiffness;
  for (int s = 0; s < 3; ++s) {
    bend_twist_gradient(measure, grip, edge, strain, {0.0, 0.0, 0.0},
                        {s == 0 ? 1.0 : 0.0, s == 1 ? 1.0 : 0.0, s == 2 ? 1.0 : 0.0}, d);
    apply_transport_gradient(grip, edge, d);
    by_stiffness[s] = dot(apart, d.gradient_e[1]) + rows[3] * d.gradient_angle[1];
  }
  add_turn_stiffness(model_, G, p.touched.share, by_stiffness, support, by.hand_stiffness);
  bend_twist_hessian(measure, grip, edge, strain, {0.0, 0.0, 0.0}, turn_stiffness(p.hand, p.touched.share), d);
  apply_transport(grip, edge, d);
  // The grip rotates like an edge of unit length, and about itself.
  Vector3 by_vector;
  for (int i = 0; i < 3; ++i) {
    by_vector[i] = rows[3] * d.e_angle[0][1][i];
    for (int j = 0; j < 3; ++j) by_vector[i] += d.ee[0][1].row[i][j] * apart[j];
  }
  const double by_angle = dot(apart, d.e_angle[1][0]) + rows[3] * d.angle_angle[0][1];
  const Vector3 T = G.col(2);
  return T.cross(by_vector) + by_angle * T;
}

void HandForces::add_adjoint(const StepProblem& problem, const StepData& data, const Assembler&,
                             StepAdjoint& adjoint) const {
  require(rings_.count() == 0, "no gradient is available with a rod that slides through a ring");
  std::optional<DiscreteAdjoint> discrete;
  if (problem.conserves_energy()) discrete.emplace(problem, data, adjoint.rows, adjoint);
  double rows[kMaxLocal];
  for (int k = 0; k < table_.count(); ++k) {
    const Held& held = held_[at(k)];
    const TouchedEdge& touched = model_.supports[at(held.support)].touched[at(held.touched)];
    add_shift_adjoint(problem, data, k, rows_of_point(model_, adjoint.rows, touched), adjoint);
    if (!discrete) {
      gather(table_, k, adjoint.rows, rows);
      const Vector3 by_turn = add_turn_adjoint(problem, data, k, rows, adjoint.coefficients);
      add_pose(problem, held.support, Vector3::Zero(), by_turn, adjoint);
      continue;
    }
    gather(table_, k, discrete->rows(), rows);
    add_discrete_turn_adjoint(problem, data, k, rows, *discrete, adjoint);
  }
}

/// Adds derivatives of rows^T times the forces on an edge by its turn against the hand's grasp, over an
/// energy-momentum step. Returns its derivatives by the edge's unknowns at the end.
std::array<double, kMaxLocal> HandForces::add_discrete_turn_adjoint(const StepProblem& problem, const StepData& data,
                                                                    int element, const double* rows,
                                                                    DiscreteAdjoint& discrete,
                                                                    StepAdjoint& adjoint) const {
  const Held& held = held_[at(element)];
  const TouchedEdge& touched = model_.supports[at(held.support)].touched[at(held.touched)];
  const HandState& hand = problem.start->hands[at(held.support)];
  const Grip grip = grip_over(problem, data, held);
  const AttachedStep& forth = grip.attached;
  const AttachedStep back{forth.end, forth.start, forth.end_strain, forth.start_strain, forth.first};
  Columns3 by_stiffness = Columns3::Zero(table_.count(), 3), by_natural = by_stiffness;
  const DiscreteAdjoint::Turning turning = discrete.add_turning(
      table_, element, rows, grip.elastic, grip.elastic,
      model_.planar() ? Angles{} : Angles{1, {3, 0}, {touched.edge, 0}}, -1,
      [&](const DiscreteStep& way, const TurnCoefficients& of, bool with_matrix, Local& out) {
        discrete_held_local(model_, of, way, touched.edge, &way == &discrete.forth() ? forth : back, with_matrix, out);
      },
      by_stiffness, by_natural);
  add_turn_stiffness(model_, hand.rotation * hand.edges[at(held.touched)], touched.share,
                     by_stiffness.row(element).transpose(), held.support, adjoint.coefficients.hand_stiffness);
  const Eigen::Map<const Eigen::VectorXd> multiplied(rows, table_.width());
  const auto by_spin = [&](const DiscreteStep& way, const AttachedStep& attached) -> Vector3 {
    return discrete_held_spin(model_, grip.elastic, way, touched.edge, attached).topRows(table_.width()).transpose() *
           multiplied;
  };
  adjoint.hands_end.rotations.row(held.support) += by_spin(discrete.forth(), forth).transpose();
  adjoint.hands.rotations.row(held.support) += by_spin(discrete.backwards(), back).transpose();
  return turning.end;
}

/// At the limit s1 = s + u - c u at q1, where c |K u| is the limit. Below the limit s does not change.
void HandForces::add_slip_adjoint(const StepProblem& problem, const VectorX& q1, StepAdjoint& adjoint,
                                  VectorX& by_end) const {
  for (int k = 0; k < table_.count(); ++k) {
    const Held& held = held_[at(k)];
    const TouchedEdge& touched = model_.supports[at(held.support)].touched[at(held.touched)];
    const HandDescription& own = model_.supports[at(held.support)].description.hand;
    const SupportPose pose = end_pose(problem, held.support);
    const Shift shift = shift_of(model_, q1, problem.start->hands[at(held.support)], pose, touched, at(held.touched));
    const Vector3 K = shift_stiffness(own, touched.share), after = adjoint.hands_after.slips.row(k).transpose();
    const CappedForce force = capped(K.cwiseProduct(shift.by), touched.share * own.force_limit);
    if (force.share >= 1.0) {
      adjoint.hands.slips.row(k) += after.transpose();
      continue;
    }
    const Vector3 n = force.force.normalized();
    const double size = force.force.norm() / force.share, along = shift.by.dot(after);
    const Vector3 kept = force.share * (after - along / size * K.cwiseProduct(n));  // d(c u)^T after
    adjoint.hands.slips.row(k) += kept.transpose();
    const Vector3 by_point = shift.grip * (after - kept);
    add_to_point(model_, touched, by_point, by_end);
    adjoint.hands_end.positions.row(held.support) -= by_point.transpose();
    adjoint.hands_end.rotations.row(held.support) -= (shift.point - pose.position).cross(by_point).transpose();
    adjoint.coefficients.hand_stiffness.row(held.support).head<3>() +=
        touched.share * along * force.share / size * n.cwiseProduct(shift.by).transpose();
    adjoint.coefficients.hand_limit(held.support) -= touched.share * along / size;
  }
}

bool HandForces::at_limit(const State& state) const {
  constexpr double kNear = 1e-6;  // relative to the limit
  for (const Held& held : held_) {
    const TouchedEdge& touched = model_.supports[at(held.support)].touched[at(held.touched)];
    const HandDescription& own = model_.supports[at(held.support)].description.hand;
    const HandState& hand = state.hands[at(held.support)];
    const Shift shift = shift_of(model_, state.q, hand, {hand.position, hand.rotation}, touched, at(held.touched));
    if (shift_stiffness(own, touched.share).cwiseProduct(shift.by).norm() >
        (1.0 - kNear) * touched.share * own.force_limit)
      return true;
  }
  return false;
}

}  // namespace withe
