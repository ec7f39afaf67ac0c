// The half stencil in space on dual numbers, through the same templates as the engine's: from the unknowns by frames,
// strains and energy to its gradient, whose slopes are the Hessian.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/dual.hpp"
#include "elasticity/half_stencil.hpp"

namespace withe {

constexpr int kUnknowns = 11;  // tail, angle, head, frame, hinge
using Number = Dual<kUnknowns>;
using Vec3d = Vec3<double>;

Number arctangent(const Number& y, const Number& x) {
  Number angle(std::atan2(y.value, x.value));
  const double square = x.value * x.value + y.value * y.value;
  for (int i = 0; i < kUnknowns; ++i) angle.slope[i] = (x.value * y.slope[i] - y.value * x.slope[i]) / square;
  return angle;
}
Number round_to_integer(const Number& x) { return {std::nearbyint(x.value)}; }
Number cosine(const Number& x) { return chain(x, std::cos(x.value), -std::sin(x.value)); }
Number sine(const Number& x) { return chain(x, std::sin(x.value), std::cos(x.value)); }
HalfTwist<Number> half_twist(const Number& tau) { return {cosine(0.5 * tau), sine(0.5 * tau)}; }
double cosine(double x) { return std::cos(x); }
double sine(double x) { return std::sin(x); }

namespace {

using Random = std::mt19937;

double drawn(Random& random) { return std::uniform_real_distribution<double>(-1.0, 1.0)(random); }
Vec3d drawn_vector(Random& random) { return {drawn(random), drawn(random), drawn(random)}; }
Vec3d normalized(const Vec3d& v) { return (1.0 / std::sqrt(dot(v, v))) * v; }

template <class Scalar>
Vec3<Scalar> constant(const Vec3d& v) {
  return {Scalar(v.x), Scalar(v.y), Scalar(v.z)};
}

/// Rotation by `angle` about a unit vector [Rodrigues].
template <class Scalar>
Vec3<Scalar> rotated(const Vec3<Scalar>& v, const Vec3<Scalar>& axis, const Scalar& angle) {
  const Scalar c = cosine(angle), s = sine(angle);
  return c * v + s * cross(axis, v) + ((1.0 - c) * dot(axis, v)) * axis;
}

/// Turned by the Cayley vector w.
template <class Scalar>
Vec3<Scalar> turned_by(const Vec3<Scalar>& w, const Vec3<Scalar>& v) {
  const Scalar c = 1.0 / (1.0 + 0.25 * dot(w, w));
  return v + c * (cross(w, v) + 0.5 * cross(w, cross(w, v)));
}

/// An edge that bends and turns against a hinge on a frame.
struct Scene {
  double at[kUnknowns];
  Vec3d source, reference, tangent, director, axis;  // of the edge, of the attached end, of the hinge
  bool frame_first;
  BendMeasure measure;
  BendTwistStrain<double> natural;
  BendTwistStiffness<double> stiffness;
};

Scene drawn_scene(Random& random, bool frame_first) {
  Scene s;
  for (double& x : s.at) x = 0.4 * drawn(random);
  s.tangent = normalized(drawn_vector(random));
  s.director = normalized(cross(s.tangent, drawn_vector(random)));
  s.axis = normalized(drawn_vector(random));
  // The edge leaves along the attached end, but for up to half a radian or so.
  s.source = normalized(s.tangent + 0.3 * drawn_vector(random));
  s.reference = normalized(cross(s.source, drawn_vector(random)));
  const Vec3d edge = 1.3 * s.source;
  for (int i = 0; i < 3; ++i) s.at[4 + i] = s.at[i] + edge[i] + 0.2 * drawn(random);
  s.frame_first = frame_first;
  s.natural = {drawn(random), drawn(random), drawn(random)};
  s.stiffness = {1.0, 0.7, 0.9};
  return s;
}

template <class Scalar>
struct Evaluated {
  BendTwistDerivatives<Scalar> derivatives;
  AttachedEnd<Scalar> end;
};

template <class Scalar>
Evaluated<Scalar> evaluate(const Scene& s, const Scalar (&u)[kUnknowns], bool with_hessian) {
  const Vec3<Scalar> e{u[4] - u[0], u[5] - u[1], u[6] - u[2]}, w{u[7], u[8], u[9]};
  using std::sqrt;
  const EdgeFrame<Scalar> edge = edge_frame(e, Scalar(sqrt(dot(e, e))), constant<Scalar>(s.source),
                                            constant<Scalar>(s.reference), cosine(u[3]), sine(u[3]));
  const Vec3<Scalar> axis = constant<Scalar>(s.axis);
  const auto attached = [&](const Vec3d& v) { return turned_by(w, rotated(constant<Scalar>(v), axis, u[10])); };
  EdgeFrame<Scalar> end{};
  end.tangent = attached(s.tangent);
  end.d1 = attached(s.director);
  end.d2 = cross(end.tangent, end.d1);
  end.inverse_length = Scalar(1.0);
  const EdgeFrame<Scalar>&f0 = s.frame_first ? end : edge, &f1 = s.frame_first ? edge : end;
  const BendTwistStrain<Scalar> natural{Scalar(s.natural.kappa1), Scalar(s.natural.kappa2), Scalar(s.natural.tau)};
  const BendTwistStiffness<Scalar> k{Scalar(s.stiffness.bend1), Scalar(s.stiffness.bend2), Scalar(s.stiffness.twist)};
  const BendTwistStrain<Scalar> strain = bend_twist_strain(f0, f1, Scalar(0.0));
  BendTwistDerivatives<Scalar> d;
  if (with_hessian) {
    bend_twist_hessian(s.measure, f0, f1, strain, natural, k, d);
    apply_transport(f0, f1, d);
  } else {
    bend_twist_gradient(s.measure, f0, f1, strain, natural, k, d);
    apply_transport_gradient(f0, f1, d);
  }
  return {d, {s.frame_first ? 0 : 1, end.tangent, w, turned_by(w, axis)}};
}

class HalfStencil : public testing::TestWithParam<bool> {};

TEST_P(HalfStencil, OnDualNumbersHasTheSlopesThatItsDerivativesSay) {
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Scene scene = drawn_scene(random, GetParam());
    const Evaluated<double> by_hand = evaluate(scene, scene.at, true);
    double gradient[kUnknowns], hessian[kUnknowns][kUnknowns];
    put_half_gradient(by_hand.derivatives, by_hand.end, gradient);
    put_half_matrix(by_hand.derivatives, by_hand.end, hessian);
    Number unknown[kUnknowns], slopes[kUnknowns];
    for (int i = 0; i < kUnknowns; ++i) unknown[i] = Number::unknown(scene.at[i], i);
    const Evaluated<Number> by_duals = evaluate(scene, unknown, false);
    put_half_gradient(by_duals.derivatives, by_duals.end, slopes);
    for (int i = 0; i < kUnknowns; ++i) {
      EXPECT_NEAR(gradient[i], by_duals.derivatives.energy.slope[i], 1e-12) << "unknown " << i;
      for (int j = 0; j < kUnknowns; ++j)
        EXPECT_NEAR(hessian[i][j], slopes[i].slope[j], 1e-11) << "unknowns " << i << ", " << j;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(FromTheFrameAndToIt, HalfStencil, testing::Bool());

}  // namespace
}  // namespace withe
