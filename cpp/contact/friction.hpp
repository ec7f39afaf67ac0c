#pragma once
/// Friction of two surfaces that press against each other.
///
/// The slip of a step is the relative motion of the two material points at the contact, S = J (q1 - q0), without its
/// normal part. It contains the motion of the closest points of the centrelines (and of an obstacle), and the rotation
/// and spin of their edges,
///   S = sum_i w_i (x_i - x_i^0) + phi_a x r_a - phi_b x r_b,   phi = t x (e - e^0) / |e| + t (theta - theta^0),
/// with r from the centreline to the surface. If an obstacle touches a smooth curve (curve.hpp), w_i are the weights of
/// the curve, and phi combines both edges in the shares 1/2 - s and 1/2 + s. The force F on S acts through the same J,
/// so its work F . S is never negative, for any integrator. Under the midpoint rules t, |e| and the vector r_b - r_a
/// between two rods are those in the middle of the step. A rotation of both rods is then no slip, and friction
/// conserves their angular momentum. In energy-momentum steps theta - theta^0 becomes the angle over which moments
/// about an edge do work, 2 tan((theta - theta^0) / 2) over (t^0 + t^1) . t / 2, with t in the middle.
///   implicit, lagged: F = mu N tanh(K |S| / (2 dt)) S / |S|, K = 15 / nu [Choi, dissertation, (5.7)-(5.14),
///                     there between centrelines]
///   anchored:         F = k_t (stick + S), of length mu N at most: an elastic stick that slips [Simo and Hughes 1998]
/// An obstacle may have different coefficients along and across a rod. F is then the force for the greatest coefficient
/// mu, times the matrix (mu_t / mu) tt^T + (mu_n / mu) (1 - tt^T). Here t is the rod's tangent along the surface. mu_t
/// has one value if the rod slides towards its end (S . t > 0), and another if it slides towards its start. For a slip
/// in the direction s, F = N (mu_t (s . t) t + mu_n (s . n) n) [Hu, Nirody, Scott and Shelley 2009, eq. 1]. The matrix
/// is symmetric and positive semidefinite, so F . S is not negative. F is continuous, because F . t vanishes where mu_t
/// changes.
///
/// Rolling friction on an obstacle is a couple against the rotation of the rod's surface. It follows the same laws with
/// its own coefficient. In place of the slip it uses R = (phi_a - phi) x r_a, the slip minus the motion of the
/// centreline, where phi is the rotation of the obstacle. Its force acts on R alone. The couple is at most mu_r r N
/// [Johnson, Contact Mechanics, 1985, section 9.1], and there is no net force along the rod.

#include <cmath>
#include <type_traits>

#include "common/dual.hpp"
#include "contact/pressing_law.hpp"
#include "contact/surfaces.hpp"
#include "geometry/finite_turn.hpp"
#include "geometry/segment_distance.hpp"

namespace withe {

/// Constants of one contact while its unknowns change.
struct FrictionSetting {
  const ContactPair* pair = nullptr;
  const Obstacle* obstacle = nullptr;
  double friction = 0;                           ///< the greatest coefficient [-]
  bool rolling = false;                          ///< true for rolling friction
  ClosestPoints points;                          ///< whose class is kept
  const CurveDistance<double>* curve = nullptr;  ///< valid at the present unknowns only
  double start[kContactUnknowns] = {};           ///< unknowns at the start of the step
  Vec3d source[2];                               ///< tangents that the frames of a and b are transported from
  PressingLaw pressing;
  double before = 0;          ///< distance at the start [m]
  bool middle = false;        ///< true if edges turn, on their arms, in their mid-step positions
  bool finite_turns = false;  ///< edges spin as in energy-momentum steps
  FrictionLaw law = FrictionLaw::implicit;
  double tangential_stiffness = 0;  ///< stiffness of an anchor [N/m]
  double rate = 0;                  ///< K / (2 dt) [1/m]
  Vec3d drift{};                    ///< way of an obstacle in the step [m]
  Vec3d turn{};                     ///< rotation about its own axis [rad]
  Vec3d stick{};                    ///< elastic slip at the start of the step [m]
  bool spatial = true, centreline = false;
  bool isotropic = true;             ///< true if friction is the same in all directions of the rod
  const Vec3d* predicted = nullptr;  ///< friction over its limit, as a step of Newton's method predicts it
};

/// Values from the start of the step, on any scalar.
template <class Scalar>
struct SlipStart {
  Scalar unknown[kContactUnknowns];
  Vec3<Scalar> source[2];
  Scalar before;

