// Discrete gradients of bending and twisting: what they must keep, over drawn steps of every size, and their
// derivatives.

#include <gtest/gtest.h>

#include "derivative_check.hpp"
#include "elasticity/discrete_gradient.hpp"
#include "elasticity/elements.hpp"
#include "geometry/rotation.hpp"
#include "scenes.hpp"

namespace withe {
namespace {

using testing::derivative_matches;
using testing::MatrixX;

/// Two edges in a step: (e_a, theta_a, e_b, theta_b) at its start, whose reference directors are those of theta = 0.
struct Step {
  VectorX start, end;
  Vec3d reference[2];
  Vec3d natural, stiffness;
  double tau = 0.0;
  BendMeasure measure;

  EdgeFrame<double> frame(const VectorX& x, int k) const {
    const Vec3d e = to_vec3(Vector3(x.segment<3>(4 * k))), e0 = to_vec3(Vector3(start.segment<3>(4 * k)));
    const double theta = x(4 * k + 3) - start(4 * k + 3);
    return edge_frame(e, std::sqrt(dot(e, e)), (1.0 / std::sqrt(dot(e0, e0))) * e0, reference[k], std::cos(theta),
                      std::sin(theta));
  }
  Vec3d strain(const VectorX& x) const {
    const auto s = bend_twist_strain(frame(x, 0), frame(x, 1), tau);
    return {s.kappa1, s.kappa2, s.tau};
  }
  double energy(const VectorX& x) const {
    const Vec3d s = strain(x);
    const double f = bend_factor(measure, s.x * s.x + s.y * s.y).value;
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) sum += 0.5 * stiffness[i] * std::pow(f * s[i] - natural[i], 2);
    return sum;
  }
  MovingEdge<double> edge(const VectorX& x, int k) const {
    const EdgeFrame<double> f0 = frame(start, k), f1 = frame(x, k), f = frame(0.5 * (start + x), k);
    return {f0.tangent,       f0.inverse_length,        f1.tangent, f1.inverse_length, f.tangent,
            f.inverse_length, turn_of_directors(f0, f1)};
  }
  template <bool with_matrix>
  DiscreteMoment<double> moment(const VectorX& x) const {
    DiscreteMoment<double> m{};
    discrete_moment<with_matrix>(measure, frame(start, 0), frame(x, 0), frame(start, 1), frame(x, 1), strain(start),
                                 strain(x), natural, stiffness, m);
    return m;
  }
  /// Forces on edges, torques on angles.
  VectorX forces(const VectorX& x) const {
    const Vec3d m = moment<false>(x).moment;
    VectorX out(8);
    for (int k : {0, 1}) {
      const MovingEdge<double> moving = edge(x, k);
      const Vec3d own = k == 0 ? m : -m;
      out.segment<3>(4 * k) = to_eigen(moving.force(own));
      out(4 * k + 3) = moving.torque(own);
    }
    return out;
  }
};

/// Steps that deform by `deformed` on top of a common rotation by `turned` [rad].
Step drawn_step(unsigned seed, double deformed, double turned) {
  testing::RandomNumbers random(seed);
  Step s;
  s.start.resize(8);
  const Matrix3 R = random.rotation();
  s.start << R * Vector3(1.0, 0.0, 0.0), 0.3, R * (0.8 * Vector3(std::cos(0.6), std::sin(0.6), 0.3)), -0.4;
  for (int k : {0, 1}) {
    const Vector3 t = s.start.segment<3>(4 * k).normalized();
    s.reference[k] = to_vec3(Vector3(t.cross(random.vector()).normalized()));
  }
  const auto here = bend_twist_strain(s.frame(s.start, 0), s.frame(s.start, 1), 0.0);
  s.tau = here.tau;
  s.natural = {0.2, -0.1, here.tau + 0.3};
  s.stiffness = {1.3, 0.7, 0.5};
  const Vector3 axis = random.vector().normalized();
  const Matrix3 turn = rotation_exp(turned * axis);
  s.end = s.start;
  for (int k : {0, 1}) {
    const Vector3 e = s.start.segment<3>(4 * k), t = e.normalized();
    s.end.segment<3>(4 * k) = turn * e + deformed * random.vector();
    s.end(4 * k + 3) += 2.0 * std::atan(axis.dot(t) * std::tan(0.5 * turned)) + deformed * random.normal();
  }
  return s;
}

std::vector<Step> drawn_steps() {
  std::vector<Step> steps;
  unsigned seed = 0;
  for (double deformed : {0.0, 1e-9, 1e-3, 0.05, 0.3})
    for (double turned : {0.0, 0.1, 1.0})
      for (int k = 0; k < 4; ++k) steps.push_back(drawn_step(++seed, deformed, turned));
  return steps;
}

TEST(DiscreteGradient, DoesTheWorkThatTheEnergyChangesBy) {
  for (const Step& s : drawn_steps()) {
    const VectorX f = s.forces(s.end);
    double work = 0.0;
    for (int k : {0, 1}) {
      const MovingEdge<double> edge = s.edge(s.end, k);
      work += f.segment<3>(4 * k).dot(s.end.segment<3>(4 * k) - s.start.segment<3>(4 * k));
      const double lies = 0.5 * (dot(edge.t0, edge.t) + dot(edge.t1, edge.t));
      work += f(4 * k + 3) * edge.theta / lies;
    }
    EXPECT_NEAR(work, s.energy(s.end) - s.energy(s.start), 2e-15);
  }
}

TEST(DiscreteGradient, TurnsNothingAboutTheMiddleOfTheStep) {
  for (const Step& s : drawn_steps()) {
    const VectorX f = s.forces(s.end);
    Vector3 moment = Vector3::Zero();
    for (int k : {0, 1}) {
      const Vector3 e = 0.5 * (s.start.segment<3>(4 * k) + s.end.segment<3>(4 * k)), pull = f.segment<3>(4 * k);
      moment += e.cross(pull) + f(4 * k + 3) * e.normalized();
    }
    EXPECT_LT(moment.norm(), 3e-15 * f.norm());
  }
}

TEST(DiscreteGradient, IsTheGradientToSecondOrderInTheStep) {
  for (double turned : {0.0, 1.0}) {
    std::vector<double> errors;
    for (double size : {1e-2, 5e-3}) {
      const Step s = drawn_step(7, 0.3 * size, turned * size);
      const VectorX z = 0.5 * (s.start + s.end);
      VectorX gradient(8);
      const MatrixX slope =
          testing::central_difference([&](const VectorX& x) { return VectorX::Constant(1, s.energy(x)); }, z, 1e-5);
      gradient = slope.transpose();
      for (int k : {0, 1}) gradient.segment<3>(4 * k) -= gradient(4 * k + 3) * to_eigen(s.frame(z, k).spin);
      errors.push_back((s.forces(s.end) - gradient).norm());
    }
    EXPECT_GT(errors[0] / errors[1], 3.6) << turned;
    EXPECT_LT(errors[0] / errors[1], 4.4) << turned;
  }
}

TEST(DiscreteGradient, MomentsFollowStrainsAsTheirDerivativesSay) {
  const Vec3d start{0.4, -0.3, 0.2}, natural{0.1, 0.2, -0.4}, stiffness{1.3, 0.7, 0.5};
  const auto moments = [&](const VectorX& u) {
    const DividedMoments<double> h =
        divided_moments<false, double>(BendMeasure{}, start, {u(0), u(1), u(2)}, natural, stiffness);
    return VectorX(Vector3(h.by[0], h.by[1], h.by[2]));
  };
  const Vector3 u(0.7, 0.5, -0.6);
  const DividedMoments<double> h =
      divided_moments<true, double>(BendMeasure{}, start, {u(0), u(1), u(2)}, natural, stiffness);
  MatrixX J(3, 3);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) J(i, j) = h.second[i][j];
  EXPECT_TRUE(derivative_matches(moments, u, J));
}

