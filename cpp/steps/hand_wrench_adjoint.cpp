// Derivatives of the force F and the moment M of a yielding hand, about its position p at the end of the step:
//   F = sum f,    M = sum ((x - p) x f + m),
// where -f = G C(K u), and m is the derivative of E by the rotation of the grasped part.

#include <array>
#include <optional>

#include <Eigen/Geometry>

#include "steps/discrete_adjoint.hpp"
#include "steps/hand_piece.hpp"

namespace withe {

void HandForces::add_wrench_adjoint(const StepProblem& problem, const StepData& data, int support,
                                    const Vector3& by_force, const Vector3& by_moment, StepAdjoint& adjoint,
                                    VectorX& by_z) const {
  std::optional<DiscreteAdjoint> discrete;
  if (problem.conserves_energy()) discrete.emplace(problem, data, VectorX::Zero(model_.dof_count), adjoint);
  const Vector3 about = end_pose(problem, support).position;
  Vector3 force = Vector3::Zero();
  for (int k = 0; k < table_.count(); ++k) {
    if (held_[at(k)].support != support) continue;
    const Piece p = piece(problem, data, k);
    const Vector3 pull = p.shift.grip * p.elastic.force,  // -f
        by_pull = -by_force - by_moment.cross(p.shift.point - about);
    force -= pull;
    add_shift_adjoint(problem, data, k, by_pull, adjoint);
    add_to_point(model_, p.touched, p.by.transpose() * by_pull - pull.cross(by_moment), by_z);
    if (discrete)
      add_discrete_moment_adjoint(problem, data, k, by_moment, *discrete, adjoint, by_z);
    else if (model_.planar())
      add_planar_moment_adjoint(problem, data, k, by_moment.dot(model_.plane->normal), adjoint, by_z);
    else
      add_moment_adjoint(problem, data, k, by_moment, adjoint, by_z);
  }
  adjoint.hands_end.positions.row(support) -= force.cross(by_moment).transpose();
}

/// Derivatives of m. If edge and hand rotate together, m rotates with them. Therefore derivatives by the hand follow
/// from derivatives by the edge.
void HandForces::add_moment_adjoint(const StepProblem& problem, const StepData& data, int element,
                                    const Vector3& by_moment, StepAdjoint& adjoint, VectorX& by_z) const {
  const Piece p = piece(problem, data, element);
  const int support = held_[at(element)].support;
  const EdgeFrame<double>&edge = data.configuration.edge[at(p.touched.edge)], grip = frame_of(p.shift.grip);
  const BendMeasure& measure = problem.parameters->measure;
  const BendTwistStrain<double> strain =
      bend_twist_strain(grip, edge, problem.start->hands[at(support)].twist(held_[at(element)].touched));
  // The grasped part rotates like an edge of unit length, and about itself.
  const Vector3 T = p.shift.grip.col(2);
  const Vec3d way = to_vec3(Vector3(by_moment.cross(T)));
  const double angle = by_moment.dot(T);
  BendTwistDerivatives<double> d;
  Vector3 by_stiffness;
  for (int s = 0; s < 3; ++s) {
    bend_twist_gradient(measure, grip, edge, strain, {0.0, 0.0, 0.0},
                        {s == 0 ? 1.0 : 0.0, s == 1 ? 1.0 : 0.0, s == 2 ? 1.0 : 0.0}, d);
    by_stiffness[s] = dot(way, d.gradient_e[0]) + angle * d.gradient_angle[0];
  }
  add_turn_stiffness(model_, p.shift.grip, p.touched.share, by_stiffness, support, adjoint.coefficients.hand_stiffness);
  bend_twist_hessian(measure, grip, edge, strain, {0.0, 0.0, 0.0}, turn_stiffness(p.hand, p.touched.share), d);
  const Vector3 moment = T.cross(to_eigen(d.gradient_e[0])) + d.gradient_angle[0] * T;
  apply_transport(grip, edge, d);
  Vector3 by_edge = angle * to_eigen(d.e_angle[1][0]);
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) by_edge[j] += way[i] * d.ee[0][1].row[i][j];
  const double by_angle = dot(way, d.e_angle[0][1]) + angle * d.angle_angle[0][1];
  add_to_edge(model_, p.touched.edge, to_vec3(by_edge), by_z);
  by_z[model_.edge_dof[at(p.touched.edge)]] += by_angle;
  adjoint.middle_turn[p.touched.edge] += by_angle;
  // At fixed angles directors follow their edge without the rotation `spin`.
  const Vector3 t = to_eigen(edge.tangent), e = t / edge.inverse_length,
                by_turn = moment.cross(by_moment) - e.cross(by_edge - by_angle * to_eigen(edge.spin)) - by_angle * t;
  add_pose(problem, support, Vector3::Zero(), by_turn, adjoint);
}

