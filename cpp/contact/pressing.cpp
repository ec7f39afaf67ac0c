#include "contact/pressing.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "contact/plane_contact.hpp"

namespace withe {
namespace {

/// Along the gradient of D at the end of the step.
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

/// Of a smooth curve, along the gradient of D at the end of the step; or, where its force is that of the whole step and
/// the matrix need not be symmetric, along the gradients at the start and the end in those shares b and 1 - b with
/// which it does the work f (D1 - D0): where a ring rolls, the points that touch at the end came down onto the surface
/// within the step, and their force alone would slow it.
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

/// Adds the derivative of `add_mean_pressing`, in which d0 and d1 are the ways between the closest points at the start
/// and the end, and `before` is D0.
void add_mean_derivative(const Touching& t, const Vec3d (&start)[4], const Vec3d& d0, double before,
                         ContactLocal& out) {
  const ContactPair& pair = t.pair;
  const ClosestPoints& points = t.proximity.points;
  Vec3d x[4];
  t.end_points(x);
  double w[4];
  end_weights(points.s, points.t, w);
  const Vec3d& d1 = points.between;
  const Vec3d mean = d0 + d1;
  const double sum = before + t.proximity.distance, force = t.pressing.first / sum;
  const Vec3d u = x[1] - x[0], v = x[3] - x[2], u0 = start[1] - start[0], v0 = start[3] - start[2];
  const double ws[4] = {-1, 1, 0, 0}, wt[4] = {0, 0, 1, -1};
  double K[2][2];
  parameter_inverse(points.s_free, points.t_free, u, v, pair.weight_a, pair.weight_b, K);
  for (int j = 0; j < 12; ++j) {
    const int n = j / 3, k = j % 3;
    const double by_s = ws[n] * d1[k] + w[n] * u[k], by_t = wt[n] * d1[k] - w[n] * v[k];
    const double ds = -K[0][0] * by_s - K[0][1] * by_t, dt = -K[1][0] * by_s - K[1][1] * by_t;
    const Vec3d moved0 = ds * u0 - dt * v0, moved1 = ds * u - dt * v;
    const double spread = pair.weight_a * (points.s - 0.5) * ds + pair.weight_b * (points.t - 0.5) * dt;
    const double distance = w[n] * d1[k] / t.proximity.distance;
    const double earlier = (dot(d0, moved0) + spread) / before;
    const double change =
        (t.pressing.by_end * distance + t.pressing.by_start * earlier - force * (distance + earlier)) / sum;
    for (int i = 0; i < 12; ++i) {
      const double share = ws[i / 3] * ds + wt[i / 3] * dt;
      const double turned = moved0[i % 3] + moved1[i % 3] + (i % 3 == k ? w[n] : 0.0);
      out.hessian[i][j] += (w[i / 3] * change + force * share) * mean[i % 3] + force * w[i / 3] * turned;
    }
  }
}

/// Where `ContactProblem::turns` says so, the force f (see pressing_law.hpp) pushes along the mean of the way d1
/// between the closest points at the end and the way d0 between those same points of both rods at the start,
///   f w_i (d0 + d1) / (D0 + D1),   D0 = sqrt(|d0|^2 + D1^2 - |d1|^2),
/// whose work over the step is f (D1 - D0). As no points were closer at the start than the closest, and E is convex,
/// that is never more than what the contact gave: pressing gains no energy, however far surfaces slide. And the force
/// points along the way between the points in the middle of the step: it turns nothing there.
void add_mean_pressing(const ContactProblem& problem, const Touching& t, bool with_derivative, ContactLocal& out) {
  double w[4];
  end_weights(t.proximity.points.s, t.proximity.points.t, w);
  Vec3d start[4], d0{};
  problem.start_points(t.pair, start);
  const Vec3d& d1 = t.proximity.points.between;
  for (int i = 0; i < 4; ++i) d0 += w[i] * start[i];
  const double before =
      std::sqrt(std::max(dot(d0, d0) + t.proximity.distance * t.proximity.distance - dot(d1, d1), 0.0));
  const double force = t.pressing.first / (before + t.proximity.distance);
  const Vec3d mean = d0 + d1;
  for (int i = 0; i < 12; ++i) out.gradient[i] += force * w[i / 3] * mean[i % 3];
  if (with_derivative) add_mean_derivative(t, start, d0, before, out);
}

}  // namespace

void distance_slope(const Touching& t, double (&out)[12]) {
  std::fill(std::begin(out), std::end(out), 0.0);
  if (t.pair.curve()) {
    const CurveSlopes slopes = curve_slopes(t.pair.piece, t.proximity.curve);
    std::copy(slopes.distance, slopes.distance + 9, out);
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
