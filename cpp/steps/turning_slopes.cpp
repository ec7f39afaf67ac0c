#include "steps/turning_slopes.hpp"

#include <cmath>

#include <Eigen/Geometry>

#include "geometry/rotation.hpp"

namespace withe {
namespace {

/// A direction, and its derivative by its vector: (I - t t^T) / length.
struct Direction {
  Vector3 tangent;
  double length;
  Matrix3 by;

  explicit Direction(const Vector3& vector) : tangent(vector), length(vector.norm()) {
    tangent /= length;
    by = (Matrix3::Identity() - tangent * tangent.transpose()) / length;
  }
};

/// Derivatives by the vector of the edge at z (`by`) and at the start (`by_start`).
struct VectorSlopes {
  Vector3 value;
  Matrix3 by, by_start;
};
struct NumberSlopes {
  double value;
  Vector3 by, by_start;
};

/// spin = - s x e / G with G = l^2 + l s . e, where s is the direction at the start.
[[gnu::always_inline]] inline VectorSlopes spin_slopes(const Vector3& edge, const Direction& middle,
                                                       const Direction& start) {
  const Vector3 &s = start.tangent, across = s.cross(edge);
  const double l = middle.length, along = s.dot(edge), inverse = 1.0 / (l * l + l * along);
  const Vector3 grown = 2.0 * edge + along * middle.tangent + l * s, spin = -inverse * across;
  // The derivative by the vector at the start is A (I - s s^T) / |e0|, where A is the derivative by s.
  const Matrix3 by_direction = inverse * cross_matrix(edge) - (inverse * l) * spin * edge.transpose();
  const Vector3 along_start = by_direction * s;
  return {spin, -inverse * cross_matrix(s) - inverse * spin * grown.transpose(),
          (1.0 / start.length) * (by_direction - along_start * s.transpose())};
}

[[gnu::always_inline]] inline void put(const VectorSlopes& force, const Vector3& by_angle, const Vector3& by_rate,
                                       const NumberSlopes& torque, double torque_by_angle, double torque_by_rate,
                                       TurningSlopes& out) {
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      out.by[i][k] = force.by(i, k);
      out.by[i][4 + k] = force.by_start(i, k);
    }
    out.by[i][3] = by_angle(i);
    out.by[i][7] = -by_angle(i);
    out.by[i][8] = by_rate(i);
    out.by[3][i] = torque.by(i);
    out.by[3][4 + i] = torque.by_start(i);
  }
  out.by[3][3] = torque_by_angle;
  out.by[3][7] = -torque_by_angle;
  out.by[3][8] = torque_by_rate;
}

/// Derivatives of the couple I omega (e - e0) x e / (h l^3), and of the contribution of the torque.
///
/// Both lie along x = s x e, with the factor -I omega l0 / (h l^3) for the couple and -1 / G for the spin. Their
/// derivatives contain a rotation of x and a change of its factor: [a] + x g^T by the vector at z, and [b] + x k^T by
/// the vector at the start. The vector a is along s, and b along e.
void set_euler_slopes(const TurningStep& step, TurningSlopes& out) {
  const Vec3d& e = step.edge;
  const double l = std::sqrt(dot(e, e)), l0 = std::sqrt(dot(step.start, step.start));
  const double inverse = 1.0 / step.duration, inverse0 = 1.0 / l0, by_rate = step.inertia * inverse;
  const Vec3d s = inverse0 * step.start, x = cross(s, e);
  const double along = dot(s, e), of_length = 1.0 / l, square = of_length * of_length, spin = 1.0 / (l * (l + along));
  const double omega = inverse * step.change, torque = by_rate * (omega - step.rate);
  const double couple = by_rate * square * of_length, grown = torque * spin * spin;
  const Vec3d by_angle = (-inverse * (couple * l0 + by_rate * spin)) * x, by_spin = (by_rate * spin) * x,
              a = -(torque * spin + omega * couple * l0) * s, b = (torque * spin * inverse0 + omega * couple) * e,
              g = (grown * (2.0 + along * of_length) + 3.0 * omega * couple * l0 * square) * e + (grown * l) * s,
              k = (grown * l * inverse0) * (e + l * s);
  const auto set_row = [&](int row, const Vec3d& turn, const Vec3d& turn_start) {
    const double factor = x[row];
    for (int i = 0; i < 3; ++i) {
      out.by[row][i] = turn[i] + factor * g[i];
      out.by[row][4 + i] = turn_start[i] + factor * k[i];
    }
    out.by[row][3] = by_angle[row];
    out.by[row][7] = -by_angle[row];
    out.by[row][8] = by_spin[row];
  };
  set_row(0, {0.0, -a.z, a.y}, {0.0, -b.z, b.y});
  set_row(1, {a.z, 0.0, -a.x}, {b.z, 0.0, -b.x});
  set_row(2, {-a.y, a.x, 0.0}, {-b.y, b.x, 0.0});
  for (int i = 0; i < 3; ++i) out.by[3][i] = out.by[3][4 + i] = 0.0;
  out.by[3][3] = by_rate * inverse;
  out.by[3][7] = -by_rate * inverse;
  out.by[3][8] = -by_rate;
}

