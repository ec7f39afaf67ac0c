#include "steps/hand_forces.hpp"

#include "elasticity/discrete_elements.hpp"
#include "geometry/curvature.hpp"
#include "geometry/rotation.hpp"
#include "steps/hand_piece.hpp"
#include "steps/rounding.hpp"

namespace withe {
namespace {

/// Distributes a force at a place on an edge to its nodes. `first_head`: index of the first unknown of the head.
template <int Size>
void put_shift(const Eigen::Matrix<double, Size, 1>& gradient, const Eigen::Matrix<double, Size, Size>& hessian,
               double place, int first_head, bool with_matrix, Local& out) {
  const double share[2] = {1.0 - place, place};
  const int first[2] = {0, first_head};
  for (int a = 0; a < 2; ++a)
    for (int i = 0; i < Size; ++i) {
      out.gradient[first[a] + i] += share[a] * gradient[i];
      for (int b = 0; with_matrix && b < 2; ++b)
        for (int j = 0; j < Size; ++j) out.hessian[first[a] + i][first[b] + j] += share[a] * share[b] * hessian(i, j);
    }
}

}  // namespace

HandForces::HandForces(const Model& model) : model_(model), rings_(model), slips_(rings_.slips()) {
  std::vector<int> dofs;
  const auto add_node = [&](int node) {
    for (int i = 0; i < model.dimension; ++i) dofs.push_back(model.node_dof[at(node)] + i);
  };
  for (std::size_t s = 0; s < model.supports.size(); ++s) {
    const Support& support = model.supports[s];
    if (!support.active || !support.yields() || support.slides()) continue;
    slips_ = slips_ || std::isfinite(support.description.hand.force_limit);
    for (std::size_t i = 0; i < support.touched.size(); ++i) {
      const int edge = support.touched[i].edge;
      held_.push_back({static_cast<int>(s), static_cast<int>(i)});
      add_node(model.edge_tail[at(edge)]);
      if (!model.planar()) dofs.push_back(model.edge_dof[at(edge)]);
      add_node(model.edge_head[at(edge)]);
    }
  }
  table_ = ElementTable(model.planar() ? 4 : 7, std::move(dofs));
}

std::string HandForces::note() const {
  std::string out;
  if (!held_.empty())
    out = std::to_string(held_.size()) +
          " edge(s) are held by hands that yield: each adds to the matrix of its own nodes";
  if (rings_.count() > 0)
    out += (out.empty() ? "" : "; ") + std::to_string(rings_.count()) +
           " ring(s) let rods slide: each adds to the matrix of the three nodes around it";
  return out;
}

SupportPose HandForces::pose_of(const StepProblem& problem, int support) const {
  const HandState& start = problem.start->hands[at(support)];
  SupportPose end = end_pose(problem, support);
  if (!problem.in_middle()) return end;
  const Vector3 turn = rotation_log(end.rotation * start.rotation.transpose());
  return {0.5 * (start.position + end.position), rotation_exp(0.5 * turn) * start.rotation};
}

void HandForces::begin(StepProblem& problem) {
  now_.resize(model_.supports.size());
  for (std::size_t s = 0; s < now_.size(); ++s)
    if (model_.supports[s].active && model_.supports[s].yields()) now_[s] = pose_of(problem, static_cast<int>(s));
}

SupportPose HandForces::end_pose(const StepProblem& problem, int support) const {
  const HandState& start = problem.start->hands[at(support)];
  const std::vector<SupportPose>& end = problem.prescribed->supports;
  return end.empty() ? SupportPose{start.position, start.rotation} : end[at(support)];
}

/// In an energy-momentum step u and G are the means of both ends. With w the Cayley vector of the hand's rotation,
/// u1 - u0 = G^T (dx - dp - w x (x - p)). The work of -f is therefore the change of K u . u / 2.
HandForces::Piece HandForces::piece(const StepProblem& problem, const StepData& data, int element) const {
  const Held& held = held_[at(element)];
  const Support& support = model_.supports[at(held.support)];
  const TouchedEdge& touched = support.touched[at(held.touched)];
  const HandDescription& hand = support.description.hand;
  const HandState& start = problem.start->hands[at(held.support)];
  const auto at_pose = [&](const VectorX& q, const SupportPose& pose) {
    return shift_of(model_, q, start, pose, touched, at(held.touched));
  };
  Shift shift;
  Matrix3 last;
  if (problem.conserves_energy()) {
    const Shift from = at_pose(problem.start->q, {start.position, start.rotation}),
                to = at_pose(data.end, end_pose(problem, held.support));
    shift = {0.5 * (from.grip + to.grip), 0.5 * (from.point + to.point), 0.5 * (from.by + to.by)};
    last = to.grip;
  } else {
    shift = at_pose(data.z, now_[at(held.support)]);
    last = shift.grip;
  }
  const Vector3 stiffness = shift_stiffness(hand, touched.share);
  const CappedForce elastic = capped(stiffness.cwiseProduct(shift.by), touched.share * hand.force_limit);
  const Matrix3 slope =
      problem.exact ? Matrix3(capped_slope(elastic) * stiffness.asDiagonal()) : symmetric_stiffness(stiffness, elastic);
  return {touched, hand, shift, stiffness, elastic, shift.grip * slope * last.transpose()};
}

/// Moment on a held edge by its rotation against its pose when it was grasped.
struct HandForces::Turn {
  Vector3 moment = Vector3::Zero();  ///< moment on the hand
  double energy = 0.0;
};

HandForces::Turn HandForces::put_planar_turn(const StepProblem& problem, const StepData& data, const Piece& p,
                                             bool with_matrix, Local& local) const {
  const Matrix3& G = p.shift.grip;
  const PlanarBend<double> turn = planar_turn(model_, problem.parameters->measure, p.hand, p.touched.share, G,
                                              data.configuration.edge[at(p.touched.edge)]);
  const PlanarEdge<double> both[2] = {planar_grip(model_, G), planar_edge(data.configuration.edge[at(p.touched.edge)])};
  PlanarForces<double> forces;
  planar_bend_forces<true>(turn, both, forces);
  put_planar_half({forces.force[1], 0.0, forces.by[1][1], {}, {}, 0.0}, with_matrix, local);
  return {-turn.slope * model_.plane->normal, turn.energy};
}

HandForces::Turn HandForces::put_turn(const StepProblem& problem, const StepData& data, const Piece& p, double twist,
                                      Local& local) const {
  const EdgeFrame<double>&edge = data.configuration.edge[at(p.touched.edge)], grip = frame_of(p.shift.grip);
  BendTwistDerivatives<double> d;
  bend_twist_hessian(problem.parameters->measure, grip, edge, bend_twist_strain(grip, edge, twist), {0.0, 0.0, 0.0},
                     turn_stiffness(p.hand, p.touched.share), d);
  const Vector3 T = p.shift.grip.col(2);
  const Turn turn{T.cross(to_eigen(d.gradient_e[0])) + d.gradient_angle[0] * T, d.energy};
  apply_transport(grip, edge, d);
  for (int i = 0; i < 3; ++i) {
    local.gradient[i] = -d.gradient_e[1][i];
    local.gradient[4 + i] = d.gradient_e[1][i];
    const double across = d.e_angle[1][1][i];
    local.hessian[i][3] = local.hessian[3][i] = -across;
    local.hessian[4 + i][3] = local.hessian[3][4 + i] = across;
    for (int j = 0; j < 3; ++j) {
      const double h = d.ee[1][1].row[i][j];
      local.hessian[i][j] = local.hessian[4 + i][4 + j] = h;
      local.hessian[i][4 + j] = local.hessian[4 + i][j] = -h;
    }
  }
  local.gradient[3] = d.gradient_angle[1];
  local.hessian[3][3] = d.angle_angle[1][1];
  return turn;
}

/// Attachment of a held edge over an energy-momentum step, and its stiffness.
HandForces::Grip HandForces::grip_over(const StepProblem& problem, const StepData& data, const Held& held) const {
  const Support& support = model_.supports[at(held.support)];
  const TouchedEdge& touched = support.touched[at(held.touched)];
  const HandState& hand = problem.start->hands[at(held.support)];
  const Matrix3 from = hand.rotation * hand.edges[at(held.touched)],
                to = end_pose(problem, held.support).rotation * hand.edges[at(held.touched)];
  const EdgeFrame<double>&edge0 = problem.start_configuration.edge[at(touched.edge)],
        &edge1 = data.end_configuration.edge[at(touched.edge)];
  Grip out{{.start = frame_of(from), .end = frame_of(to), .start_strain = {}, .end_strain = {}, .first = true},
           {problem.parameters->measure, {}, {}}};
  AttachedStep& grip = out.attached;
  if (model_.planar()) {
    const auto direction = [&](const Matrix3& G) {
      const PlanarEdge<double> e = planar_grip(model_, G);
      return Vec3d{e.tangent.x, e.tangent.y, 0.0};
    };
    const auto kappa = [](const Vec3d& a, const Vec3d& b) { return planar_kappa(a.x, a.y, b.x, b.y); };
    grip.start.tangent = direction(from);
    grip.end.tangent = direction(to);
    grip.start_strain.x = kappa(grip.start.tangent, edge0.tangent);
    grip.end_strain.x = kappa(grip.end.tangent, edge1.tangent);
    out.elastic.stiffness.x = planar_stiffness(model_, support.description.hand, touched.share, to);
  } else {
    const BendTwistStrain<double> s0 = bend_twist_strain(grip.start, edge0, hand.twist(held.touched)),
                                  s1 = bend_twist_strain(grip.end, edge1, s0.tau);
    grip.start_strain = {s0.kappa1, s0.kappa2, s0.tau};
    grip.end_strain = {s1.kappa1, s1.kappa2, s1.tau};
    const BendTwistStiffness<double> C = turn_stiffness(support.description.hand, touched.share);
    out.elastic.stiffness = {C.bend1, C.bend2, C.twist};
  }
  return out;
}

HandForces::Turn HandForces::put_discrete_turn(const StepProblem& problem, const StepData& data, const Held& held,
                                               bool with_matrix, Local& local) const {
  const Grip grip = grip_over(problem, data, held);
  const DiscreteStep step = discrete_step(problem, data);
  const int edge = model_.supports[at(held.support)].touched[at(held.touched)].edge;
  return {discrete_held_local(model_, grip.elastic, step, edge, grip.attached, with_matrix, local), 0.0};
}

void HandForces::add(const StepProblem& problem, StepData& data, const Assembler&, std::span<double> values) const {
  const bool with_matrix = !values.empty();
  data.hands.assign(model_.supports.size(), Wrench{});
  Eigen::Matrix<double, 3, 2> axes;
  if (model_.planar()) axes << model_.plane->first, model_.plane->second;
  for (int k = 0; k < table_.count(); ++k) {
    const Held& held = held_[at(k)];
    const Piece p = piece(problem, data, k);
    const Vector3 pull = p.shift.grip * p.elastic.force;  // -f
    Local local{};
    const Turn turn = problem.conserves_energy() ? put_discrete_turn(problem, data, held, with_matrix, local)
                      : model_.planar() ? put_planar_turn(problem, data, p, with_matrix, local)
                                        : put_turn(problem, data, p,
                                                   problem.start->hands[at(held.support)].twist(held.touched), local);
    if (model_.planar())
      put_shift<2>(axes.transpose() * pull, axes.transpose() * p.by * axes, p.touched.place, 2, with_matrix, local);
    else
      put_shift<3>(pull, p.by, p.touched.place, 4, with_matrix, local);
    add_element(table_, k, local, data, values);
    data.potential += turn.energy + 0.5 * p.shift.by.dot(p.stiffness.cwiseProduct(p.shift.by));
    Wrench& wrench = data.hands[at(held.support)];
    wrench.force -= pull;
    wrench.moment += turn.moment - p.shift.point.cross(pull);
  }
  if (rings_.count() > 0) rings_.add(problem, data, values);
}

/// Rounding errors of positions are eps |x|. They also affect the displacement of an edge from its grasped pose.
void HandForces::add_rounding(const StepProblem& problem, StepData& data) const {
  if (rings_.count() > 0) rings_.add_rounding(problem, data);
  for (int k = 0; k < table_.count(); ++k) {
    const Piece p = piece(problem, data, k);
    const EdgeFrame<double>& edge = data.configuration.edge[at(p.touched.edge)];
    double turn = 0.0;
    for (int i = 3; i < 6; ++i) turn = std::max(turn, p.touched.share * p.hand.stiffness[at(i)]);
    const double by_turn = kRounding * turn * (1.0 + data.rounding.reach * edge.inverse_length),
                 by_shift = kRounding * p.stiffness.maxCoeff() * data.rounding.reach;
    const int* dofs = table_.dofs(k);
    for (int i = 0; i < table_.width(); ++i)
      data.floor[dofs[i]] += !model_.planar() && i == 3 ? by_turn : by_shift + by_turn * edge.inverse_length;
  }
}

double HandForces::dissipated(const StepProblem& problem, const StepData& data, const Assembler&,
                              const VectorX& /*change*/) const {
  if (!problem.moves()) return 0.0;
  double lost = rings_.dissipated(problem, data.z);
  for (int k = 0; k < table_.count(); ++k) {
    const Piece p = piece(problem, data, k);
    const Held& held = held_[at(k)];
    const HandState& hand = problem.start->hands[at(held.support)];
    const SupportPose from{hand.position, hand.rotation}, to = end_pose(problem, held.support);
    const auto shift = [&](const VectorX& q, const SupportPose& pose) {
      return shift_of(model_, q, hand, pose, p.touched, at(held.touched)).by;
    };
    const Vector3 u0 = shift(problem.start->q, from), there = shift(data.z, to);
    // For a given pose, u is linear in the place. z is the middle or the end of the step.
    const Vector3 u1 = problem.in_middle() ? Vector3(2.0 * there - shift(problem.start->q, to)) : there;
    const CappedForce last = capped(p.stiffness.cwiseProduct(u1), p.touched.share * p.hand.force_limit);
    if (last.share >= 1.0 && p.elastic.share >= 1.0) continue;
    // Energy that both sides add, minus the stored energy. At the end of a step it is the force times the slip.
    const Vector3 kept = last.share * u1;
    lost += problem.in_middle()
                ? p.elastic.force.dot(u1 - u0) - 0.5 * p.stiffness.dot(kept.cwiseAbs2() - u0.cwiseAbs2())
                : last.force.dot(u1 - kept);
  }
  return lost;
}

double HandForces::work(const StepProblem& problem, const StepData& data, const VectorX& q1) const {
  const std::vector<SupportPose>& end = problem.prescribed->supports;
  double done = rings_.work(problem, q1);
  for (std::size_t s = 0; s < end.size(); ++s) {
    const Support& support = model_.supports[s];
    if (!support.active || !support.yields() || support.slides()) continue;
    const HandState& start = problem.start->hands[s];
    const Wrench& wrench = data.hands[s];
    const Vector3 moment = wrench.moment - now_[s].position.cross(wrench.force);
    const Matrix3 turned = end[s].rotation * start.rotation.transpose();
    done += wrench.force.dot(end[s].position - start.position) +
            moment.dot(problem.conserves_energy() ? cayley_inverse(turned) : rotation_log(turned));
  }
  return done;
}

double HandForces::accept(const std::vector<SupportPose>& end, const Configuration& c, State& state) const {
  for (std::size_t s = 0; s < end.size(); ++s) {
    state.hands[s].position = end[s].position;
    state.hands[s].rotation = end[s].rotation;
    state.hands[s].ring.fed = end[s].fed;
  }
  for (const Held& held : held_) {
    const Support& support = model_.supports[at(held.support)];
    const TouchedEdge& touched = support.touched[at(held.touched)];
    const HandDescription& own = support.description.hand;
    HandState& hand = state.hands[at(held.support)];
    const Shift shift = shift_of(model_, state.q, hand, {hand.position, hand.rotation}, touched, at(held.touched));
    const Vector3 K = shift_stiffness(own, touched.share);
    hand.slip[at(held.touched)] +=
        (1.0 - capped(K.cwiseProduct(shift.by), touched.share * own.force_limit).share) * shift.by;
    if (model_.planar()) continue;
    double& twist = hand.twist(held.touched);
    twist = bend_twist_strain(frame_of(shift.grip), c.edge[at(touched.edge)], twist).tau;
  }
  return rings_.accept(state);
}

double hand_energy(const Model& model, const BendMeasure& measure, const State& state, const Configuration& c,
                   int only) {
  double energy = 0.0;
  for (std::size_t s = 0; s < model.supports.size(); ++s) {
    const Support& support = model.supports[s];
    if (!support.active || !support.yields() || (only >= 0 && at(only) != s)) continue;
    const HandState& hand = state.hands[s];
    if (support.slides()) {
      if (!hand.ring.left) energy += passage_of(model, state, static_cast<int>(s)).energy;
      continue;
    }
    const HandDescription& own = support.description.hand;
    for (std::size_t i = 0; i < support.touched.size(); ++i) {
      const TouchedEdge& touched = support.touched[i];
      const EdgeFrame<double>& edge = c.edge[at(touched.edge)];
      const Shift shift = shift_of(model, state.q, hand, {hand.position, hand.rotation}, touched, i);
      energy += 0.5 * shift.by.dot(shift_stiffness(own, touched.share).cwiseProduct(shift.by));
      if (model.planar()) {
        energy += planar_turn(model, measure, own, touched.share, shift.grip, edge).energy;
        continue;
      }
      const auto strain = bend_twist_strain(frame_of(shift.grip), edge, hand.twist(static_cast<Eigen::Index>(i)));
      energy += bend_twist_moments<false>(measure, strain, {0.0, 0.0, 0.0}, turn_stiffness(own, touched.share)).energy;
    }
  }
  return energy;
}

HandDeflection hand_deflection(const Model& model, const State& state, const Configuration& c, int support) {
  const Support& s = model.supports[at(support)];
  const HandState& hand = state.hands[at(support)];
  HandDeflection out;
  if (s.slides()) {
    if (!hand.ring.left) out.shift = hand.rotation.transpose() * passage_of(model, state, support).across;
    return out;
  }
  for (std::size_t i = 0; i < s.touched.size(); ++i) {
    const TouchedEdge& touched = s.touched[i];
    const Shift shift = shift_of(model, state.q, hand, {hand.position, hand.rotation}, touched, i);
    const Matrix3 turned = edge_directors(model, c, touched.edge) * shift.grip.transpose();
    out.shift += touched.share * (hand.edges[i] * shift.by);
    out.slip += touched.share * (hand.edges[i] * hand.slip[i]);
    out.turn += touched.share * (hand.rotation.transpose() * rotation_log(turned));
  }
  return out;
}

}  // namespace withe
