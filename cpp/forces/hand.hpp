#pragma once
/// An elastic connection between a hand and a point of a rod, with the frame of the edge that contains the point.
///
/// The hand is at p and has the axes R. It has grasped the point at p + R a, with the directors G = R F (columns d1,
/// d2, t). Then
///   E = (K u . u) / 2 + (C1 r1^2 + C2 r2^2 + C3 r3^2) / 2,   u = G^T (x - p - R a) - s.
/// Here x is the present position of the point, and s its slip. K = diag(k1, k2, k3) [N/m] acts along d1, d2, t. The
/// strains r from G to the edge's frame are those of elasticity/bend_twist.hpp, with the stiffnesses C1, C2, C3
/// [N m/rad] about d1, d2, t. They equal the rotation vector between the frames if the rod only bends or only twists.
///
/// The force on the rod is f = -G K u at x. If the hand moves by dp and turns by dw, the work of its wrench about p is
///   f . dp + ((x - p) x f + m) . dw,
/// with m the moment on the rod. A rigid motion of hand and rod does not change E.
///
/// Beyond a limit L the point slips. The force f keeps its direction with |f| = L, and s grows so that K u stays at L
/// (return mapping of elastic, perfectly plastic friction [Simo and Hughes 1998, section 1.4]).

#include <algorithm>
#include <cmath>

#include "common/types.hpp"

namespace withe {

/// Force of a point that slips beyond `limit` [N], with K u in the axes of the grasped part.
struct CappedForce {
  Vector3 force = Vector3::Zero();  ///< [N]
  double share = 1.0;               ///< share of K u that remains
};

inline CappedForce capped(const Vector3& elastic, double limit) {
  const double size = elastic.norm();
  if (size <= limit) return {elastic, 1.0};
  return {(limit / size) * elastic, limit / size};
}

/// Derivative of the force by K u: c (I - n n^T) where it slips, c K u being the force and n along it.
inline Matrix3 capped_slope(const CappedForce& f) {
  if (f.share >= 1.0) return Matrix3::Identity();
  const Vector3 n = f.force.normalized();
  return f.share * (Matrix3::Identity() - n * n.transpose());
}

/// Derivative of the force by u [N/m], in its place a symmetric matrix where it slips: c (K - K n n^T K / (n . K n)).
/// Exact for k1 = k2 = k3.
inline Matrix3 symmetric_stiffness(const Vector3& stiffness, const CappedForce& f) {
  Matrix3 K = stiffness.asDiagonal();
  if (f.share >= 1.0) return K;
  const Vector3 n = f.force.normalized(), Kn = stiffness.cwiseProduct(n);
  return f.share * (K - Kn * Kn.transpose() / n.dot(Kn));
}

}  // namespace withe