TEST(DiscreteGradient, MatrixIsExact) {
  for (const Step& s : drawn_steps()) {
    const VectorX& x = s.end;
    const DiscreteMoment<double> m = s.moment<true>(x);
    const EdgeColumns<double> columns[2] = {edge_columns(m.by_a, s.frame(x, 0)), edge_columns(m.by_b, s.frame(x, 1))};
    MatrixX by(3, 8), J(8, 8);
    for (int k : {0, 1}) {
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) by(i, 4 * k + j) = columns[k].edge.row[i][j];
      by.col(4 * k + 3) = to_eigen(columns[k].angle);
    }
    const auto moment = [&](const VectorX& y) { return VectorX(to_eigen(s.moment<false>(y).moment)); };
    EXPECT_TRUE(derivative_matches(moment, x, by));
    for (int i : {0, 1})
      for (int j : {0, 1}) {
        const MovingEdge<double> edge = s.edge(x, i);
        EdgeBlock<double> b = edge_block(edge, i == 0 ? 1.0 : -1.0, columns[j]);
        if (i == j) add_edge_geometry(edge, i == 0 ? m.moment : -m.moment, b);
        for (int r = 0; r < 3; ++r) {
          for (int c = 0; c < 3; ++c) J(4 * i + r, 4 * j + c) = b.ee.row[r][c];
          J(4 * i + r, 4 * j + 3) = b.e_angle[r];
          J(4 * i + 3, 4 * j + r) = b.angle_e[r];
        }
        J(4 * i + 3, 4 * j + 3) = b.angle_angle;
      }
    EXPECT_TRUE(derivative_matches([&](const VectorX& y) { return s.forces(y); }, x, J));
  }
}

}  // namespace
}  // namespace withe