void HandForces::add_planar_moment_adjoint(const StepProblem& problem, const StepData& data, int element, double by,
                                           StepAdjoint& adjoint, VectorX& by_z) const {
  const Piece p = piece(problem, data, element);
  const int support = held_[at(element)].support;
  const EdgeFrame<double>& edge = data.configuration.edge[at(p.touched.edge)];
  const BendMeasure& measure = problem.parameters->measure;
  const PlanarEdge<double> both[2] = {planar_grip(model_, p.shift.grip), planar_edge(edge)};
  const Vec2<double> turn = turned(both[0].tangent), &t = both[1].tangent;
  const PlanarBend<double> bend = planar_turn(model_, measure, p.hand, p.touched.share, p.shift.grip, edge);
  PlanarForces<double> forces;
  planar_bend_forces<true>(bend, both, forces);
  Vector2 by_edge;
  for (int i = 0; i < 2; ++i)
    by_edge[i] = by * (forces.by[1][0].row[i][0] * turn.x + forces.by[1][0].row[i][1] * turn.y);
  const Vector3 in_space = by_edge[0] * model_.plane->first + by_edge[1] * model_.plane->second;
  add_to_node(model_, model_.edge_head[at(p.touched.edge)], in_space, by_z);
  add_to_node(model_, model_.edge_tail[at(p.touched.edge)], -in_space, by_z);
  const double by_turn = (by_edge[0] * t.y - by_edge[1] * t.x) / both[1].inverse_length;
  add_pose(problem, support, Vector3::Zero(), by_turn * model_.plane->normal, adjoint);
  const double kappa = planar_kappa(both[0].tangent.x, both[0].tangent.y, t.x, t.y);
  add_turn_stiffness(model_, p.shift.grip, p.touched.share,
                     {-by * planar_bend(measure, kappa, 0.0, 1.0).slope, 0.0, 0.0}, support,
                     adjoint.coefficients.hand_stiffness);
}

/// Adjoint of the moment m on the edge over an energy-momentum step. The product b . m follows from the rows of m. One
/// part comes from b x e on the vector of the edge, with e in the middle of the step, and the other from b . t on its
/// angle; see MovingEdge. The hand receives the opposite moment.
void HandForces::add_discrete_moment_adjoint(const StepProblem& problem, const StepData& data, int element,
                                             const Vector3& by_moment, DiscreteAdjoint& discrete, StepAdjoint& adjoint,
                                             VectorX& by_z) const {
  const Held& held = held_[at(element)];
  const TouchedEdge& touched = model_.supports[at(held.support)].touched[at(held.touched)];
  const EdgeFrame<double>& edge = data.configuration.edge[at(touched.edge)];
  const Grip grip = grip_over(problem, data, held);
  const bool planar = model_.planar();
  const int n = model_.dimension, head = planar ? 2 : 4;
  const Vector3 t = to_eigen(edge.tangent),  // in a plane: in the axes of the plane
      b = planar ? Vector3(0.0, 0.0, -by_moment.dot(model_.plane->normal)) : Vector3(-by_moment),
                apart = b.cross(t) / edge.inverse_length;
  double rows[kMaxLocal] = {};
  for (int i = 0; i < n; ++i) rows[head + i] = apart[i];
  if (!planar) rows[3] = b.dot(t);
  const std::array<double, kMaxLocal> end = add_discrete_turn_adjoint(problem, data, element, rows, discrete, adjoint);
  const int* dofs = table_.dofs(element);
  for (int i = 0; i < table_.width(); ++i) by_z[dofs[i]] += 2.0 * end[at(i)];
  if (!planar) adjoint.middle_turn[touched.edge] += 2.0 * end[3];
  // The rows follow the edge in the middle.
  Local local;
  discrete_held_local(model_, grip.elastic, discrete.forth(), touched.edge, grip.attached, false, local);
  Vector3 force = Vector3::Zero();
  for (int i = 0; i < n; ++i) force[i] = local.gradient[head + i];
  Vector3 by_edge = force.cross(b);
  if (!planar) by_edge += local.gradient[3] * edge.inverse_length * (b - b.dot(t) * t);
  for (int i = 0; i < n; ++i) {
    by_z[dofs[head + i]] += by_edge[i];
    by_z[dofs[i]] -= by_edge[i];
  }
}

}  // namespace withe
