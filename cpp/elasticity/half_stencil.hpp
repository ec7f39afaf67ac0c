#pragma once
/// Bending and twisting between a frame (of a joint, or of a wall) and an edge, in the unknowns of that half stencil:
/// tail, angle, head, frame, hinge (see elements.hpp).
///
/// The end that is attached to the frame is an edge of unit length. A spin eta of the frame moves its tangent T by
/// eta x T and its directors by T . eta, and is J(w) dw in the Cayley vector w of the frame's turn
/// (geometry/rotation.hpp),
///   J^T v = (v - w x v / 2) / (1 + |w|^2 / 4).
/// A hinge turns the attached end about its axis, after the frame.

#include "elasticity/bend_twist.hpp"

namespace withe {

/// Rotations of an attached end.
template <class Scalar>
struct AttachedEnd {
  int slot;              ///< 0 where the stencil goes from the frame to the edge, else 1
  Vec3<Scalar> tangent;  ///< tangent of the end
  Vec3<Scalar> turn;     ///< Cayley vector w of the frame
  Vec3<Scalar> axis;     ///< axis of the hinge; zero if there is none
};

/// J^T v.
template <class Scalar>
Vec3<Scalar> spin_transposed(const Vec3<Scalar>& w, const Vec3<Scalar>& v) {
  return (1.0 / (1.0 + 0.25 * dot(w, w))) * (v - 0.5 * cross(w, v));
}

/// Applies `map` to every column, and to every row.
template <class Scalar, class Map>
Mat3<Scalar> map_columns(const Mat3<Scalar>& A, const Map& map) {
  const Vec3<Scalar> x = map(Vec3<Scalar>{A.row[0].x, A.row[1].x, A.row[2].x}),
                     y = map(Vec3<Scalar>{A.row[0].y, A.row[1].y, A.row[2].y}),
                     z = map(Vec3<Scalar>{A.row[0].z, A.row[1].z, A.row[2].z});
  return {{{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}}};
}
template <class Scalar, class Map>
Mat3<Scalar> map_rows(const Mat3<Scalar>& A, const Map& map) {
  return {{map(A.row[0]), map(A.row[1]), map(A.row[2])}};
}

template <class Scalar>
Vec3<Scalar> times(const Mat3<Scalar>& A, const Vec3<Scalar>& v) {
  return {dot(A.row[0], v), dot(A.row[1], v), dot(A.row[2], v)};
}
template <class Scalar>
Mat3<Scalar> transposed(const Mat3<Scalar>& A) {
  return {{{A.row[0].x, A.row[1].x, A.row[2].x},
           {A.row[0].y, A.row[1].y, A.row[2].y},
           {A.row[0].z, A.row[1].z, A.row[2].z}}};
}

/// The moment on the frame [N m].
template <class Scalar>
Vec3<Scalar> moment_on_frame(const BendTwistDerivatives<Scalar>& d, const AttachedEnd<Scalar>& end) {
  return cross(end.tangent, d.gradient_e[end.slot]) + d.gradient_angle[end.slot] * end.tangent;
}

template <class Scalar, class Vector>
void put_half_gradient(const BendTwistDerivatives<Scalar>& d, const AttachedEnd<Scalar>& end, Vector& out) {
  const int edge = 1 - end.slot;
  const Vec3<Scalar> moment = moment_on_frame(d, end), by_frame = spin_transposed(end.turn, moment);
  for (int i = 0; i < 3; ++i) {
    out[i] = -d.gradient_e[edge][i];
    out[4 + i] = d.gradient_e[edge][i];
    out[7 + i] = by_frame[i];
  }
  out[3] = d.gradient_angle[edge];
  out[10] = dot(end.axis, moment);
}

/// Second derivatives by the spin of the frame: with itself, with the edge's vector (a row a component of the spin),
/// and with the edge's angle.
template <class Scalar>
struct SpinHessian {
  Mat3<Scalar> spin, edge;
  Vec3<Scalar> angle;
};
template <class Scalar>
SpinHessian<Scalar> spin_hessian(const BendTwistDerivatives<Scalar>& d, const AttachedEnd<Scalar>& end) {
  const int a = end.slot, b = 1 - a;
  const Vec3<Scalar>& T = end.tangent;
  const auto turn = [&T](const Vec3<Scalar>& v) { return cross(T, v); };
  SpinHessian<Scalar> out;
  out.spin = map_rows(map_columns(d.ee[a][a], turn), turn);
  add_outer(out.spin, d.angle_angle[a][a], T, T);
  add_symmetric_outer(out.spin, Scalar(1.0), turn(d.e_angle[a][a]), T);
  add_symmetric_outer(out.spin, Scalar(0.5), d.gradient_e[a], T);
  add_identity(out.spin, -dot(d.gradient_e[a], T));
  out.edge = map_columns(a == 0 ? d.ee[0][1] : transposed(d.ee[0][1]), turn);
  add_outer(out.edge, Scalar(1.0), T, d.e_angle[b][a]);
  out.angle = turn(d.e_angle[a][b]) + d.angle_angle[0][1] * T;
  return out;
}

/// Both triangles.
template <class Scalar, class Matrix>
void put_half_matrix(const BendTwistDerivatives<Scalar>& d, const AttachedEnd<Scalar>& end, Matrix& H) {
  const int b = 1 - end.slot;
  const Vec3<Scalar>&w = end.turn, &axis = end.axis;
  const SpinHessian<Scalar> s = spin_hessian(d, end);
  const auto by_turn = [&w](const Vec3<Scalar>& v) { return spin_transposed(w, v); };
  const Vec3<Scalar> moment = moment_on_frame(d, end), u = moment - 0.5 * cross(w, moment);
  const Scalar c = 1.0 / (1.0 + 0.25 * dot(w, w));
  Mat3<Scalar> frame = map_rows(map_columns(s.spin, by_turn), by_turn);
  add_symmetric_outer(frame, -0.25 * c * c, u, w);
  const Mat3<Scalar> frame_edge = map_columns(s.edge, by_turn);
  const Vec3<Scalar> frame_angle = by_turn(s.angle), on_axis = times(s.spin, axis),
                     frame_hinge = by_turn(on_axis + 0.5 * cross(axis, moment)),
                     edge_hinge = times(transposed(s.edge), axis);
  const auto both = [&H](int i, int j, const Scalar& value) { H[i][j] = H[j][i] = value; };
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Scalar ee = d.ee[b][b].row[i][j], fe = frame_edge.row[i][j];
      H[i][j] = H[4 + i][4 + j] = ee;
      H[i][4 + j] = H[4 + i][j] = -ee;
      H[7 + i][7 + j] = frame.row[i][j];
      both(7 + i, j, -fe);
      both(7 + i, 4 + j, fe);
    }
    const Scalar angle = d.e_angle[b][b][i];
    both(i, 3, -angle);
    both(4 + i, 3, angle);
    both(7 + i, 3, frame_angle[i]);
    both(7 + i, 10, frame_hinge[i]);
    both(i, 10, -edge_hinge[i]);
    both(4 + i, 10, edge_hinge[i]);
  }
  H[3][3] = d.angle_angle[b][b];
  both(3, 10, dot(s.angle, axis));
  H[10][10] = dot(axis, on_axis);
}

}  // namespace withe
