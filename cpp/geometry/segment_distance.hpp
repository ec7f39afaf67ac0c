#pragma once
/// Distance of two segments a0 a1 and b0 b1, smooth also where they are parallel.
///
///   W = min over s, t in [0, 1] of |a0 + s u - b0 - t v|^2 + A (s - 1/2)^2 + B (t - 1/2)^2,   D = sqrt(W),
/// with u = a1 - a0, v = b1 - b0. Without A and B this is the distance of [Lumelsky 1985], whose gradient jumps from
/// one end of the overlap to the other as parallel segments turn past each other. With them, small against squared
/// lengths, the problem is strictly convex: D has a continuous gradient everywhere (where D > 0), and parallel segments
/// touch in the middle of their overlap. The free parameters, which are not at an end, define a class: edge to edge,
/// point to edge, or point to point. The second derivative is exact within a class and jumps between classes.

#include <algorithm>
#include <cmath>

#include "geometry/vec3.hpp"

namespace withe {

/// Weights A and B: this times the square of the smaller of a segment's length and of the contact distance.
inline constexpr double kParallelWeight = 1e-3;

/// Closest points of two segments.
struct ClosestPoints {
  double s = 0.5, t = 0.5;              ///< along a and b
  bool s_free = false, t_free = false;  ///< inside, not held at an end
  Vec3<double> between{};               ///< vector from the point of b to the point of a [m]
  double square = 0;                    ///< W [m^2]
};

/// Parameters of a class, as functions of the end points on any scalar.
template <class Scalar>
void solve_parameters(const Vec3<Scalar>& r, const Vec3<Scalar>& u, const Vec3<Scalar>& v, double A, double B,
                      bool s_free, bool t_free, Scalar& s, Scalar& t) {
  const Scalar su = -dot(r, u) + 0.5 * A, tv = dot(r, v) + 0.5 * B;
  if (s_free && t_free) {
    const Scalar uu = dot(u, u) + A, vv = dot(v, v) + B, uv = dot(u, v);
    const Scalar inverse = 1.0 / (uu * vv - uv * uv);
    s = inverse * (vv * su + uv * tv);
    t = inverse * (uv * su + uu * tv);
  } else if (s_free) {
    s = (su + t * dot(u, v)) / (dot(u, u) + A);
  } else if (t_free) {
    t = (tv + s * dot(u, v)) / (dot(v, v) + B);
  }
}

inline ClosestPoints closest_points(const Vec3<double>& a0, const Vec3<double>& a1, const Vec3<double>& b0,
                                    const Vec3<double>& b1, double A, double B) {
  const Vec3<double> r = a0 - b0, u = a1 - a0, v = b1 - b0;
  ClosestPoints best;
  const auto finish = [&](ClosestPoints& p) {
    p.between = r + p.s * u - p.t * v;
    p.square = dot(p.between, p.between) + A * (p.s - 0.5) * (p.s - 0.5) + B * (p.t - 0.5) * (p.t - 0.5);
  };
  solve_parameters(r, u, v, A, B, true, true, best.s, best.t);
  best.s_free = best.t_free = true;
  if (best.s >= 0.0 && best.s <= 1.0 && best.t >= 0.0 && best.t <= 1.0) {
    finish(best);
    return best;
  }
  best.square = INFINITY;
  for (int side = 0; side < 4; ++side) {
    ClosestPoints p;
    double& held = side < 2 ? p.s : p.t;
    double& other = side < 2 ? p.t : p.s;
    bool& other_free = side < 2 ? p.t_free : p.s_free;
    held = side % 2;
    solve_parameters(r, u, v, A, B, side >= 2, side < 2, p.s, p.t);
    other_free = other > 0.0 && other < 1.0;
    other = std::clamp(other, 0.0, 1.0);
    finish(p);
    if (p.square < best.square) best = p;
  }
  return best;
}

/// Shares of the four end points in the gradient: dW = 2 sum_i w_i between . dx_i, over a0, a1, b0, b1.
template <class Scalar>
void end_weights(const Scalar& s, const Scalar& t, Scalar (&w)[4]) {
  w[0] = 1.0 - s;
  w[1] = s;
  w[2] = t - 1.0;
  w[3] = -t;
}

/// Inverse of the second derivative of W / 2 by those of s and t that are free; zero for the others.
inline void parameter_inverse(bool s_free, bool t_free, const Vec3<double>& u, const Vec3<double>& v, double A,
                              double B, double (&K)[2][2]) {
  const double uu = dot(u, u) + A, vv = dot(v, v) + B, uv = dot(u, v);
  K[0][0] = K[0][1] = K[1][0] = K[1][1] = 0.0;
  if (s_free && t_free) {
    const double inverse = 1.0 / (uu * vv - uv * uv);
    K[0][0] = vv * inverse;
    K[1][1] = uu * inverse;
    K[0][1] = K[1][0] = uv * inverse;
  } else if (s_free) {
    K[0][0] = 1.0 / uu;
  } else if (t_free) {
    K[1][1] = 1.0 / vv;
  }
}

/// Second derivative of W / 2 over (a0, a1, b0, b1), 12 x 12: w w^T (x) 1 minus the contribution of the free parameters
/// s and t.
inline void half_square_hessian(const ClosestPoints& p, const Vec3<double>& u, const Vec3<double>& v, double A,
                                double B, double (&H)[12][12]) {
  double w[4];
  end_weights(p.s, p.t, w);
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) H[i][j] = i % 3 == j % 3 ? w[i / 3] * w[j / 3] : 0.0;
  const double d[3] = {p.between.x, p.between.y, p.between.z};
  const double uc[3] = {u.x, u.y, u.z}, vc[3] = {v.x, v.y, v.z};
  const double ws[4] = {-1, 1, 0, 0}, wt[4] = {0, 0, 1, -1};
  double P[2][12];  // derivatives of the derivatives by s and t, by the end points
  for (int i = 0; i < 12; ++i) {
    P[0][i] = ws[i / 3] * d[i % 3] + w[i / 3] * uc[i % 3];
    P[1][i] = wt[i / 3] * d[i % 3] - w[i / 3] * vc[i % 3];
  }
  double K[2][2];
  parameter_inverse(p.s_free, p.t_free, u, v, A, B, K);
  for (int i = 0; i < 12; ++i) {
    const double a = K[0][0] * P[0][i] + K[0][1] * P[1][i], b = K[1][0] * P[0][i] + K[1][1] * P[1][i];
    for (int j = 0; j < 12; ++j) H[i][j] -= a * P[0][j] + b * P[1][j];
  }
}

}  // namespace withe
