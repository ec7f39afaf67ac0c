#include "elastica/rod_stability.hpp"

#include <cmath>
#include <cstddef>
#include <vector>

namespace withe {

namespace {

using Matrix = std::array<RodVector, 3>;

double dot(const RodVector& a, const RodVector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
RodVector cross(const RodVector& a, const RodVector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
/// a x as a matrix.
Matrix skew(const RodVector& a) { return {{{0, -a[2], a[1]}, {a[2], 0, -a[0]}, {-a[1], a[0], 0}}}; }

template <class Function>
Matrix filled(const Function& f) {
  Matrix m;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) m[i][j] = f(i, j);
  return m;
}
Matrix product(const Matrix& a, const Matrix& b) {
  return filled(
      [&](std::size_t i, std::size_t j) { return a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j]; });
}
Matrix transposed_product(const Matrix& a, const Matrix& b) {  // a^T b
  return filled(
      [&](std::size_t i, std::size_t j) { return a[0][i] * b[0][j] + a[1][i] * b[1][j] + a[2][i] * b[2][j]; });
}
void add(Matrix& a, double factor, const Matrix& b) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) a[i][j] += factor * b[i][j];
}

/// Inverse of a symmetric matrix and how many of its eigenvalues are negative, by Sylvester's law on its minors.
Matrix inverse(const Matrix& m, int& negative) {
  const Matrix cofactors = filled([&](std::size_t i, std::size_t j) {
    const std::size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
    return m[a][c] * m[b][d] - m[a][d] * m[b][c];
  });
  const double determinant = dot(m[0], cofactors[0]);
  const double minors[] = {1.0, m[0][0], m[0][0] * m[1][1] - m[0][1] * m[1][0], determinant};
  for (int i = 0; i < 3; ++i) negative += (minors[i] < 0) != (minors[i + 1] < 0);
  return filled([&](std::size_t i, std::size_t j) { return cofactors[j][i] / determinant; });
}

/// The quadratic form of one element over f at its ends and c.
struct Element {
  Matrix before{}, between{}, after{};      // 11, 12, 22
  Matrix before_end{}, after_end{}, end{};  // 1c, 2c, cc
};

Element element(const RodShape& shape, std::size_t i, double twist_stiffness) {
  // At the middle, from both ends.
  const RodPoint &a = shape.points[i], &b = shape.points[i + 1];
  const double h = shape.places[i + 1] - shape.places[i], s = 0.5 * (shape.places[i + 1] + shape.places[i]);
  RodVector t, m;
  for (std::size_t k = 0; k < 3; ++k) {
    t[k] = a.tangent[k] + b.tangent[k];
    m[k] = 0.5 * (a.moment[k] + b.moment[k]);
  }
  const double size = std::sqrt(dot(t, t));
  for (double& x : t) x /= size;
  const RodVector n{-shape.floor_force[0], -shape.floor_force[1], s - shape.floor_force[2]};
  const double compliance = 1.0 / shape.stretch_stiffness, stretch = 1.0 + compliance * dot(n, t);
  const RodVector shear = cross(t, n);
  const auto unit = [](std::size_t r, std::size_t c) { return r == c ? 1.0 : 0.0; };
  const Matrix stiffness = filled([&](std::size_t r, std::size_t c) {
    return (kRodBendStiffness * (unit(r, c) - t[r] * t[c]) + twist_stiffness * t[r] * t[c]) / h;
  });
  const Matrix weight = filled([&](std::size_t r, std::size_t c) {
    const double turned = stretch * (dot(n, t) * unit(r, c) - 0.5 * (n[r] * t[c] + t[r] * n[c]));
    return 0.25 * h * (turned - compliance * shear[r] * shear[c]);
  });
  // -1/2 m.(f x f') h = -1/2 m.(f1 x f2) = 1/2 f1.(m x f2).
  const Matrix moment = skew(m);
  Element found;
  found.before = found.after = stiffness;
  add(found.before, 1.0, weight);
  add(found.after, 1.0, weight);
  found.between = weight;
  add(found.between, -1.0, stiffness);
  add(found.between, 0.5, moment);
  found.before_end = filled(
      [&](std::size_t r, std::size_t c) { return 0.5 * h * (stretch * skew(t)[r][c] + compliance * shear[r] * t[c]); });
  found.after_end = found.before_end;
  found.end = filled([&](std::size_t r, std::size_t c) { return -h * compliance * t[r] * t[c]; });
  return found;
}

}  // namespace

bool rod_is_stable(const RodShape& shape, double twist_stiffness) {
  // Block elimination of f from node to node. The remaining part of c is eliminated at the end. f is zero at both
  // ends.
  int negative = 0;
  Element last = element(shape, 0, twist_stiffness);
  Matrix pivot = last.after, by_end = last.after_end, end = last.end;
  for (std::size_t i = 1; i + 1 < shape.points.size(); ++i) {
    const Element next = element(shape, i, twist_stiffness);
    add(pivot, 1.0, next.before);
    add(by_end, 1.0, next.before_end);
    const Matrix inverted = inverse(pivot, negative);
    const Matrix to_after = product(inverted, next.between), to_end = product(inverted, by_end);
    pivot = next.after;
    add(pivot, -1.0, transposed_product(next.between, to_after));
    add(end, -1.0, transposed_product(by_end, to_end));
    Matrix carried = next.after_end;
    add(carried, -1.0, transposed_product(next.between, to_end));
    by_end = carried;
    add(end, 1.0, next.end);
  }
  inverse(end, negative);
  return negative == 3;
}

}  // namespace withe
