// Every elastic and viscous potential, stencil kind by stencil kind: exact gradients and Hessians, frame
// indifference, and balance of forces and moments.

#include <gtest/gtest.h>

#include "derivative_check.hpp"
#include "elasticity/bend_planar.hpp"
#include "elasticity/elements.hpp"
#include "elasticity/stretch.hpp"
#include "stencil_kinds.hpp"

namespace withe {
namespace {

using testing::all_cases;
using testing::Case;
using testing::count_of;
using testing::derivative_matches;
using testing::dofs_of;
using testing::gradient_matches;
using testing::Kind;
using testing::kKinds;
using testing::MatrixX;
using testing::name_of;

struct Sum {
  double energy = 0;
  VectorX gradient;
  MatrixX hessian;
};

/// Energy, gradient and Hessian of all stencils of a kind.
Sum sum_of(const Case& c, const ElasticCoefficients& k, Kind kind, const VectorX& q) {
  Configuration configuration;
  compute_configuration(c.model, c.state, q, configuration);
  Sum sum{0.0, VectorX::Zero(q.size()), MatrixX::Zero(q.size(), q.size())};
  Local local;
  for (int i = 0; i < count_of(c.model, kind); ++i) {
    if (kind == Kind::stretch) stretch_local(c.model, k, configuration, i, true, nullptr, local);
    if (kind == Kind::bend) bend_local(c.model, bend_coefficients(k, i), configuration, i, true, local);
    if (kind == Kind::half) half_local(c.model, q, half_coefficients(k, i), configuration, i, true, local);
    const std::vector<int> dofs = dofs_of(c.model, kind, i);
    sum.energy += local.energy;
    for (std::size_t a = 0; a < dofs.size(); ++a) {
      if (dofs[a] < 0) continue;
      sum.gradient(dofs[a]) += local.gradient[a];
      for (std::size_t b = 0; b < dofs.size(); ++b)
        if (dofs[b] >= 0) sum.hessian(dofs[a], dofs[b]) += local.hessian[a][b];
    }
  }
  return sum;
}

ElasticCoefficients elastic_of(const Case& c) {
  ElasticCoefficients k;
  set_elastic(initial_parameters(c.model), k);
  return k;
}

/// Natural strains away from those of the state, so that every gradient is loaded.
ElasticCoefficients loaded(const Case& c) {
  ElasticCoefficients k = elastic_of(c);
  k.stretch_natural.array() += 0.07;
  k.bend_natural.array() += 0.2;
  k.half_natural.array() -= 0.15;
  return k;
}

void expect_exact(const Case& c, const ElasticCoefficients& k) {
  for (Kind kind : kKinds) {
    if (count_of(c.model, kind) == 0) continue;
    const Sum sum = sum_of(c, k, kind, c.q);
    EXPECT_TRUE(gradient_matches([&](const VectorX& q) { return sum_of(c, k, kind, q).energy; }, c.q, sum.gradient,
                                 c.increment))
        << c.name << ", gradient of " << name_of(kind);
    EXPECT_TRUE(derivative_matches([&](const VectorX& q) { return sum_of(c, k, kind, q).gradient; }, c.q, sum.hessian,
                                   c.increment))
        << c.name << ", Hessian of " << name_of(kind);
    EXPECT_LT((sum.hessian - sum.hessian.transpose()).norm(), 1e-12 * sum.hessian.norm())
        << c.name << ", symmetry of " << name_of(kind);
  }
}

TEST(Elements, DerivativesAreExactInEveryStateAndScene) {
  for (const Case& c : all_cases()) expect_exact(c, loaded(c));
}

TEST(Elements, DerivativesOfViscosityAreExact) {
  testing::RodMaterial viscous;
  viscous.viscous_time = 0.3;
  for (const Case& c : all_cases(viscous)) {
    Configuration start;
    compute_configuration(c.model, c.state, c.state.q, start);
    const Parameters p = initial_parameters(c.model);
    ElasticCoefficients k;
    set_viscous(c.model, p, start, 0.2, k);
    k.stretch_natural.array() += 0.05;  // at rest nothing flows, and there is nothing to compare
    k.bend_natural.array() += 0.05;
    k.half_natural.array() += 0.05;
    expect_exact(c, k);
  }
}

TEST(Elements, ElasticityAndViscosityTogetherActLikeTheirSum) {
  testing::RodMaterial viscous;
  viscous.viscous_time = 0.3;
  for (const Case& c : all_cases(viscous)) {
    Configuration start;
    compute_configuration(c.model, c.state, c.state.q, start);
    const ElasticCoefficients elastic = elastic_of(c);
    ElasticCoefficients flow, both = elastic;
    set_viscous(c.model, initial_parameters(c.model), start, 0.2, flow);
    add_coefficients(flow, both);
    for (Kind kind : kKinds) {
      const VectorX sum = sum_of(c, elastic, kind, c.q).gradient + sum_of(c, flow, kind, c.q).gradient;
      EXPECT_LT((sum_of(c, both, kind, c.q).gradient - sum).norm(), 1e-11 * (1.0 + sum.norm())) << c.name;
    }
  }
}

TEST(Elements, ViscosityRestsWhereNothingMoves) {
  testing::RodMaterial viscous;
  viscous.viscous_time = 0.3;
  for (Case& c : all_cases(viscous)) {
    Configuration start;
    compute_configuration(c.model, c.state, c.q, start);
    ElasticCoefficients k;
    set_viscous(c.model, initial_parameters(c.model), start, 0.2, k);
    for (Kind kind : kKinds) EXPECT_LT(sum_of(c, k, kind, c.q).gradient.norm(), 1e-12) << c.name;
  }
}

TEST(Elements, ForcesAndMomentsBalance) {
  for (const Case& c : all_cases()) {
    const ElasticCoefficients k = loaded(c);
    for (const auto& [u, omega] : testing::rigid_motions(c.model)) {
      const VectorX d = testing::rigid_motion(c, u, omega);
      for (Kind kind : kKinds) {
        const VectorX g = sum_of(c, k, kind, c.q).gradient;
        EXPECT_NEAR(g.dot(d), 0.0, 1e-11 * (1.0 + g.norm() * d.norm()))
            << c.name << ", " << name_of(kind) << ", velocity " << u.transpose() << ", spin " << omega.transpose();
      }
    }
  }
}

TEST(Elements, EnergyDoesNotChangeUnderFiniteRigidMotion) {
  const Matrix3 R = rotation_exp(Vector3(0.8, -1.7, 0.6));
  const Vector3 shift(3.0, -1.0, 2.0);
  for (const Case& c : all_cases()) {
    if (c.model.planar()) continue;
    Case moved = c;
    for (int i = 0; i < c.model.node_count; ++i) {
      const int dof = c.model.node_dof[at(i)];
      moved.q.segment<3>(dof) = R * c.q.segment<3>(dof) + shift;
    }
    for (Vec3d& t : moved.state.tangent) t = to_vec3(R * to_eigen(t));
    for (Vec3d& d : moved.state.director) d = to_vec3(R * to_eigen(d));
    for (int f = 0; f < c.model.frame_count; ++f) {
      const int dof = c.model.frame_dof[at(f)];
      moved.q.segment<3>(dof) = R * c.q.segment<3>(dof);
      moved.state.frame[at(f)] = R * c.state.frame[at(f)];
    }
    const ElasticCoefficients k = loaded(c);
    for (Kind kind : kKinds) {
      const double before = sum_of(c, k, kind, c.q).energy;
      EXPECT_NEAR(sum_of(moved, k, kind, moved.q).energy, before, 1e-11 * (1.0 + before)) << c.name;
    }
  }
}

TEST(Elements, EnergyDoesNotDependOnTheSourceFrameWithinAStep) {
  // Frames that advance in two moves to the same tangents differ by an angle that theta takes up; accepting a
  // configuration changes neither strains nor energies.
  for (const Case& c : all_cases()) {
    Configuration configuration;
    compute_configuration(c.model, c.state, c.q, configuration);
    Case after = c;
    accept_configuration(c.model, c.q, configuration, after.state);
    after.q = after.state.q;
    const ElasticCoefficients k = loaded(c);
    for (Kind kind : kKinds) {
      const Sum a = sum_of(c, k, kind, c.q), b = sum_of(after, k, kind, after.q);
      EXPECT_NEAR(a.energy, b.energy, 1e-11 * (1.0 + a.energy)) << c.name << ", " << name_of(kind);
    }
  }
}

TEST(Elements, NothingIsStressedWhereARodIsDrawnInItsNaturalShape) {
  testing::SceneBuilder builder;
  builder.add_rod(testing::line(Vector3(0.2, 0.1, 0.0), Vector3(2.0, -1.0, 1.0), 6));
  builder.support(SupportKind::clamp, {0, 0});
  const Model model = build_model(builder.scene, false);
  const Case c{"straight", model, initial_state(model), initial_state(model).q};
  for (Kind kind : kKinds) EXPECT_LT(sum_of(c, elastic_of(c), kind, c.q).gradient.norm(), 1e-12);
}

TEST(AxialForce, IsStiffnessTimesStrainBeyondTheNaturalOne) {
  EXPECT_NEAR(axial_force(1.2, 1.0, 50.0, 0.0), 10.0, 1e-13);
  EXPECT_NEAR(axial_force(1.8, 2.0, 50.0, 0.1), -10.0, 1e-13);
}

TEST(PlanarBend, DerivativesInTheTurnAreExact) {
  for (const BendMeasure& measure : {BendMeasure{}, BendMeasure{0.0, 0.0}})
    for (double phi : {0.0, 0.4, -1.1, 150.0 * testing::kPi / 180.0, 170.0 * testing::kPi / 180.0}) {
      const auto bend = [&](double angle) { return planar_bend(measure, 2.0 * std::tan(0.5 * angle), 0.3, 2.0); };
      const PlanarBend b = bend(phi);
      const auto energy = [&](const VectorX& x) { return bend(x(0)).energy; };
      const auto slope = [&](const VectorX& x) { return VectorX::Constant(1, bend(x(0)).slope); };
      const VectorX x = VectorX::Constant(1, phi);
      EXPECT_TRUE(gradient_matches(energy, x, VectorX::Constant(1, b.slope))) << phi;
      EXPECT_TRUE(derivative_matches(slope, x, MatrixX::Constant(1, 1, b.curvature))) << phi;
    }
}

TEST(BendMeasure, IsTheAngleToSixthOrderAndGrowsWithoutEnd) {
  const auto strain = [](double phi) {
    const double kappa = 2.0 * std::tan(0.5 * phi);
    return bend_factor(BendMeasure{}, kappa * kappa).value * kappa;
  };
  // beta - phi = phi^7 (1/448 - 3/1600) + ...
  for (double phi : {0.1, 0.2, 0.4})
    EXPECT_NEAR((strain(phi) - phi) / std::pow(phi, 7), 1.0 / 448.0 - 3.0 / 1600.0, 1e-3 * phi * phi) << phi;
  EXPECT_GT(strain(testing::kPi - 1e-3), 100.0);
}

TEST(Elements, APlanarSceneHasTheEnergyAndForcesOfTheSameSceneInSpace) {
  testing::RodMaterial material;
  material.curvature = {0.0, 0.6};
  testing::SceneBuilder builder;
  builder.add_rod(testing::arc(6), material, false, Vector3::UnitY());
  builder.support(SupportKind::clamp, {0, 0});
  const Model flat = build_model(builder.scene, std::nullopt), space = build_model(builder.scene, false);
  ASSERT_TRUE(flat.planar());
  Case a{"plane", flat, initial_state(flat), initial_state(flat).q};
  Case b{"space", space, initial_state(space), initial_state(space).q};
  testing::RandomNumbers random(3);
  const Plane& plane = *flat.plane;
  for (int i = 0; i < flat.node_count; ++i) {
    const Vector2 move = 0.1 * Vector2(random.normal(), random.normal());
    a.q.segment<2>(flat.node_dof[at(i)]) += move;
    b.q.segment<3>(space.node_dof[at(i)]) += move(0) * plane.first + move(1) * plane.second;
  }
  a.q(flat.frame_dof[0]) = 0.2;
  b.q.segment<3>(space.frame_dof[0]) = 2.0 * std::tan(0.1) * plane.normal;
  for (Kind kind : kKinds) {
    const Sum s = sum_of(a, elastic_of(a), kind, a.q), t = sum_of(b, elastic_of(b), kind, b.q);
    EXPECT_NEAR(s.energy, t.energy, 1e-12 * (1.0 + s.energy)) << name_of(kind);
    for (int i = 0; i < flat.node_count; ++i) {
      const Vector2 g = s.gradient.segment<2>(flat.node_dof[at(i)]);
      const Vector3 in_space = t.gradient.segment<3>(space.node_dof[at(i)]);
      EXPECT_LT((g(0) * plane.first + g(1) * plane.second - in_space).norm(), 1e-11) << name_of(kind) << ", node " << i;
    }
  }
}

}  // namespace
}  // namespace withe
