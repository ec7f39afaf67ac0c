#pragma once
/// Force of a ring over one step, see forces/ring.hpp, and its derivatives by the nodes around the ring.
///
/// An energy-momentum step uses the forces F_i at the middle z, plus forces b |w_i| d_i along the displacements d_i of
/// nodes relative to the ring. The factor b makes their work equal to the change of the energy [Gonzalez 1996,
/// J. Nonlinear Sci. 6, section 3]:
///   b sum |w_i| d_i . d_i = k (r0 + r1) / 2 . (r1 - r0) - T (s1 - s0) - sum F_i . d_i,
/// where T comes from the mean of u at both ends.

#include <limits>

#include "forces/ring.hpp"
#include "model/edge_vectors.hpp"
#include "model/rod_curve.hpp"
#include "steps/step_problem.hpp"

namespace withe {

/// Positions of nodes in space: of one configuration, or interpolated or extrapolated from two.
struct NodePlaces {
  const Model& model;
  const VectorX& q;
  double share = 1.0;              ///< weight of q
  const VectorX* other = nullptr;  ///< has the remaining weight

  Vector3 operator()(int node) const {
    const Vector3 own = node_position(model, q, node);
    return other ? Vector3(share * own + (1.0 - share) * node_position(model, *other, node)) : own;
  }
};

/// A ring over a step.
struct RingStep {
  Ring ring;
  const RodCurve& curve;
  const RingState& start;
  Vector3 from, to;         ///< its positions at both ends of the step [m]
  double fed_from, fed_to;  ///< [m]

  double origin(double fed) const { return start.origin - fed - start.slip; }
};

/// `Size` unknowns of three nodes.
template <int Size>
struct RingFound {
  static constexpr int kAxes = Size / 3;
  using Number = Dual<Size>;
  using Axes = Eigen::Matrix<double, 3, kAxes>;

  SplinePlace place;     ///< place at which forces act
  Vec3<Number> by[3];    ///< generalised forces of the nodes at this place [N]
  double tension = 0.0;  ///< T [N]; its work is that of the drive and of slip, and the energy stored along the rod
  double across = 0.0;   ///< k |r| [N]
  double energy = 0.0;   ///< [J]
  bool slips = false;    ///< true if it slips along the rod, at the limit

