#include "steps/turning_slopes.hpp"

#include <cmath>

#include <Eigen/Geometry>

#include "geometry/rotation.hpp"

namespace withe {
namespace {

/// A direction, and how it follows its vector: I - t t^T over the length.
struct Direction {
  Vector3 tangent;
  double length;
  Matrix3 by;

  explicit Direction(const Vector3& vector) : tangent(vector), length(vector.norm()) {
    tangent /= length;
    by = (Matrix3::Identity() - tangent * tangent.transpose()) / length;
  }
};

/// What follows the edge's vector at z (`by`) and that at the start (`by_start`).
struct VectorSlopes {
  Vector3 value;
  Matrix3 by, by_start;
};
struct NumberSlopes {
  double value;
  Vector3 by, by_start;
};

/// spin = - s x e / G, G = l^2 + l s . e, s the direction at the start.
[[gnu::always_inline]] inline VectorSlopes spin_slopes(const Vector3& edge, const Direction& middle,
                                                       const Direction& start) {
  const Vector3 &s = start.tangent, across = s.cross(edge);
  const double l = middle.length, along = s.dot(edge), inverse = 1.0 / (l * l + l * along);
  const Vector3 grown = 2.0 * edge + along * middle.tangent + l * s, spin = -inverse * across;
  // By the vector at the start, A (I - s s^T) / |e0| with A the derivative by s.
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

/// The couple I omega (e - e0) x e / (h l^3) and the torque's part.
TurningSlopes euler_slopes(const TurningStep& step) {
  const Direction middle(step.edge), start(step.start);
  const double inverse = 1.0 / step.duration, omega = inverse * step.change;
  const double torque = step.inertia * (omega - step.rate) * inverse;
  const double cubed = step.inertia * inverse / (middle.length * middle.length * middle.length);
  VectorSlopes force = spin_slopes(step.edge, middle, start);
  const Vector3 spin = force.value, couple = cubed * step.edge.cross(step.start);  // of omega = 1
  force.by = torque * force.by - (cubed * omega) * cross_matrix(step.start) -
             (3.0 * omega / middle.length) * couple * middle.tangent.transpose();
  force.by_start = torque * force.by_start + (cubed * omega) * cross_matrix(step.edge);
  const double by_rate = step.inertia * inverse;
  TurningSlopes out;
  put(force, inverse * (couple + by_rate * spin), -by_rate * spin, {torque, Vector3::Zero(), Vector3::Zero()},
      by_rate * inverse, -by_rate, out);
  return out;
}

/// Takes away the axial force I r^2 |t1 - t0|^2 / (4 mean cosine) along the edge of energy-momentum steps, r the rate.
void add_axial(const TurningStep& step, double rate, double by_angle, const Direction& middle, const Direction& start,
               const Direction& end, VectorSlopes& force, Vector3& force_by_angle) {
  const Vector3 apart = end.tangent - start.tangent, both = end.tangent + start.tangent;
  const double mean = 0.5 * (start.length + end.length), cosine = 0.5 * both.dot(middle.tangent);
  const double square = apart.squaredNorm(), lower = 4.0 * mean * cosine;
  const double axial = step.inertia * rate * rate * square / lower;
  const double of_square = step.inertia * rate * rate / lower;
  // The end is twice z less the start.
  const Vector3 by_end =
      end.by * (2.0 * of_square * apart - (0.5 * axial / cosine) * middle.tangent) - (0.5 * axial / mean) * end.tangent;
  const Vector3 by_start = -(start.by * (2.0 * of_square * apart + (0.5 * axial / cosine) * middle.tangent)) -
                           (0.5 * axial / mean) * start.tangent;
  const Vector3 by_middle = -(0.5 * axial / cosine) * (middle.by * both);
  force.by -= middle.tangent * (2.0 * by_end + by_middle).transpose() + axial * middle.by;
  force.by_start -= middle.tangent * (by_start - by_end).transpose();
  force_by_angle -= (2.0 * step.inertia * rate * by_angle * square / lower) * middle.tangent;
}

/// The moment m = I (omega1 t1 - omega0 t0) / dt: the force m x t / l and the torque m . t.
TurningSlopes midpoint_slopes(const TurningStep& step) {
  const Direction middle(step.edge), start(step.start), end(2.0 * step.edge - step.start);
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
  VectorSlopes force = spin_slopes(step.edge, middle, start);
  const Vector3 spin = force.value;
  // m x e / l^2.
  const double square = 1.0 / (middle.length * middle.length);
  const Matrix3 arm = -square * cross_matrix(step.edge);
  const Vector3 across = square * moment.cross(step.edge);
  force.by = torque.value * force.by + spin * torque.by.transpose() + arm * by + square * cross_matrix(moment) -
             (2.0 / middle.length) * across * middle.tangent.transpose();
  force.by_start = torque.value * force.by_start + spin * torque.by_start.transpose() + arm * by_start;
  Vector3 force_by_angle = arm * by_angle + torque_by_angle * spin;
  if (finite) add_axial(step, inverse * turn, inverse * by_change, middle, start, end, force, force_by_angle);
  TurningSlopes out;
  put(force, force_by_angle, arm * by_rate + torque_by_rate * spin, torque, torque_by_angle, torque_by_rate, out);
  return out;
}

}  // namespace

TurningSlopes turning_slopes(const TurningStep& step) {
  return step.rule == StepRule::backward_euler ? euler_slopes(step) : midpoint_slopes(step);
}

}  // namespace withe
