#include "steps/ring_forces.hpp"

#include <cmath>

#include <Eigen/Geometry>

#include "steps/ring_step.hpp"
#include "steps/rounding.hpp"

namespace withe {
namespace {

/// `reach`: greatest distance from the origin of the positions from which its places are computed [m].
Ring ring_of(const Support& support, double reach) {
  const HandDescription& hand = support.description.hand;
  return {hand.stiffness[0], hand.feeds || hand.friction > 0.0, hand.friction, hand.force_limit,
          kRounding * (reach + support.curve.whole)};
}

/// Position of a ring. On a body it is that of the hand, with `points` at zero.
Vector3 centre_of(const HandState& hand) { return hand.position + hand.rotation * hand.points.front(); }

/// Node of the body that carries a ring, or -1.
int carrier_of(const Support& support) { return support.description.hand.node; }

/// `last`: nodes at the end of the step.
RingStep step_of(const Model& model, const StepProblem& problem, int support, const NodePlaces& last) {
  const Support& s = model.supports[at(support)];
  const HandState& start = problem.start->hands[at(support)];
  const Vector3 from = centre_of(start);
  const double fed = start.ring.fed;
  const std::vector<SupportPose>& end = problem.prescribed->supports;
  if (const int node = carrier_of(s); node >= 0) {
    const Vector3 to = last(node);
    return {ring_of(s, to.norm()), s.curve, start.ring, from, to, fed, end.empty() ? fed : end[at(support)].fed};
  }
  if (end.empty()) return {ring_of(s, from.norm()), s.curve, start.ring, from, from, fed, fed};
  const SupportPose& to = end[at(support)];
  const Vector3 centre = to.position + to.rotation * start.points.front();
  return {ring_of(s, centre.norm()), s.curve, start.ring, from, centre, fed, to.fed};
}

/// Nodes at the end of a step whose forces act at z.
NodePlaces end_of(const StepProblem& problem, const VectorX& z) {
  if (!problem.in_middle()) return {problem.model, z};
  return {problem.model, z, 2.0, &problem.start->q};
}

/// Place where forces act in a step that ends at q1.
NodePlaces middle_of(const StepProblem& problem, const VectorX& q1) {
  if (!problem.in_middle()) return {problem.model, q1};
  return {problem.model, q1, 0.5, &problem.start->q};
}

Eigen::Matrix<double, 3, 2> planar_axes(const Model& model) {
  Eigen::Matrix<double, 3, 2> axes;
  axes << model.plane->first, model.plane->second;
  return axes;
}

/// Part of u that remains within the limit, at a place.
double kept_way(const Ring& ring, const RodCurve& curve, const SplinePlace& place, const SplinePoint<double>& point,
                double u) {
  const double slope = spline_arc_slope(curve.piece(place.piece), place.along),
               tension = ring_tension(ring, u, slope, point);
  return tension == ring.stiffness * u ? u : tension / ring.stiffness;
}

/// Index of a piece of a rod. The pieces of a closed rod repeat periodically.
int own_piece(const RodCurve& curve, int piece) {
  const int count = curve.pieces();
  return ((piece % count) + count) % count;
}

/// Calls `use` with the result of `ring_found`, in the plane or in space.
template <class Use>
auto with_found(const StepProblem& problem, const RingStep& step, const NodePlaces& z, const Use& use) {
  if (problem.model.planar()) {
    const Eigen::Matrix<double, 3, 2> axes = planar_axes(problem.model);
    return use(ring_found<6>(axes, problem, step, z), axes);
  }
  const Matrix3 axes = Matrix3::Identity();
  return use(ring_found<9>(axes, problem, step, z), axes);
}

/// Three nodes, and that of a body that carries the ring.
constexpr int kMostUnknowns = 12;
using RingLocal = LocalOf<kMostUnknowns>;

/// Converts the forces on three nodes in space into derivatives by their unknowns, and by those of the ring if a body
/// carries it.
template <int Size>
RingLocal local_of(const RingFound<Size>& found, const typename RingFound<Size>::Axes& axes, bool is_carried) {
  constexpr int n = RingFound<Size>::kAxes;
  RingLocal out{};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < n; ++k) {
      const auto& [x, y, z] = found.by[i];
      const auto along = [&](double fx, double fy, double fz) {
        return axes(0, k) * fx + axes(1, k) * fy + axes(2, k) * fz;
      };
      const bool passes = std::isfinite(found.place.along);
      out.gradient[i * n + k] = passes ? along(x.value, y.value, z.value) : NAN;
      for (int j = 0; j < Size; ++j) out.hessian[i * n + k][j] = along(x.slope[j], y.slope[j], z.slope[j]);
    }
  for (int k = 0; is_carried && k < n; ++k) {
    for (int i = 0; i < 3; ++i) out.gradient[Size + k] -= out.gradient[i * n + k];
    for (int j = 0; j < Size; ++j)
      for (int i = 0; i < 3; ++i) {
        out.hessian[Size + k][j] -= out.hessian[i * n + k][j];
        out.hessian[j][Size + k] -= out.hessian[j][i * n + k];
      }
  }
  for (int k = 0; is_carried && k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < 3; ++i) out.hessian[Size + k][Size + j] -= out.hessian[Size + k][i * n + j];
  return out;
}

}  // namespace

RingForces::RingForces(const Model& model) : model_(model) {
  std::vector<int> dofs;
  const int n = model.dimension;
  for (std::size_t s = 0; s < model.supports.size(); ++s) {
    const Support& support = model.supports[s];
    if (!support.active || !support.slides()) continue;
    rings_.push_back({static_cast<int>(s), static_cast<int>(dofs.size()) / (4 * n)});
    slips_ = slips_ || ring_of(support, 0.0).slips();
    const auto add = [&](int node) {
      for (int k = 0; k < n; ++k) dofs.push_back(node < 0 ? -1 : model.node_dof[at(node)] + k);
    };
    for (int i = 0; i < support.curve.pieces(); ++i) {
      for (int node : support.curve.piece(i).node) add(node);
      add(carrier_of(support));
    }
  }
  table_ = ElementTable(4 * n, std::move(dofs));
}

