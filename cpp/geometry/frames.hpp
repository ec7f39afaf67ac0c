#pragma once
/// Frames carried by edges: parallel transport, the angle between frames, and how an edge's frame turns
/// when the edge does.

#include <cmath>

#include "geometry/vec3.hpp"

namespace withe {

/// Parallel transport of `d` (normal to `from`) from unit tangent `from` to unit tangent `to`, by the
/// smallest rotation that takes one to the other. [Bergou et al. 2008, section 4.2]. Needs from . to > -1.
template <class Scalar>
Vec3<Scalar> parallel_transport(const Vec3<Scalar>& d, const Vec3<Scalar>& from, const Vec3<Scalar>& to) {
  const Scalar s = dot(d, to) / (1.0 + dot(from, to));
  return d - s * (from + to);
}

/// Angle about `axis` that turns `from` into `to` [rad], both unit length and normal to `axis`.
inline double signed_angle(const Vec3<double>& from, const Vec3<double>& to, const Vec3<double>& axis) {
  return std::atan2(dot(cross(from, to), axis), dot(from, to));
}

/// An edge in some configuration: unit tangent, material directors, inverse length, and the spin of the
/// directors that comes with a change of the edge vector e:
///   d psi = d theta + spin . d e,     spin = - (s x t) / (l (1 + s . t)),
/// where s is the tangent from which the reference frame is transported directly: direct transport
/// differs from infinitesimal transport by the solid angle of the triangle s, t, t + dt.
/// The second derivative of psi is - (spin bow^T + bow spin^T) / 2, bow = ((2 + s . t) t + s) / (l (1 + s . t));
/// its antisymmetric part cancels with that of infinitesimal transport.
template <class Scalar>
struct EdgeFrame {
  Vec3<Scalar> tangent, d1, d2;
  Scalar inverse_length;
  Vec3<Scalar> spin, bow;
};

/// The frame of an edge with vector e, turned by theta (given by cosine and sine) from the reference director
/// `reference` that belongs to the source tangent `source`.
template <class Scalar>
EdgeFrame<Scalar> edge_frame(const Vec3<Scalar>& e, const Scalar& length, const Vec3<Scalar>& source,
                             const Vec3<Scalar>& reference, const Scalar& cosine, const Scalar& sine) {
  EdgeFrame<Scalar> f;
  f.inverse_length = 1.0 / length;
  f.tangent = f.inverse_length * e;
  const Scalar c = dot(source, f.tangent);
  const Scalar k = f.inverse_length / (1.0 + c);
  f.spin = -(k * cross(source, f.tangent));
  f.bow = (k * (2.0 + c)) * f.tangent + k * source;
  const Vec3<Scalar> r1 = parallel_transport(reference, source, f.tangent);
  const Vec3<Scalar> r2 = cross(f.tangent, r1);
  f.d1 = cosine * r1 + sine * r2;
  f.d2 = cosine * r2 - sine * r1;
  return f;
}

/// Frame of an edge that is traversed in the direction of its rod (sign > 0) or against it. Against it, the angle of
/// the edge and the spin of its directors have the opposite sign.
template <class Scalar>
EdgeFrame<Scalar> oriented(const EdgeFrame<Scalar>& f, int sign) {
  if (sign > 0) return f;
  return {-f.tangent, f.d1, -f.d2, f.inverse_length, f.spin, -f.bow};
}

}  // namespace withe