  explicit SlipStart(const FrictionSetting& f) : before(f.before) {
    for (int i = 0; i < kContactUnknowns; ++i) unknown[i] = Scalar(f.start[i]);
    for (int b = 0; b < 2; ++b) source[b] = {Scalar(f.source[b].x), Scalar(f.source[b].y), Scalar(f.source[b].z)};
  }
  Vec3<Scalar> point(int i) const { return {unknown[3 * i], unknown[3 * i + 1], unknown[3 * i + 2]}; }
};

template <class Scalar>
struct FrictionForce {
  Vec3<Scalar> force;    ///< force of b on a; a applies the opposite force to b [N]
  Vec3<Scalar> stick{};  ///< elastic slip at the end of the step [m]
  bool sticking = false;
};

/// Length of the arm from the centreline of a (side 0) or of b to the point of contact. On an obstacle it is along the
/// normal [m], otherwise relative to the vector between both centrelines [-]. Two rods share that point, so friction
/// has no net moment on them, however deep they overlap. The point divides the vector as the radii do.
inline double arm_length(const ContactPair& pair, int side) {
  if (pair.rod_b < 0) return pair.radius_a;
  return (side == 0 ? pair.radius_a : pair.radius_b) / pair.radii();
}

/// That arm, by the lever that its length is over. Beside a face, `whole` goes from the tail of the normal of the face
/// to the point that touches the face.
template <class Scalar>
Vec3<Scalar> contact_arm(const ContactPair& pair, int side, const Vec3<Scalar>& lever, const Vec3<Scalar>& whole) {
  if (pair.face != nullptr && side == 1) return whole - Scalar(arm_length(pair, 0)) * lever;
  const double length = arm_length(pair, side);
  return Scalar(side == 0 ? -length : length) * lever;
}

/// The same of an edge beside a piece of a curve, whose surface turns by its share in the rotations of both.
template <class Scalar>
Vec3<Scalar> piece_arm(const ContactPair& pair, int side, const Scalar& s, const Vec3<Scalar>& normal) {
  const CurveWeights& w = *pair.piece.weights;
  return (-pair.radius_a * (w.share[side] + w.share_slope[side] * s)) * normal;
}

/// From where an obstacle is placed to where it touches a piece of a curve at s [m].
template <class Scalar>
Vec3<Scalar> piece_obstacle_arm(const ContactPair& pair, const Obstacle& o, const Vec3<Scalar> (&x)[4],
                                const Scalar& s) {
  const Vec3<Scalar> c = curve_point(*pair.piece.weights, x, s);
  const PointDistance<Scalar> d = distance_to(o, c);
  return c - Vec3<Scalar>{Scalar(o.point.x), Scalar(o.point.y), Scalar(o.point.z)} -
         (d.distance - Scalar(pair.radius_b)) * direction_of(o, d);
}

/// tanh(c |S|) / |S| as a function of |S|^2.
template <class Scalar>
Scalar slip_factor(const Scalar& square, double c) {
  using std::sqrt;
  const double x2 = c * c * value_of(square);
  if (x2 < 1e-8) return chain(square, c * (1.0 - x2 / 3.0), -c * c * c / 3.0);
  const double x = std::sqrt(x2), t = std::tanh(x);
  return chain(square, c * t / x, 0.5 * c * c * c * ((1.0 - t * t) - t / x) / x2);
}

/// True if an elastic slip with one squared length holds, when at most another is allowed. A contact that slipped at
/// the end of a step is at its limit up to rounding, and counts as slipping. As sticking it would hold its neighbours
/// too, and Newton's method would release one contact per iteration.
inline bool holds(double square, double most) { return square <= (1.0 - 1e-12) * most * most; }

/// gain * S, gain = limit * factor. The derivative is that of `ForceLaw::dual_slip`: where the factor changes with S,
/// it multiplies the friction that is predicted.
template <class Scalar>
Vec3<Scalar> along_slip(const FrictionSetting& f, const Vec3<Scalar>& slip, const Scalar& gain, const Scalar& limit,
                        const Scalar& factor) {
  const Vec3<Scalar> force = gain * slip;
  if constexpr (!std::is_same_v<Scalar, double>) {
    const double share = value_of(factor);
    if (f.predicted != nullptr && share > 0.0) {
      const Scalar turns = value_of(limit) * (factor - Scalar(share));  // zero, with a derivative
      const Vec3d dual = (1.0 / share) * *f.predicted - Vec3d{value_of(slip.x), value_of(slip.y), value_of(slip.z)};
      return force + turns * Vec3<Scalar>{Scalar(dual.x), Scalar(dual.y), Scalar(dual.z)};
    }
  }
  return force;
}

/// The force F for a slip S and a normal force N.
template <class Scalar>
FrictionForce<Scalar> friction_force(const FrictionSetting& f, const Vec3<Scalar>& normal, const Vec3<Scalar>& slip,
                                     const Scalar& pressing) {
  using std::sqrt;
  FrictionForce<Scalar> out;
  const double mu = f.friction;
  if (f.law != FrictionLaw::anchored) {
    const Scalar square = dot(slip, slip);
    const Scalar factor = slip_factor(square, f.rate);
    out.force = along_slip(f, slip, mu * pressing * factor, mu * pressing, factor);
    out.sticking = f.rate * std::sqrt(value_of(square)) < 7.5;  // slower than the slip tolerance
    return out;
  }
  Vec3<Scalar> stick{f.stick.x, f.stick.y, f.stick.z};
  stick = stick - dot(stick, normal) * normal + slip;
  const Scalar square = dot(stick, stick);
  const Scalar limit = (mu / f.tangential_stiffness) * pressing;
  const double most = std::max(value_of(limit), 0.0);
  out.sticking = holds(value_of(square), most);
  if (!out.sticking) stick = along_slip(f, stick, limit / sqrt(square), limit, 1.0 / sqrt(square));
  out.stick = stick;
  out.force = Scalar(f.tangential_stiffness) * stick;
  return out;
}

/// F = g(|S|^2, N) S, where an anchor's S has its stick in it.
///
/// Friction has a corner where surfaces stop, and Newton's method may alternate around it, because the tangent on one
/// side does not contain the other side. The method therefore linearises F and S as separate unknowns, F / g = S in
/// place of F = g S [Chan, Golub and Mulet 1999]. If balance needs less than the limit, the step predicts this F while
/// the surfaces still slip. The next derivative, g dS + 2 g' (S . dS) F / g with that F, then holds them.
struct ForceLaw {
  double factor = 0, by_square = 0, by_pressing = 0;  ///< g, g', g_N

