#pragma once
/// A three-vector on any scalar (double or a SIMD pack), free of Eigen so that kernels compile alike for
/// every instruction set.

#include <type_traits>

namespace withe {

template <class Scalar>
struct Vec3 {
  Scalar x, y, z;

  Scalar operator[](int k) const { return k == 0 ? x : k == 1 ? y : z; }
  Vec3& operator+=(const Vec3& b) {
    x += b.x;
    y += b.y;
    z += b.z;
    return *this;
  }
  Vec3& operator-=(const Vec3& b) {
    x -= b.x;
    y -= b.y;
    z -= b.z;
    return *this;
  }
};

using Vec3d = Vec3<double>;

template <class Scalar>
Vec3<Scalar> operator+(const Vec3<Scalar>& a, const Vec3<Scalar>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Scalar>
Vec3<Scalar> operator-(const Vec3<Scalar>& a, const Vec3<Scalar>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Scalar>
Vec3<Scalar> operator-(const Vec3<Scalar>& a) {
  return {-a.x, -a.y, -a.z};
}
template <class Scalar>
Vec3<Scalar> operator*(const std::type_identity_t<Scalar>& s, const Vec3<Scalar>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class Scalar>
Scalar dot(const Vec3<Scalar>& a, const Vec3<Scalar>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Scalar>
Vec3<Scalar> cross(const Vec3<Scalar>& a, const Vec3<Scalar>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A 3 x 3 matrix as three rows.
template <class Scalar>
struct Mat3 {
  Vec3<Scalar> row[3];
};

/// A += s a b^T.
template <class Scalar>
void add_outer(Mat3<Scalar>& A, const std::type_identity_t<Scalar>& s, const Vec3<Scalar>& a, const Vec3<Scalar>& b) {
  const Scalar rows[3] = {s * a.x, s * a.y, s * a.z};
  for (int i = 0; i < 3; ++i) A.row[i] += rows[i] * b;
}
/// A += s (a b^T + b a^T).
template <class Scalar>
void add_symmetric_outer(Mat3<Scalar>& A, const std::type_identity_t<Scalar>& s, const Vec3<Scalar>& a,
                         const Vec3<Scalar>& b) {
  add_outer(A, s, a, b);
  add_outer(A, s, b, a);
}
template <class Scalar>
void add_identity(Mat3<Scalar>& A, const std::type_identity_t<Scalar>& s) {
  A.row[0].x += s;
  A.row[1].y += s;
  A.row[2].z += s;
}
/// A += s [a]_x, with [a]_x b = a x b.
template <class Scalar>
void add_cross(Mat3<Scalar>& A, const std::type_identity_t<Scalar>& s, const Vec3<Scalar>& a) {
  A.row[0].y -= s * a.z;
  A.row[0].z += s * a.y;
  A.row[1].x += s * a.z;
  A.row[1].z -= s * a.x;
  A.row[2].x -= s * a.y;
  A.row[2].y += s * a.x;
}

}  // namespace withe
