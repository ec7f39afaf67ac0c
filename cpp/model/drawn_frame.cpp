#include "model/drawn_frame.hpp"

namespace withe {

/// With J(v) dv the spin of exp(v): v changes by J(v)^-1 (w1 - R w0) where the frames turn by w0 and w1, R = F1 F0^T.
DrawnFrameSlopes drawn_frame_slopes(const FrameEdges& at, const Matrix3& before, const Matrix3& after, double l0,
                                    double l1) {
  if (at.alone()) return {Matrix3::Identity(), Matrix3::Zero(), Vector3::Zero(), Vector3::Zero()};
  using enum FrameEdges::Place;
  const Matrix3 rotation = after * before.transpose();
  const Vector3 turn = rotation_log(rotation);
  const double share = at.share(l0, l1), square = (l0 + l1) * (l0 + l1);
  const Matrix3 part = rotation_exp(share * turn),
                by_turn = share * rotation_spin(share * turn) * rotation_spin(turn).inverse();
  DrawnFrameSlopes out{-by_turn * rotation, by_turn, Vector3::Zero(), Vector3::Zero()};
  (at.place == end ? out.after : out.before) += part;
  const double sign = at.place == between ? 1.0 : -1.0;  // sign of the derivative of the share by l0
  out.length0 = (sign * l1 / square) * turn;
  out.length1 = (-sign * l0 / square) * turn;
  return out;
}

}  // namespace withe