/// Subtracts the axial force I r^2 |t1 - t0|^2 / (4 mean cosine) along the edge of energy-momentum steps, where r is
/// the rate.
void add_axial(const TurningStep& step, double rate, double by_angle, const Direction& middle, const Direction& start,
               const Direction& end, VectorSlopes& force, Vector3& force_by_angle) {
  const Vector3 apart = end.tangent - start.tangent, both = end.tangent + start.tangent;
  const double mean = 0.5 * (start.length + end.length), cosine = 0.5 * both.dot(middle.tangent);
  const double square = apart.squaredNorm(), lower = 4.0 * mean * cosine;
  const double axial = step.inertia * rate * rate * square / lower;
  const double of_square = step.inertia * rate * rate / lower;
  // The end is q1 = 2 z - q0.
  const Vector3 by_end =
      end.by * (2.0 * of_square * apart - (0.5 * axial / cosine) * middle.tangent) - (0.5 * axial / mean) * end.tangent;
  const Vector3 by_start = -(start.by * (2.0 * of_square * apart + (0.5 * axial / cosine) * middle.tangent)) -
                           (0.5 * axial / mean) * start.tangent;
  const Vector3 by_middle = -(0.5 * axial / cosine) * (middle.by * both);
  force.by -= middle.tangent * (2.0 * by_end + by_middle).transpose() + axial * middle.by;
  force.by_start -= middle.tangent * (by_start - by_end).transpose();
  force_by_angle -= (2.0 * step.inertia * rate * by_angle * square / lower) * middle.tangent;
}

/// The moment m = I (omega1 t1 - omega0 t0) / dt gives the force m x t / l and the torque m . t.
void set_midpoint_slopes(const TurningStep& step, TurningSlopes& out) {
  const Vector3 edge = to_eigen(step.edge), at_start = to_eigen(step.start);
  const Direction middle(edge), start(at_start), end(2.0 * edge - at_start);
  const bool finite = step.rule == StepRule::energy_momentum;
  const double inverse = 1.0 / step.duration, tangent = std::tan(step.change), scale = step.inertia * inverse;
  const double turn = finite ? 2.0 * tangent : 2.0 * step.change,
               by_change = finite ? 2.0 * (1.0 + tangent * tangent) : 2.0;
  const double omega = 2.0 * inverse * turn - step.rate;
  const Vector3 moment = scale * (omega * end.tangent - step.rate * start.tangent);
  const Matrix3 by = (2.0 * scale * omega) * end.by, by_start = -0.5 * by - (scale * step.rate) * start.by;
  const Vector3 by_angle = (2.0 * scale * inverse * by_change) * end.tangent,
                by_rate = -scale * (end.tangent + start.tangent);
  const NumberSlopes torque{moment.dot(middle.tangent), by.transpose() * middle.tangent + middle.by * moment,
                            by_start.transpose() * middle.tangent};
  const double torque_by_angle = by_angle.dot(middle.tangent), torque_by_rate = by_rate.dot(middle.tangent);
  VectorSlopes force = spin_slopes(edge, middle, start);
  const Vector3 spin = force.value;
  // m x e / l^2.
  const double square = 1.0 / (middle.length * middle.length);
  const Matrix3 arm = -square * cross_matrix(edge);
  const Vector3 across = square * moment.cross(edge);
  force.by = torque.value * force.by + spin * torque.by.transpose() + arm * by + square * cross_matrix(moment) -
             (2.0 / middle.length) * across * middle.tangent.transpose();
  force.by_start = torque.value * force.by_start + spin * torque.by_start.transpose() + arm * by_start;
  Vector3 force_by_angle = arm * by_angle + torque_by_angle * spin;
  if (finite) add_axial(step, inverse * turn, inverse * by_change, middle, start, end, force, force_by_angle);
  put(force, force_by_angle, arm * by_rate + torque_by_rate * spin, torque, torque_by_angle, torque_by_rate, out);
}

}  // namespace

void set_turning_slopes(const TurningStep& step, TurningSlopes& out) {
  step.rule == StepRule::backward_euler ? set_euler_slopes(step, out) : set_midpoint_slopes(step, out);
}

}  // namespace withe