  /// F / g for a derivative. If `predicted` is known, F is `limit` times `predicted`.
  Vec3d dual_slip(const Vec3d& slip, const Vec3d* predicted, double limit) const {
    return predicted != nullptr && factor > 0.0 ? (limit / factor) * *predicted : slip;
  }
  /// F relative to its limit after a step that changes S, according to the linear equations. Its length is at most 1.
  Vec3d predict(const Vec3d& slip, const Vec3d& change, const Vec3d* predicted, double limit) const {
    const Vec3d force =
        factor * (slip + change) + (2.0 * by_square * dot(slip, change)) * dual_slip(slip, predicted, limit);
    return (1.0 / std::max(limit, std::sqrt(dot(force, force)))) * force;
  }
};

/// Law of implicit and lagged friction at a normal force N, with K / (2 dt).
inline ForceLaw tanh_law(double mu, double pressing, double square, double rate) {
  const Dual<1> factor = slip_factor(Dual<1>::unknown(square, 0), rate);
  const double limit = mu * pressing;
  return {limit * factor.value, limit * factor.slope[0], mu * factor.value};
}

inline ForceLaw force_law(const FrictionSetting& f, double pressing, double square, bool sticking) {
  const double mu = f.friction, limit = mu * pressing;
  if (f.law != FrictionLaw::anchored) return tanh_law(mu, pressing, square, f.rate);
  if (sticking) return {f.tangential_stiffness, 0.0, 0.0};
  const double inverse = 1.0 / std::sqrt(square);
  return {limit * inverse, -0.5 * limit * inverse / square, mu * inverse};
}

/// One of the edges whose turning makes surfaces slip.
template <class Scalar>
struct SlippingEdge {
  int tail = 0;               ///< index of its tail among the nodes of the contact; its head is the next node
  Vec3<Scalar> edge, change;  ///< now, and since the start of the step [m]
  Vec3<Scalar> tangent, arm;  ///< tangent and arm about which the edge turns
  Vec3<Scalar> turn;          ///< phi
  Vec3<Scalar> spin{};        ///< derivative of the frame's spin by the edge [1/m]
  Scalar angle{};             ///< rotation about itself [rad]
  Scalar inverse;             ///< inverse of its length there [1/m]
};

/// Two surfaces that press against each other, at given unknowns.
template <class Scalar>
struct SlippingSurfaces {
  SlippingEdge<Scalar> sides[2];
  Vec3<Scalar> node[3];            ///< nodes of a curve
  int bodies = 0;                  ///< number of bodies with an arm
  Scalar s, t, distance;           ///< a curve has no t
  Vec3<Scalar> normal, between{};  ///< normal and vector between the centrelines; zero beside a plane
  Vec3<Scalar> whole{};            ///< from the tail of a face's normal to the point that touches it
  Vec3<Scalar> lever;              ///< between them where edges turn; the normal of an obstacle
  Scalar inverse = 0.0;            ///< inverse of the length of `between` [1/m]; 0: no such vector
  Scalar pressing;                 ///< N
  PressingForce law;               ///< law of -N
  double before = 0;               ///< distance at the start of the step [m]
  Scalar w[4];
  Vec3<Scalar> way;      ///< slip, with its part along the normal [m]
  Vec3<Scalar> along{};  ///< the rod's tangent, without its part along the normal, where its direction counts
  Vec3<Scalar> plain{};  ///< the force of the greatest coefficient
  FrictionForce<Scalar> friction;
};

/// Shares of the ends in how far the surfaces slip by.
template <class Scalar>
void set_weights(const ContactPair& pair, SlippingSurfaces<Scalar>& c) {
  if (!pair.curve()) {
    end_weights(c.s, c.t, c.w);
    return;
  }
  const CurveWeights& w = *pair.piece.weights;
  for (int i = 0; i < 3; ++i) c.w[i] = w.middle[i] + c.s * (w.slope[i] + 0.5 * w.bend[i] * c.s);
  c.w[3] = Scalar(0.0);
}

/// Distance of a curve.
template <class Scalar>
CurveDistance<Scalar> distance_of(const FrictionSetting& f, const Vec3<Scalar> (&x)[4]) {
  if constexpr (std::is_same_v<Scalar, double>)
    if (f.curve != nullptr) return *f.curve;
  return curve_distance(f.pair->piece, *f.obstacle, x);
}

/// Point of contact, and normal force.
template <class Scalar>
void find_contact(const FrictionSetting& f, const SlipStart<Scalar>& start, const Vec3<Scalar> (&x)[4],
                  SlippingSurfaces<Scalar>& c) {
  using std::sqrt;
  const ContactPair& pair = *f.pair;
  c.s = f.points.s;
  c.t = f.points.t;
  if (pair.curve()) {
    const CurveDistance<Scalar> d = distance_of(f, x);
    c.s = d.s;
    c.distance = d.distance;
    c.normal = direction_of(*f.obstacle, distance_to(*f.obstacle, curve_point(*pair.piece.weights, x, c.s)));
  } else if (pair.face != nullptr) {
    const FaceVectors<Scalar> v(x, pair.point);
    const double over = v.over(*pair.face);
    c.s = Scalar(pair.point);
    c.t = Scalar(0.0);
    c.whole = v.point;
    c.normal = Scalar(over) * v.edge;
    c.distance = dot(v.point, c.normal);
    c.between = c.distance * c.normal;
  } else {
    const Vec3<Scalar> r = x[0] - x[2], &u = c.sides[0].edge, &v = c.sides[1].edge;
    solve_parameters(r, u, v, pair.weight_a, pair.weight_b, f.points.s_free, f.points.t_free, c.s, c.t);
    c.between = r + c.s * u - c.t * v;
    const Scalar square = dot(c.between, c.between);
    c.distance = sqrt(square + pair.weight_a * (c.s - 0.5) * (c.s - 0.5) + pair.weight_b * (c.t - 0.5) * (c.t - 0.5));
    c.inverse = 1.0 / sqrt(square);
    c.normal = c.inverse * c.between;
  }
  set_weights(pair, c);
  const Scalar& before = start.before;
  c.before = value_of(before);
  c.law = f.pressing.at(c.before, value_of(c.distance));
  c.pressing = chain(c.distance, -c.law.first, -c.law.by_end) + chain(before, 0.0, -c.law.by_start);
  if (pair.rod_b < 0 && !pair.curve()) c.w[2] = c.w[3] = Scalar(0.0);
}

/// Sign of an edge's turning: it moves a's surface (+1), or b's against a's (-1).
inline double turn_sign(const FrictionSetting& f, int side) { return side == 0 || f.pair->curve() ? 1.0 : -1.0; }

/// On which an obstacle's turning is slip: from where it is placed to where it is touched; of rolling friction, for
/// which surfaces count that turn against each other, the rod's own [m].
template <class Scalar>
Vec3<Scalar> obstacle_arm(const FrictionSetting& f, const SlippingSurfaces<Scalar>& c, const Vec3<Scalar> (&x)[4]) {
  const ContactPair& pair = *f.pair;
  if (f.rolling) return Scalar(-pair.radius_a) * c.normal;
  if (pair.curve()) return piece_obstacle_arm(pair, *f.obstacle, x, c.s);
  return c.t * c.sides[1].edge + Scalar(pair.radius_b) * c.normal;
}

/// Along the rod where it touches.
template <class Scalar>
Vec3<Scalar> rod_direction(const FrictionSetting& f, const SlippingSurfaces<Scalar>& c) {
  const CurveWeights* w = f.pair->piece.weights;
  return w != nullptr && w->edges > 1 ? curve_direction(*w, c.node, c.s) : c.sides[0].edge;
}

/// Converts friction of the greatest coefficient to friction along and across the rod.
template <class Scalar>
void direct_friction(const FrictionSetting& f, SlippingSurfaces<Scalar>& c) {
  using std::sqrt;
  const ContactPair& pair = *f.pair;
  const Vec3<Scalar> e = rod_direction(f, c);
  const Vec3<Scalar> t = (1.0 / sqrt(dot(e, e))) * e;
  c.along = t - dot(t, c.normal) * c.normal;
  c.plain = c.friction.force;
  const Scalar share = dot(c.along, c.plain);
  const double more = pair.along(value_of(share)) - pair.across;
  c.friction.force = Scalar(pair.across) * c.plain + (Scalar(more) * share) * c.along;
}

/// Component of an edge's direction in the middle of the step along the mean of its directions at both ends.
template <class Scalar>
Scalar mean_along_middle(const SlippingEdge<Scalar>& side) {
  using std::sqrt;
  const Vec3<Scalar> start = side.edge - side.change, middle = start + side.edge;
  const Vec3<Scalar> mean =
      (0.5 / sqrt(dot(start, start))) * start + (0.5 / sqrt(dot(side.edge, side.edge))) * side.edge;
  return dot(mean, middle) / sqrt(dot(middle, middle));
}

/// The angle over which the spin of an edge does work in an energy-momentum step, whose rates are those of its finite
/// rotation (inertia.cpp). With another angle, rolling would gain energy.
template <class Scalar>
Scalar working_turn(const SlippingEdge<Scalar>& side) {
  return finite_turn(side.angle) / mean_along_middle(side);
}

/// Its derivatives by the angle, and by the edge.
struct WorkingTurnSlopes {
  double angle = 1.0;
  Vec3d edge{};
};
inline WorkingTurnSlopes working_turn_slopes(const SlippingEdge<double>& side) {
  using Slope = Dual<1>;
  const Slope turn = finite_turn(Slope::unknown(side.angle, 0));
  SlippingEdge<Dual<3>> moving;
  moving.edge = {Dual<3>::unknown(side.edge.x, 0), Dual<3>::unknown(side.edge.y, 1), Dual<3>::unknown(side.edge.z, 2)};
  const Vec3d start = side.edge - side.change;
  moving.change = moving.edge - Vec3<Dual<3>>{Dual<3>(start.x), Dual<3>(start.y), Dual<3>(start.z)};
  const Dual<3> inverse = 1.0 / mean_along_middle(moving);
  return {turn.slope[0] * inverse.value, turn.value * Vec3d{inverse.slope[0], inverse.slope[1], inverse.slope[2]}};
}

/// Slip of the surfaces since `start`, and the friction on it.
template <class Scalar>
SlippingSurfaces<Scalar> slipping_surfaces(const FrictionSetting& f, const SlipStart<Scalar>& start,
                                           const Scalar (&unknown)[kContactUnknowns]) {
  using std::sqrt;
  const auto point = [&](int i) { return Vec3<Scalar>{unknown[3 * i], unknown[3 * i + 1], unknown[3 * i + 2]}; };
  const auto lift = [](const Vec3d& v) { return Vec3<Scalar>{Scalar(v.x), Scalar(v.y), Scalar(v.z)}; };
  const Vec3<Scalar> x[4] = {point(0), point(1), point(2), point(3)};
  SlippingSurfaces<Scalar> c;
  const bool curve = f.pair->curve();
  for (int b = 0; b < 2; ++b) {
    const int tail = curve ? b : 2 * b;
    c.sides[b].tail = tail;
    c.sides[b].edge = x[tail + 1] - x[tail];
    c.sides[b].change = c.sides[b].edge - (start.point(tail + 1) - start.point(tail));
  }
  find_contact(f, start, x, c);
  for (int i = 0; i < 3 && curve; ++i) c.node[i] = x[i];
  c.way = -lift(f.drift);
  for (int i = 0; i < 4 && !f.rolling; ++i) c.way += c.w[i] * (x[i] - start.point(i));
  c.bodies = f.centreline ? 0 : curve ? f.pair->piece.weights->edges : f.pair->rod_b < 0 ? 1 : 2;
  c.lever = f.pair->rod_b < 0 ? c.normal : f.middle ? c.between - 0.5 * c.way : c.between;
  if (f.pair->face != nullptr) {
    if (f.middle) c.whole = c.whole - 0.5 * c.way;
    c.lever = dot(c.whole, c.normal) * c.normal;
  }
  for (int b = 0; b < c.bodies; ++b) {
    SlippingEdge<Scalar>& side = c.sides[b];
    const Vec3<Scalar> edge = f.middle ? side.edge - 0.5 * side.change : side.edge;
    side.inverse = 1.0 / sqrt(dot(edge, edge));
    side.tangent = side.inverse * edge;
    side.arm = curve ? piece_arm(*f.pair, b, c.s, c.normal) : contact_arm(*f.pair, b, c.lever, c.whole);
    side.turn = side.inverse * cross(side.tangent, side.change);
    if (f.spatial) {
      side.angle = unknown[12 + b] - start.unknown[12 + b];
      side.turn += (f.finite_turns ? working_turn(side) : side.angle) * side.tangent;
      const Vec3<Scalar>& source = start.source[b];
      side.spin = -((side.inverse / (1.0 + dot(source, side.tangent))) * cross(source, side.tangent));
    }
    c.way += Scalar(turn_sign(f, b)) * cross(side.turn, side.arm);
  }
  if (dot(f.turn, f.turn) > 0.0) c.way = c.way - cross(lift(f.turn), obstacle_arm(f, c, x));
  c.friction = friction_force(f, c.normal, c.way - dot(c.way, c.normal) * c.normal, c.pressing);
  if (!f.isotropic) direct_friction(f, c);
  return c;
}

template <class Scalar>
SlippingSurfaces<Scalar> slipping_surfaces(const FrictionSetting& f, const Scalar (&unknown)[kContactUnknowns]) {
  return slipping_surfaces(f, SlipStart<Scalar>(f), unknown);
}

/// Adds to `gradient` the generalised forces J^T F (minus the friction on the rods).
template <class Scalar>
void add_friction_gradient(const FrictionSetting& f, const SlippingSurfaces<Scalar>& c,
                           Scalar (&gradient)[kContactUnknowns]) {
  const auto add = [&](int i, const Vec3<Scalar>& v) {
    gradient[3 * i] += v.x;
    gradient[3 * i + 1] += v.y;
    gradient[3 * i + 2] += v.z;
  };
  for (int i = 0; i < 4 && !f.rolling; ++i) add(i, c.w[i] * c.friction.force);
  for (int b = 0; b < c.bodies; ++b) {
    const SlippingEdge<Scalar>& side = c.sides[b];
    const Vec3<Scalar> torque = Scalar(turn_sign(f, b)) * cross(side.arm, c.friction.force);
    Vec3<Scalar> couple = side.inverse * cross(torque, side.tangent);
    if (f.spatial) {
      const Scalar axial = dot(side.tangent, torque);
      couple += axial * side.spin;
      gradient[12 + b] += axial;
    }
    add(side.tail + 1, couple);
    add(side.tail, -couple);
  }
}

/// S with its part along the normal, an anchor's stick included.
template <class Scalar>
Vec3<Scalar> whole_way(const FrictionSetting& f, const SlippingSurfaces<Scalar>& c) {
  if (f.law != FrictionLaw::anchored) return c.way;
  return c.way + Vec3<Scalar>{Scalar(f.stick.x), Scalar(f.stick.y), Scalar(f.stick.z)};
}

/// Evaluates with F and S at `unknown`; returns F.
template <class Scalar>
FrictionForce<Scalar> friction_gradient(const FrictionSetting& f, const Scalar (&unknown)[kContactUnknowns],
                                        Scalar (&gradient)[kContactUnknowns]) {
  const SlippingSurfaces<Scalar> c = slipping_surfaces(f, unknown);
  add_friction_gradient(f, c, gradient);
  return c.friction;
}

}  // namespace withe
