#pragma once
/// Vectors in a plane, as vec3.hpp in space.

#include <type_traits>

namespace withe {

template <class Scalar>
struct Vec2 {
  Scalar x, y;

  Scalar operator[](int k) const { return k == 0 ? x : y; }
  Vec2& operator+=(const Vec2& b) {
    x += b.x;
    y += b.y;
    return *this;
  }
};

template <class Scalar>
Vec2<Scalar> operator+(const Vec2<Scalar>& a, const Vec2<Scalar>& b) {
  return {a.x + b.x, a.y + b.y};
}
template <class Scalar>
Vec2<Scalar> operator-(const Vec2<Scalar>& a, const Vec2<Scalar>& b) {
  return {a.x - b.x, a.y - b.y};
}
template <class Scalar>
Vec2<Scalar> operator-(const Vec2<Scalar>& a) {
  return {-a.x, -a.y};
}
template <class Scalar>
Vec2<Scalar> operator*(const std::type_identity_t<Scalar>& s, const Vec2<Scalar>& a) {
  return {s * a.x, s * a.y};
}
template <class Scalar>
Scalar dot(const Vec2<Scalar>& a, const Vec2<Scalar>& b) {
  return a.x * b.x + a.y * b.y;
}
/// The component that leaves the plane.
template <class Scalar>
Scalar cross(const Vec2<Scalar>& a, const Vec2<Scalar>& b) {
  return a.x * b.y - a.y * b.x;
}
/// Turned by a right angle: the normal times a.
template <class Scalar>
Vec2<Scalar> turned(const Vec2<Scalar>& a) {
  return {-a.y, a.x};
}

/// A 2 x 2 matrix as two rows.
template <class Scalar>
struct Mat2 {
  Vec2<Scalar> row[2];
};

template <class Scalar>
Vec2<Scalar> operator*(const Mat2<Scalar>& A, const Vec2<Scalar>& b) {
  return {dot(A.row[0], b), dot(A.row[1], b)};
}
/// A += s a b^T.
template <class Scalar>
void add_outer(Mat2<Scalar>& A, const std::type_identity_t<Scalar>& s, const Vec2<Scalar>& a, const Vec2<Scalar>& b) {
  A.row[0] += (s * a.x) * b;
  A.row[1] += (s * a.y) * b;
}
/// A += s (a b^T + b a^T).
template <class Scalar>
void add_symmetric_outer(Mat2<Scalar>& A, const std::type_identity_t<Scalar>& s, const Vec2<Scalar>& a,
                         const Vec2<Scalar>& b) {
  add_outer(A, s, a, b);
  add_outer(A, s, b, a);
}
template <class Scalar>
void add_identity(Mat2<Scalar>& A, const std::type_identity_t<Scalar>& s) {
  A.row[0].x += s;
  A.row[1].y += s;
}
/// A += s N, with N b = `turned(b)`.
template <class Scalar>
void add_turned(Mat2<Scalar>& A, const std::type_identity_t<Scalar>& s) {
  A.row[0].y += -s;
  A.row[1].x += s;
}

}  // namespace withe