void RingForces::add(const StepProblem& problem, StepData& data, std::span<double> values) const {
  for (const Held& held : rings_) {
    if (problem.start->hands[at(held.support)].ring.left) continue;
    const RingStep step = step_of(model_, problem, held.support, end_of(problem, data.z));
    const bool is_carried = carrier_of(model_.supports[at(held.support)]) >= 0;
    with_found(problem, step, {model_, data.z}, [&](const auto& found, const auto& axes) {
      add_element(table_, held.first_element + own_piece(step.curve, found.place.piece),
                  local_of(found, axes, is_carried), data, values);
      data.potential += found.energy;
      const Vector3 force = -found.force();
      Wrench& wrench = data.hands[at(held.support)];
      wrench.force += force;
      wrench.moment += (problem.in_middle() ? Vector3(0.5 * (step.from + step.to)) : step.to).cross(force);
    });
  }
}

/// Rounding errors of positions are eps |x|. They also affect the displacement between a rod and its ring.
void RingForces::add_rounding(const StepProblem& problem, StepData& data) const {
  for (const Held& held : rings_) {
    const HandState& start = problem.start->hands[at(held.support)];
    if (start.ring.left) continue;
    const Support& support = model_.supports[at(held.support)];
    const double by = kRounding * support.description.hand.stiffness[0] * data.rounding.reach;
    const SplinePlace place =
        nearest_place(support.curve, start.ring.place, NodePlaces{model_, data.z}, centre_of(start));
    const int* dofs = table_.dofs(held.first_element + own_piece(support.curve, place.piece));
    for (int i = 0; i < table_.width(); ++i)
      if (dofs[i] >= 0) data.floor[dofs[i]] += by;
  }
}

double RingForces::dissipated(const StepProblem& problem, const VectorX& z) const {
  const NodePlaces acting{model_, z};
  const NodePlaces last = end_of(problem, z);
  double lost = 0.0;
  for (const Held& held : rings_) {
    const RingStep step = step_of(model_, problem, held.support, last);
    if (step.start.left || !step.ring.holds) continue;
    const SplinePlace place = nearest_place(step.curve, step.start.place, last, step.to);
    const double k = step.ring.stiffness, u0 = step.origin(step.fed_from) - step.curve.arc_at(step.start.place),
                 u1 = step.origin(step.fed_to) - step.curve.arc_at(place);
    const double kept = kept_way(step.ring, step.curve, place, point_at(step.curve, place, last, step.to), u1);
    lost += with_found(problem, step, acting, [&](const auto& found, const auto& /*axes*/) {
      if (!found.slips && kept == u1) return 0.0;
      // Energy that both sides add, minus the stored energy. At the end of a step it is T times the slip.
      return problem.in_middle() ? found.tension * (u1 - u0) - 0.5 * k * (kept * kept - u0 * u0)
                                 : found.tension * (u1 - kept);
    });
  }
  return lost;
}

double RingForces::work(const StepProblem& problem, const VectorX& q1) const {
  double done = 0.0;
  for (const Held& held : rings_) {
    const RingStep step = step_of(model_, problem, held.support, {model_, q1});
    if (step.start.left) continue;
    const bool is_carried = carrier_of(model_.supports[at(held.support)]) >= 0;
    done -= with_found(problem, step, middle_of(problem, q1), [&](const auto& found, const auto& /*axes*/) {
      const double by_drive = found.tension * (step.fed_to - step.fed_from);
      return is_carried ? by_drive : found.force().dot(step.to - step.from) + by_drive;
    });
  }
  return done;
}

double RingForces::accept(State& state) const {
  double left_there = 0.0;
  for (const Held& held : rings_) {
    HandState& hand = state.hands[at(held.support)];
    RingState& ring = hand.ring;
    if (const int node = carrier_of(model_.supports[at(held.support)]); node >= 0)
      hand.position = node_position(model_, state.q, node);
    if (ring.left) continue;
    const Passage now = passage_of(model_, state, held.support);
    ring.place = now.place;
    ring.slip += now.slipped;
    ring.left = now.place.beyond;
    if (ring.left) left_there += now.energy;
  }
  return left_there;
}

Passage passage_of(const Model& model, const State& state, int support) {
  const Support& s = model.supports[at(support)];
  const HandState& hand = state.hands[at(support)];
  const NodePlaces nodes{model, state.q};
  const Vector3 centre = centre_of(hand);
  const Ring ring = ring_of(s, centre.norm());
  Passage out;
  out.place = nearest_place(s.curve, hand.ring.place, nodes, centre);
  const SplinePoint<double> point = point_at(s.curve, out.place, nodes, centre);
  out.across = to_eigen(point.across);
  out.at = s.curve.arc_at(out.place);
  double kept = 0.0;
  if (ring.holds) {
    const double u = hand.ring.origin - hand.ring.fed - hand.ring.slip - out.at,
                 slope = spline_arc_slope(s.curve.piece(out.place.piece), out.place.along);
    kept = kept_way(ring, s.curve, out.place, point, u);
    out.slipped = u - kept;
    out.tension = ring.stiffness * kept;
    out.pull = out.tension * slope * std::sqrt(dot(point.along, point.along)) / point.off_slope;
  }
  out.energy = 0.5 * ring.stiffness * (out.across.squaredNorm() + kept * kept);
  return out;
}

}  // namespace withe
