#include "contact/pressing.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <type_traits>

#include "common/dual.hpp"
#include "contact/mean_points.hpp"
#include "contact/plane_contact.hpp"

namespace withe {
namespace {

template <class Scalar>
Scalar unknown(double value, int index) {
  if constexpr (std::is_same_v<Scalar, double>)
    return value;
  else
    return Scalar::unknown(value, index);
}

/// Pressing along the gradient of D at the end of the step.
void add_end_pressing(const Touching& t, bool with_hessian, bool geometric, ContactLocal& out) {
  const ContactPair& pair = t.pair;
  const ClosestPoints& points = t.proximity.points;
  double w[4], g[12];
  end_weights(points.s, points.t, w);
  // dD = sum w_i (between / D) . dx_i: |between| differs from D by the weights of closest_points.
  const Vec3d direction = (1.0 / t.proximity.distance) * points.between;
  const double n[3] = {direction.x, direction.y, direction.z};
  for (int i = 0; i < 12; ++i) {
    g[i] = w[i / 3] * n[i % 3];
    out.gradient[i] += t.pressing.first * g[i];
  }
  if (!with_hessian) return;
  Vec3d x[4];
  t.end_points(x);
  double H[12][12];
  half_square_hessian(points, x[1] - x[0], x[3] - x[2], pair.weight_a, pair.weight_b, H);
  const double turn = geometric ? t.pressing.first / t.proximity.distance : 0.0;
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) out.hessian[i][j] += turn * H[i][j] + (t.pressing.by_end - turn) * g[i] * g[j];
}

/// Pressing of a point on a face: along the gradient of D at the end of the step, or in the mean of a step. Then the
/// work is the change of D, and the forces are in balance.
void add_face_pressing(const ContactProblem& problem, const Touching& t, bool with_hessian, bool geometric,
                       ContactLocal& out) {
  const ContactPair& pair = t.pair;
  const FacePressing f(problem, t);
  for (int i = 0; i < 12; ++i) {
    out.gradient[i] += t.pressing.first * f.along[i];
    for (int j = 0; j < 12 && with_hessian; ++j)
      out.hessian[i][j] += t.pressing.by_end * (geometric ? f.along : f.end)[i] * f.end[j];
  }
  if (with_hessian && geometric) add_face_hessian(pair.point, f.share * t.pressing.first * f.over, out.hessian);
}

/// From the gradient of D at the end of the step to the mean of `add_curve_pressing`.
void add_curve_start(const ContactProblem& problem, const Touching& t, bool geometric, double (&along)[9],
                     double (*derivative)[9]) {
  const ContactPair& pair = t.pair;
  Vec3d x0[4], x1[4];
  t.end_points(x1);
  problem.bodies.end_points(pair, problem.start->q, x0);
  const CurveDistance<double> start = problem.curve_at_start(pair);
  const Vec3d shift = problem.shift_of(pair);
  double way[9] = {};
  for (int i = 0; i < 3 * pair.piece.weights->nodes; ++i) way[i] = (x1[i / 3] - x0[i / 3] - shift)[i % 3];
  add_start_direction(curve_slopes(pair.piece, start).distance, way, t.proximity.distance - start.distance, geometric,
                      along, derivative);
}

/// Pressing of a smooth curve, along the gradient of D at the end of the step. If the force is constant in the whole
/// step and the matrix need not be symmetric, it acts along the gradients at the start and the end. With their shares b
/// and 1 - b the force does the work f (D1 - D0). If a ring rolls, the points that touch at the end have reached the
/// surface during the step. The force of these points alone would slow the ring.
void add_curve_pressing(const ContactProblem& problem, const Touching& t, bool with_hessian, bool geometric,
                        ContactLocal& out) {
  const CurvePiece& piece = t.pair.piece;
  const CurveDistance<double>& end = t.proximity.curve;
  const CurveSlopes slopes = curve_slopes(piece, end);
  double along[9], derivative[9][9];
  std::copy(slopes.distance, slopes.distance + 9, along);
  if (with_hessian) {
    std::fill(&derivative[0][0], &derivative[0][0] + 81, 0.0);
    if (geometric) add_curve_hessian(piece, problem.bodies.obstacle(t.pair), end, slopes, 1.0, 9, &derivative[0][0]);
  }
  if (problem.means_direction()) add_curve_start(problem, t, geometric, along, with_hessian ? derivative : nullptr);
  for (int i = 0; i < 9; ++i) {
    out.gradient[i] += t.pressing.first * along[i];
    for (int j = 0; j < 9 && with_hessian; ++j)
      out.hessian[i][j] += t.pressing.first * derivative[i][j] + t.pressing.by_end * along[i] * slopes.distance[j];
  }
}

/// If `ContactProblem::turns`, the force f (see pressing_law.hpp) pushes at the points of mean_points.hpp,
/// between the closest points at the start and at the end. Pressing then neither turns nor brakes a rod, and adds no
/// energy.
template <class Scalar>
void set_mean_pressing(const ContactProblem& problem, const Touching& t, Scalar (&out)[12]) {
  Vec3d start[4], end[4];
  const ClosestPoints first = problem.closest_at_start(t.pair, start);
  t.end_points(end);
  Vec3<Scalar> x0[4], x1[4];
  for (int i = 0; i < 4; ++i) {
    x0[i] = {Scalar(start[i].x), Scalar(start[i].y), Scalar(start[i].z)};
    x1[i] = {unknown<Scalar>(end[i].x, 3 * i), unknown<Scalar>(end[i].y, 3 * i + 1),
             unknown<Scalar>(end[i].z, 3 * i + 2)};
  }
  const MeanPoints<Scalar> mean = mean_points(t.pair, first, t.proximity.points, x0, x1);
  const Scalar force = chain(mean.end, t.pressing.first, t.pressing.by_end) / (mean.start + mean.end);
  for (int i = 0; i < 4; ++i) {
    const Vec3<Scalar> on_node = (force * mean.weight[i]) * mean.ways;
    out[3 * i] = on_node.x;
    out[3 * i + 1] = on_node.y;
    out[3 * i + 2] = on_node.z;
  }
}

void add_mean_pressing(const ContactProblem& problem, const Touching& t, bool with_derivative, ContactLocal& out) {
  if (!with_derivative) {
    double gradient[12];
    set_mean_pressing(problem, t, gradient);
    for (int i = 0; i < 12; ++i) out.gradient[i] += gradient[i];
    return;
  }
  Dual<12> gradient[12];
  set_mean_pressing(problem, t, gradient);
  for (int i = 0; i < 12; ++i) {
    out.gradient[i] += gradient[i].value;
    for (int j = 0; j < 12; ++j) out.hessian[i][j] += gradient[i].slope[j];
  }
}

}  // namespace

