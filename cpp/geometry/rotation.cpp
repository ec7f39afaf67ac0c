#include "geometry/rotation.hpp"

#include <cmath>

namespace withe {

Matrix3 rotation_exp(const Vector3& vector) {
  const double angle = vector.norm();
  if (angle < 1e-300) return Matrix3::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

Matrix3 rotation_spin(const Vector3& vector) {
  const double square = vector.squaredNorm(), angle = std::sqrt(square);
  const Matrix3 V = cross_matrix(vector);
  const bool little = angle < 1e-3;
  const double half = angle < 1e-8 ? 1.0 : std::sin(0.5 * angle) / (0.5 * angle),
               second = little ? 1.0 / 6.0 - square / 120.0 : (angle - std::sin(angle)) / (square * angle);
  return Matrix3::Identity() + 0.5 * half * half * V + second * V * V;
}

Vector3 rotation_log(const Matrix3& rotation) {
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  const double s = q.vec().norm();
  if (s < 1e-300) return 2.0 * q.vec();
  return (2.0 * std::atan2(s, q.w()) / s) * q.vec();
}

Matrix3 cayley(const Vector3& w) {
  const double c = 1.0 / (1.0 + 0.25 * w.squaredNorm());
  const Matrix3 W = cross_matrix(w);
  return Matrix3::Identity() + c * (W + 0.5 * W * W);
}

Vector3 cayley_inverse(const Matrix3& rotation) {
  const Vector3 v = rotation_log(rotation);
  const double angle = v.norm();
  return angle < 1e-12 ? v : Vector3((2.0 * std::tan(0.5 * angle) / angle) * v);
}

Matrix3 cayley_spin(const Vector3& w) {
  return (Matrix3::Identity() + 0.5 * cross_matrix(w)) / (1.0 + 0.25 * w.squaredNorm());
}

Matrix3 cayley_moment_slope(const Vector3& w, const Vector3& m) {
  const double c = 1.0 / (1.0 + 0.25 * w.squaredNorm());
  return 0.5 * c * cross_matrix(m) - (0.5 * c * c) * (m - 0.5 * w.cross(m)) * w.transpose();
}

Matrix3 orthonormalized(const Matrix3& rotation) {
  return Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
}

}  // namespace withe