  /// Sum of the forces on the nodes [N].
  Vector3 force() const {
    Vector3 sum = Vector3::Zero();
    for (const Vec3<Number>& f : by) sum += Vector3(f.x.value, f.y.value, f.z.value);
    return sum;
  }
};

namespace ring_detail {

template <int Size>
Vec3<Dual<Size>> number(const Vec3<double>& v) {
  return {Dual<Size>(v.x), Dual<Size>(v.y), Dual<Size>(v.z)};
}

/// Position of the i-th node, whose derivative by its own unknowns is `rate`.
template <int Size>
Vec3<Dual<Size>> unknown(const typename RingFound<Size>::Axes& axes, int i, double rate, const Vec3<double>& at) {
  constexpr int n = RingFound<Size>::kAxes;
  Vec3<Dual<Size>> v = number<Size>(at);
  for (int k = 0; k < n; ++k) {
    v.x.slope[i * n + k] = rate * axes(0, k);
    v.y.slope[i * n + k] = rate * axes(1, k);
    v.z.slope[i * n + k] = rate * axes(2, k);
  }
  return v;
}

/// Place where forces act: positions of the nodes relative to the ring, and a.
template <int Size>
struct Middle {
  SplinePiece piece;
  Vec3<Dual<Size>> x[3];
  Dual<Size> along;
};

/// Change from the start of an energy-momentum step to its end. Passages may lie on other pieces of the rod than the
/// passage in the middle. The matrix omits the derivatives by their nodes, which are of second order in the step.
template <int Size>
struct Change {
  Vec3<Dual<Size>> mean, way;  ///< (r0 + r1) / 2, r1 - r0 [m]
  Dual<Size> slid;             ///< s1 - s0 [m]
};

template <int Size>
Change<Size> change_over(const typename RingFound<Size>::Axes& axes, const RingStep& step, const Middle<Size>& middle,
                         const NodePlaces& start, const NodePlaces& end, const SplinePlace& near) {
  const SplinePlace p1 = nearest_place(step.curve, near, end, step.to), &p0 = step.start.place;
  const SplinePiece last = step.curve.piece(p1.piece);
  Vec3<double> x0[3], x1[3];
  place_nodes(last, start, step.from, x0);
  place_nodes(last, end, step.to, x1);
  Vec3<Dual<Size>> to[3];
  for (int i = 0; i < 3; ++i) {
    to[i] = number<Size>(x1[i]);
    for (int j = 0; j < 3; ++j)
      if (last.node[i] >= 0 && last.node[i] == middle.piece.node[j]) to[i] = unknown<Size>(axes, j, 2.0, x1[i]);
  }
  const Dual<Size> along = following_place(last, p1.along, to), beyond = along - p1.along;
  const SplineWeights<Dual<Size>> w = spline_weights(last, along);
  const Vec3<Dual<Size>> r1 = spline_point(w, to).across;
  Change<Size> out;
  out.mean = 0.5 * (number<Size>(point_at(step.curve, p0, start, step.from).across) + r1);
  // Motion of the nodes, and motion of the place along the rod: differences that are exact for any small step.
  out.way = number<Size>(way_between(step.curve, p0, p1, start)) +
            beyond * number<Size>(point_at(step.curve, p1, start, step.from).along);
  for (int i = 0; i < 3; ++i) out.way += w.value[i] * (to[i] - number<Size>(x0[i]));
  out.slid = step.curve.arc_between(p0, p1) + beyond * spline_arc_slope(last, p1.along);
  return out;
}

/// Adds the forces that make the work of the forces in the middle equal to the change of energy.
template <int Size>
void conserve(const typename RingFound<Size>::Axes& axes, const StepProblem& problem, const RingStep& step,
              const NodePlaces& z, const Middle<Size>& middle, RingForce<Dual<Size>>& force, RingFound<Size>& out) {
  using Number = Dual<Size>;
  const NodePlaces start{problem.model, problem.start->q}, end{problem.model, z.q, 2.0 * z.share, &problem.start->q};
  const Change<Size> change = change_over(axes, step, middle, start, end, out.place);
  const double k = step.ring.stiffness;
  Number tension = force.tension;
  if (step.ring.holds)
    tension += k * (spline_arc(middle.piece, middle.along) - step.curve.arc_at(step.start.place) - 0.5 * change.slid);
  out.tension = tension.value;
  Number excess = k * dot(change.mean, change.way) - tension * change.slid, span(0.0);
  Vec3<double> x0[3];
  place_nodes(middle.piece, start, step.from, x0);
  Vec3<Number> d[3];
  Number weight[3];
  const SplineWeights<Number> w = spline_weights(middle.piece, middle.along);
  for (int i = 0; i < 3; ++i) {
    d[i] = 2.0 * (middle.x[i] - number<Size>(x0[i]));
    excess -= dot(force.by[i], d[i]);
    weight[i] = w.value[i].value < 0.0 ? -1.0 * w.value[i] : w.value[i];
    span += weight[i] * dot(d[i], d[i]);
  }
  // Rounding error of places along the rod, which does no work.
  constexpr double kUnsure = 32.0 * std::numeric_limits<double>::epsilon();
  const double edge = step.curve.length.front();
  if (std::abs(excess.value) <= kUnsure * edge * (out.across + std::abs(out.tension)) || span.value == 0.0) return;
  for (int i = 0; i < 3; ++i) force.by[i] += (excess / span * weight[i]) * d[i];
}

}  // namespace ring_detail

/// Forces at the end of a step, or in its middle, with nodes at `z`: the place is not a number (NaN) if the rod is
/// never near the ring.
template <int Size>
RingFound<Size> ring_found(const typename RingFound<Size>::Axes& axes, const StepProblem& problem, const RingStep& step,
                           const NodePlaces& z) {
  using namespace ring_detail;
  const bool in_middle = problem.in_middle();
  const Vector3 centre = in_middle ? Vector3(0.5 * (step.from + step.to)) : step.to;
  const double fed = in_middle ? 0.5 * (step.fed_from + step.fed_to) : step.fed_to;
  RingFound<Size> out;
  out.place = nearest_place(step.curve, step.start.place, z, centre);
  if (!std::isfinite(out.place.along)) return out;
  Middle<Size> middle;
  middle.piece = step.curve.piece(out.place.piece);
  Vec3<double> x[3];
  place_nodes(middle.piece, z, centre, x);
  for (int i = 0; i < 3; ++i)
    middle.x[i] = middle.piece.node[i] < 0 ? number<Size>(x[i]) : unknown<Size>(axes, i, 1.0, x[i]);
  middle.along = following_place(middle.piece, out.place.along, middle.x);
  RingForce<Dual<Size>> force = ring_force(step.ring, middle.piece, middle.along, step.origin(fed), middle.x);
  const Vec3<double> r = point_at(step.curve, out.place, z, centre).across;
  const double k = step.ring.stiffness;
  out.tension = force.tension.value;
  out.slips = out.tension != force.elastic;
  out.across = k * std::sqrt(dot(r, r));
  out.energy = 0.5 * (k * dot(r, r) + out.tension * out.tension / k);
  if (problem.conserves_energy()) conserve(axes, problem, step, z, middle, force, out);
  for (int i = 0; i < 3; ++i) out.by[i] = force.by[i];
  return out;
}

}  // namespace withe