FacePressing::FacePressing(const ContactProblem& problem, const Touching& t) {
  const Face& face = *t.pair.face;
  const double point = t.pair.point;
  Vec3d x[4];
  t.end_points(x);
  FaceVectors<double> v(x, point);
  over = v.over(face);
  face_gradient(v, point, over, end);
  std::copy(std::begin(end), std::end(end), along);
  if (!problem.turns(t.pair)) return;
  share = 0.5;
  problem.bodies.end_points(t.pair, problem.start->q, x);
  const FaceVectors<double> start(x, point);
  v.point = 0.5 * (v.point + start.point);
  v.edge = 0.5 * (v.edge + start.edge);
  face_gradient(v, point, over, along);
}

void distance_slope(const Touching& t, double (&out)[12]) {
  std::fill(std::begin(out), std::end(out), 0.0);
  if (t.pair.curve()) {
    const CurveSlopes slopes = curve_slopes(t.pair.piece, t.proximity.curve);
    std::copy(slopes.distance, slopes.distance + 9, out);
    return;
  }
  if (t.pair.face != nullptr) {
    Vec3d x[4];
    t.end_points(x);
    const FaceVectors<double> v(x, t.pair.point);
    face_gradient(v, t.pair.point, v.over(*t.pair.face), out);
    return;
  }
  double w[4];
  end_weights(t.proximity.points.s, t.proximity.points.t, w);
  const Vec3d direction = (1.0 / t.proximity.distance) * t.proximity.points.between;
  for (int i = 0; i < 12; ++i) out[i] = w[i / 3] * direction[i % 3];
}

void add_pressing(const ContactProblem& problem, const Touching& t, bool with_hessian, bool geometric,
                  ContactLocal& out) {
  if (beside_plane(problem, t)) {
    add_plane_contact(problem, t, PlaneForces::pressing, {.geometric = geometric}, with_hessian, out);
    return;
  }
  if (t.pair.curve()) {
    add_curve_pressing(problem, t, with_hessian, geometric, out);
    return;
  }
  if (t.pair.face != nullptr) {
    add_face_pressing(problem, t, with_hessian, geometric, out);
    return;
  }
  if (!problem.turns(t.pair)) {
    add_end_pressing(t, with_hessian, geometric, out);
    return;
  }
  add_mean_pressing(problem, t, with_hessian && geometric, out);
  if (!with_hessian || geometric) return;
  ContactLocal straight{};
  add_end_pressing(t, true, false, straight);
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) out.hessian[i][j] += straight.hessian[i][j];
}

}  // namespace withe
