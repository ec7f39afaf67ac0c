#include "steps/tendon_forces.hpp"

#include <algorithm>
#include <optional>

#include "common/check.hpp"
#include "steps/discrete_adjoint.hpp"
#include "steps/rounding.hpp"

namespace withe {
namespace {

/// Angles of directors among the unknowns of a segment, in space.
Angles angles_of(const TendonSegment& segment) {
  Angles out;
  for (int k = 0; k < 2; ++k) {
    const int place = segment.unknowns.guide[k].angle;
    if (place < 0 || (out.count == 1 && out.place[0] == place)) continue;
    out.place[out.count] = place;
    out.edge[out.count++] = segment.seat[k].edge;
  }
  return out;
}

/// Calls use(place) for each frame in space. `place`: index of its first unknown among the unknowns of a segment.
template <class Use>
void for_each_frame(const TendonSegment& segment, const Use& use) {
  const auto& [first, second] = segment.unknowns.guide;
  if (first.frame >= 0) use(first.frame);
  if (second.frame >= 0 && second.frame != first.frame) use(second.frame);
}

/// Throws if no derivative is known for this segment.
void check_differentiable(const StepProblem& problem, const TendonSegment& segment) {
  const auto& [first, second] = segment.seat;
  const std::vector<FrameStencil>& half = problem.model.half;
  require(first.half < 0 || second.half < 0 || half[at(first.half)].frame != half[at(second.half)].frame,
          "no gradient is available with a tendon that has two consecutive guides on one "
          "joint");
  for (const GuideSeat& seat : segment.seat)
    require(!problem.conserves_energy() || seat.half < 0 || half[at(seat.half)].hinge < 0,
            "no gradient of energy-momentum steps is available with a tendon guide beside "
            "a revolute joint: put the guide in the middle of an edge");
}

}  // namespace

TendonForces::TendonForces(const Model& model) : segments_(tendon_segments(model)) {
  std::vector<int> dofs;
  for (const TendonSegment& segment : segments_)
    dofs.insert(dofs.end(), std::begin(segment.unknowns.dofs), std::end(segment.unknowns.dofs));
  table_ = ElementTable(kTendonUnknowns, std::move(dofs));
}

std::string TendonForces::note() const { return std::to_string(table_.count()) + " pieces of tendons between guides"; }

void TendonForces::evaluate(const StepProblem& problem, const StepData& data, int segment, double tension,
                            bool with_matrix, TendonLocal& out) const {
  const Model& model = problem.model;
  const TendonSegment& of = segments_[at(segment)];
  if (!problem.conserves_energy())
    return tendon_local(model, of, tension, data.z, data.configuration, with_matrix, out);
  discrete_tendon_local(model, of, tension, discrete_step(problem, data), with_matrix, out);
  if (!problem.exact || !with_matrix || model.planar()) return;
  // Inertia converts the rows of frames from derivatives by a Cayley vector to moments. These rows are moments already.
  for_each_frame(of, [&](int place) {
    Eigen::Map<Eigen::Matrix<double, 3, kTendonUnknowns, Eigen::RowMajor>> rows(&out.hessian[place][0]);
    rows = (cayley_spin(data.z.segment<3>(of.unknowns.dofs[place])).transpose() * rows).eval();
  });
}

void TendonForces::add(const StepProblem& problem, StepData& data, const Assembler&, std::span<double> values) const {
  TendonLocal local;
  for (int s = 0; s < table_.count(); ++s) {
    const double tension = problem.parameters->tendon_tension[segments_[at(s)].tendon];
    if (tension == 0.0) continue;
    evaluate(problem, data, s, tension, !values.empty(), local);
    add_element(table_, s, local, data, values);
    data.potential += local.energy;
    if (!problem.conserves_energy()) continue;
    const int* dofs = table_.dofs(s);
    for (int i = 0; i < kTendonUnknowns; ++i)
      if (dofs[i] >= 0) data.elastic_rows[dofs[i]] += local.gradient[i];
  }
}

void TendonForces::add_adjoint(const StepProblem& problem, const StepData& data, const Assembler&,
                               StepAdjoint& adjoint) const {
  for (const TendonSegment& segment : segments_) check_differentiable(problem, segment);
  std::optional<DiscreteAdjoint> discrete;
  if (problem.conserves_energy()) discrete.emplace(problem, data, adjoint.rows, adjoint);
  for (int s = 0; s < table_.count(); ++s) {
    double rows[kTendonUnknowns];
    TendonLocal local;
    gather(table_, s, adjoint.rows, rows);
    if (discrete) {
      // Rows of frames are moments.
      const SegmentUnknowns& unknowns = segments_[at(s)].unknowns;
      for (const GuideUnknowns& u : unknowns.guide)
        for (int i = 0; u.frame >= 0 && i < problem.model.frame_size(); ++i)
          rows[u.frame + i] = discrete->rows()[unknowns.dofs[u.frame + i]];
    }
    evaluate(problem, data, s, 1.0, false, local);
    double& by_tension = adjoint.coefficients.tendon_tension[segments_[at(s)].tendon];
    for (int i = 0; i < kTendonUnknowns; ++i) by_tension += rows[i] * local.gradient[i];
    if (problem.parameters->tendon_tension[segments_[at(s)].tendon] == 0.0) continue;
    if (discrete)
      add_discrete_adjoint(problem, data, s, *discrete, adjoint);
    else
      add_frame_adjoint(problem, data, s, rows, adjoint);
  }
}

/// Adds derivatives by rotations of frames that carry guides, beyond their unknowns, and of the attached parts.
void TendonForces::add_frame_adjoint(const StepProblem& problem, const StepData& data, int segment,
                                     const double (&rows)[kTendonUnknowns], StepAdjoint& adjoint) const {
  const Model& model = problem.model;
  const TendonSegment& of = segments_[at(segment)];
  const SegmentUnknowns& unknowns = of.unknowns;
  const double tension = problem.parameters->tendon_tension[of.tendon];
  TendonLocal local;
  tendon_local(model, of, tension, data.z, data.configuration, true, local);
  for (int k = 0; k < 2; ++k) {
    const GuideUnknowns& u = unknowns.guide[k];
    if (u.frame < 0) continue;
    const int h = of.seat[k].half, size = model.frame_size();
    Vector3 by = Vector3::Zero();
    for (int i = 0; i < size; ++i)
      for (int r = 0; r < unknowns.size; ++r) by(i) += rows[r] * local.hessian[r][u.frame + i];
    auto attachment = adjoint.coefficients.attachment.row(h);
    if (model.planar()) {
      attachment += by(0) * model.plane->normal.transpose();
      continue;
    }
    const Vector3 w = data.z.segment<3>(unknowns.dofs[u.frame]),
                  moment = guide_moment(model, of, k, tension, data.z, data.configuration);
    by -= cayley_moment_slope(w, moment).transpose() * Eigen::Map<const Vector3>(rows + u.frame);
    by = cayley_spin(w).transpose().inverse() * by;
    if (problem.moves()) adjoint.middle_spin.row(model.half[at(h)].frame) += by.transpose();
    // The axis of a hinge rotates with the frame, not with the attached part.
    if (u.hinge >= 0) by -= rows[u.hinge] * guide_hinge_axis(model, of, k, data.configuration).cross(moment);
    attachment += (attached_axes(model, data.configuration, data.z, h).transpose() * by).transpose();
  }
}

void TendonForces::add_discrete_adjoint(const StepProblem& problem, const StepData& data, int segment,
                                        DiscreteAdjoint& discrete, StepAdjoint& adjoint) const {
  const Model& model = problem.model;
  const TendonSegment& of = segments_[at(segment)];
  const SegmentUnknowns& unknowns = of.unknowns;
  const double tension = problem.parameters->tendon_tension[of.tendon];
  double rows[kTendonUnknowns];
  gather(table_, segment, discrete.rows(), rows);
  const auto [start, end] = discrete.add_ends<kTendonUnknowns>(
      table_, segment, rows, angles_of(of),
      [&](const DiscreteStep& way, TendonLocal& out) { discrete_tendon_local(model, of, tension, way, true, out); });
  for (int k = 0; k < 2; ++k) {
    const GuideUnknowns& u = unknowns.guide[k];
    if (u.frame < 0) continue;
    const int h = of.seat[k].half, frame = model.half[at(h)].frame;
    auto attachment = adjoint.coefficients.attachment.row(h);
    const auto first = static_cast<std::size_t>(u.frame);
    if (model.planar()) {
      attachment += (start[first] + end[first]) * model.plane->normal.transpose();
      continue;
    }
    const Vector3 by_start = discrete.by_spin(discrete.backwards(), frame, &start[first]),
                  by_end = discrete.by_spin(discrete.forth(), frame, &end[first]);
    adjoint.start_spin.row(frame) += by_start.transpose();
    adjoint.end_spin.row(frame) += by_end.transpose();
    attachment += (attached_axes(model, problem.start_configuration, problem.start->q, h).transpose() * by_start +
                   attached_axes(model, data.end_configuration, data.end, h).transpose() * by_end)
                      .transpose();
  }
}

/// Rounding errors of guides are eps |x|. They also affect directions.
void TendonForces::add_rounding(const StepProblem& problem, StepData& data) const {
  const Model& model = problem.model;
  for (int s = 0; s < table_.count(); ++s) {
    const TendonSegment& segment = segments_[at(s)];
    const double length = segment_length(model, segment, data.z, data.configuration);
    if (length == 0.0) continue;
    const double force = kRounding * problem.parameters->tendon_tension[segment.tendon] * data.rounding.reach / length;
    const SegmentUnknowns& unknowns = segment.unknowns;
    const auto add = [&](int place, int count, double bound) {
      for (int i = 0; place >= 0 && i < count; ++i) data.floor[unknowns.dofs[place + i]] += bound;
    };
    for (int k = 0; k < 2; ++k) {
      const GuideSeat& seat = segment.seat[k];
      const GuideUnknowns& u = unknowns.guide[k];
      const double moment = force * seat.offset.norm();
      const double couple = seat.on_body() ? 0.0 : moment / data.configuration.length[seat.edge];
      add(u.tail, model.dimension, force + couple);
      add(u.head, model.dimension, force + couple);
      add(u.angle, 1, moment);
      add(u.node, model.dimension, force);
      add(u.frame, model.frame_size(), moment);
      add(u.hinge, 1, moment);
    }
  }
}

void TendonForces::add_applied(const StepProblem& problem, const StepData& data, const Assembler&,
                               VectorX& force) const {
  TendonLocal local;
  for (int s = 0; s < table_.count(); ++s) {
    evaluate(problem, data, s, problem.parameters->tendon_tension[segments_[at(s)].tendon], false, local);
    const int* dofs = table_.dofs(s);
    if (problem.conserves_energy() && !problem.model.planar())
      for_each_frame(segments_[at(s)], [&](int place) {
        Eigen::Map<Vector3> row(local.gradient + place);  // a moment
        row = (cayley_spin(data.z.segment<3>(dofs[place])).transpose() * row).eval();
      });
    for (int i = 0; i < kTendonUnknowns; ++i)
      if (dofs[i] >= 0) force[dofs[i]] -= local.gradient[i];
  }
}

}  // namespace withe
