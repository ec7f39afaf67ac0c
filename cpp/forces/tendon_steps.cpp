// Tendons in energy-momentum steps.

#include <optional>

#include "elasticity/discrete_gradient.hpp"
#include "forces/tendon_pieces.hpp"

namespace withe {
namespace {

Segment segment_at_start(const Model& model, const TendonSegment& segment, const DiscreteStep& step) {
  const auto node = [&](int dof) -> Vector3 {
    return node_of(model, step.end_q, dof) - node_of(model, step.change, dof);
  };
  return {model, segment, node, step.start};
}

/// Map from the moment m on the seat of a guide to generalised forces, in an energy-momentum step, and their
/// derivatives at constant moment. The work of these forces equals the work of the moment over the finite rotation.
struct WorkingTurn {
  Turn columns = Turn::Zero();
  TurnSquare slopes = TurnSquare::Zero();

  WorkingTurn(const Model& model, const GuideSeat& seat, const Guide& start, const Guide& end, const DiscreteStep& step,
              const Vector3& m, bool with_matrix) {
    if (seat.on_body()) return;
    if (seat.half < 0)
      follow_edge(model, seat, start.frame, end.frame, step, m, with_matrix);
    else if (model.planar())
      columns(2, 3) = 1.0;
    else
      follow_frame(model, seat, step, m);
  }

 private:
  void follow_edge(const Model& model, const GuideSeat& seat, const EdgeFrame<double>& start,
                   const EdgeFrame<double>& end, const DiscreteStep& step, const Vector3& m, bool with_matrix) {
    const EdgeFrame<double> middle = in_space(model, step.middle.edge[at(seat.edge)]);
    const MovingEdge<double> edge(start.tangent, start.inverse_length, end.tangent, end.inverse_length, middle.tangent,
                                  middle.inverse_length, model.planar() ? 0.0 : turn_of_directors(start, end));
    const Vector3 t = to_eigen(edge.t);
    columns.leftCols<3>() = edge.inverse_length * cross_matrix(t) + to_eigen(edge.zeta) * t.transpose();
    if (step.transported) columns.leftCols<3>() += t * to_eigen(middle.spin).transpose();
    columns.col(3) = t;
    if (!with_matrix) return;
    EdgeBlock<double> block{};
    add_edge_geometry(edge, to_vec3(m), block);
    if (step.transported) {
      add_transport(middle, block);
      add_spin_change(edge, middle, edge.torque(to_vec3(m)), block);
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) slopes(i, j) = block.ee.row[i][j];
      slopes(i, 3) = block.e_angle[i];
      slopes(3, i) = block.angle_e[i];
    }
    slopes(3, 3) = block.angle_angle;
  }

  void follow_frame(const Model& model, const GuideSeat& seat, const DiscreteStep& step, const Vector3& m) {
    columns.leftCols<3>().setIdentity();
    const FrameStencil& half = model.half[at(seat.half)];
    if (half.hinge < 0) return;
    const Hinge& hinge = model.hinges[at(half.hinge)];
    const HingeArm h = hinge_arm(step.end_q.segment<3>(model.frame_dof[at(half.frame)]),
                                 step.start.frame[at(half.frame)] * hinge.axis, step.change(hinge.dof));
    columns.col(3) = h.arm;
    slopes.bottomLeftCorner<1, 3>() = m.transpose() * h.by_frame;
    slopes(3, 3) = m.dot(h.by_angle);
  }
};

template <int width>
void add_discrete(const Model& model, const TendonSegment& segment, double tension, const DiscreteStep& step,
                  bool with_matrix, TendonLocal& out) {
  const Segment before = segment_at_start(model, segment, step),
                after = segment_at(model, segment, step.end_q, step.end);
  out.energy = 0.5 * tension * (before.length + after.length);
  std::optional<Changes<width>> by;
  if (with_matrix) by.emplace(model, segment, after, step.end_q, step.end);
  const Pull<width> pull(tension, before, after, by ? &*by : nullptr);
  Work<width> work(with_matrix);
  for (int k = 0; k < 2; ++k) {
    const GuideSeat& seat = segment.seat[k];
    const Guide &start = before.guide[k], &end = after.guide[k];
    const Vector3 arm = 0.5 * (start.arm + end.arm), tangent = 0.5 * (start.tangent + end.tangent),
                  f = direction(k) * pull.g, m = arm.cross(f) + tangent.cross(pull.y);
    const WorkingTurn working(model, seat, start, end, step, m, with_matrix);
    auto rows = work.gradient.template segment<kTurns>(kTurns * k);
    rows = working.columns.transpose() * m;
    const bool axial = width == kSmooth && seat.on_edge();
    const Vector3 t1 = to_eigen(end.frame.tangent);
    const double lengths = start.length + end.length;
    Vector3 along = Vector3::Zero();  // (e0 + e1) / (l0 + l1)
    if (axial) along = (start.length * to_eigen(start.frame.tangent) + end.length * t1) / lengths;
    const double share = segment.span[k];
    rows.template head<3>() += share * pull.axial * along;
    if constexpr (width == kStraight) work.gradient.template segment<3>(kSmooth + 3 * k) = f;
    if (!with_matrix) continue;
    Columns<width> by_moment = direction(k) * cross_matrix(arm) * pull.by_g;
    by_moment.template middleCols<kTurns>(kTurns * k) -= 0.5 * cross_matrix(f) * by->arm[k];
    if constexpr (width == kSmooth) {
      by_moment += cross_matrix(tangent) * pull.by_y;
      by_moment.template middleCols<kTurns>(kTurns * k) -= 0.5 * cross_matrix(pull.y) * by->tangent[k];
    }
    work.hessian.template middleRows<kTurns>(kTurns * k).noalias() += working.columns.transpose() * by_moment;
    work.own(k) += working.slopes;
    if (axial) {
      work.hessian.template middleRows<3>(kTurns * k) += share * along * pull.by_axial;
      work.own(k).template topLeftCorner<3, 3>() +=
          share * pull.axial / lengths * (Matrix3::Identity() - along * t1.transpose());
    }
    if constexpr (width == kStraight) work.hessian.template middleRows<3>(kSmooth + 3 * k) += direction(k) * pull.by_g;
  }
  if (with_matrix) work.hessian *= 2.0;  // derivatives by the end are half of those by the middle
  put(model, segment, work, with_matrix, out);
}

}  // namespace

void discrete_tendon_local(const Model& model, const TendonSegment& segment, double tension, const DiscreteStep& step,
                           bool with_matrix, TendonLocal& out) {
  if (segment.smooth)
    add_discrete<kSmooth>(model, segment, tension, step, with_matrix, out);
  else
    add_discrete<kStraight>(model, segment, tension, step, with_matrix, out);
}

}  // namespace withe
