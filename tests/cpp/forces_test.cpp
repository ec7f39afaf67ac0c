// Loads: exact Jacobians, the work they do, and how followers turn with their edge.

#include <gtest/gtest.h>

#include "derivative_check.hpp"
#include "forces/loads.hpp"
#include "states.hpp"

namespace withe {
namespace {

using testing::Case;
using testing::derivative_matches;
using testing::MatrixX;

struct Sum {
  VectorX force;     ///< generalised
  MatrixX jacobian;  ///< of minus the force
};

Sum sum_of(const Case& c, const Loads& loads, const VectorX& q) {
  Configuration configuration;
  compute_configuration(c.model, c.state, q, configuration);
  Sum sum{VectorX::Zero(q.size()), MatrixX::Zero(q.size(), q.size())};
  Local local;
  for (const LoadPiece& piece : loads.pieces) {
    int dofs[kMaxLocal];
    const int n = load_dofs(c.model, piece, dofs);
    load_local(c.model, c.state, q, configuration, piece, initial_parameters(c.model).loads.row(piece.load).transpose(),
               local);
    for (int i = 0; i < n; ++i) {
      sum.force(dofs[i]) -= local.gradient[i];
      for (int j = 0; j < n; ++j) sum.jacobian(dofs[i], dofs[j]) += local.hessian[i][j];
    }
  }
  return sum;
}

struct LoadCase {
  const char* name;
  LoadKind kind;
  RodPass pass;
  bool follower;
};

constexpr LoadCase kLoads[] = {{"follower at the start", LoadKind::force, {0, 0}, true},
                               {"follower inside", LoadKind::force, {0, 2}, true},
                               {"follower at the end", LoadKind::force, {0, 5}, true},
                               {"distributed follower", LoadKind::distributed, {0, 0}, true},
                               {"moment on two edges", LoadKind::moment, {0, 3}, false},
                               {"moment on the last edge", LoadKind::moment, {0, 5}, false},
                               {"moment on a frame", LoadKind::moment, {0, 0}, false},
                               {"moment that follows two edges", LoadKind::moment, {0, 3}, true},
                               {"moment that follows the last edge", LoadKind::moment, {0, 5}, true},
                               {"moment that follows a frame", LoadKind::moment, {0, 0}, true},
                               {"pressure", LoadKind::pressure, {0, 0}, false}};

std::vector<Case> cases_with(const LoadCase& load, bool planar) {
  testing::SceneBuilder builder;
  testing::RodMaterial material;
  material.bend2 = material.bend1;
  if (planar)
    builder.add_rod(testing::arc(6), material, false, Vector3::UnitY());
  else
    builder.add_rod(testing::helix(6), material);
  if (load.kind == LoadKind::moment) builder.support(SupportKind::clamp, {0, 0});
  const Vector3 value = !planar               ? Vector3(0.7, -1.1, 0.5)
                        : is_axial(load.kind) ? Vector3(0.0, 0.9, 0.0)
                                              : Vector3(0.7, 0.0, -0.4);
  builder.load(load.kind, load.pass, value, load.follower);
  std::vector<Case> cases = testing::states_of(load.name, builder.scene);
  // As far from its source frame as a Newton iterate may try: transport is singular at 180 degrees.
  for (double turn : {150.0, 170.0}) {
    cases.push_back(cases.front());
    cases.back().name = std::string(load.name) + ", turned by " + std::to_string(turn) + " degrees within the step";
    cases.back().increment = 1e-3;
    testing::turn_within_step(cases.back(), turn * testing::kPi / 180.0);
  }
  return cases;
}

TEST(Loads, JacobiansAreExactInEveryState) {
  for (bool planar : {false, true})
    for (const LoadCase& load : kLoads)
      for (const Case& c : cases_with(load, planar)) {
        ASSERT_EQ(c.model.planar(), planar) << c.name;
        const Loads loads = resolve_loads(c.model);
        const MatrixX minus = -sum_of(c, loads, c.q).jacobian;
        if (planar && load.kind == LoadKind::moment && load.pass.node == 0) {
          EXPECT_EQ(minus.norm(), 0.0);  // in a plane a moment on a frame is a constant
          continue;
        }
        EXPECT_TRUE(derivative_matches([&](const VectorX& q) { return sum_of(c, loads, q).force; }, c.q, minus))
            << c.name << (planar ? ", in a plane" : "");
      }
}

TEST(Loads, AMomentDoesItsAngleOfWorkInARigidTurn) {
  for (bool planar : {false, true})
    for (const LoadCase& load : kLoads) {
      if (load.kind != LoadKind::moment || load.follower) continue;
      for (const Case& c : cases_with(load, planar)) {
        const Loads loads = resolve_loads(c.model);
        const VectorX force = sum_of(c, loads, c.q).force;
        for (const auto& [u, omega] : testing::rigid_motions(c.model))
          EXPECT_NEAR(force.dot(testing::rigid_motion(c, u, omega)),
                      initial_parameters(c.model).loads.row(0).dot(omega), 1e-12)
              << c.name;
      }
    }
}

TEST(Loads, ADeadForceDoesTheWorkOfItsNode) {
  testing::SceneBuilder builder;
  builder.add_rod(testing::helix(6));
  builder.load(LoadKind::force, {0, 2}, Vector3(1, 2, 3));
  const Case c = testing::states_of("dead", builder.scene)[1];
  const VectorX force = sum_of(c, resolve_loads(c.model), c.q).force;
  EXPECT_LT((force.segment<3>(c.model.node_dof[2]) - Vector3(1, 2, 3)).norm(), 1e-15);
  EXPECT_NEAR(force.norm(), Vector3(1, 2, 3).norm(), 1e-15);
}

TEST(Loads, ADistributedLoadAddsUpToItsLength) {
  testing::SceneBuilder builder;
  builder.add_rod(testing::line(Vector3::Zero(), Vector3(3, 0, 0), 7));
  builder.load(LoadKind::distributed, {0, 0}, Vector3(0, 2, 1));
  const Case c = testing::states_of("distributed", builder.scene, false)[0];
  const VectorX force = sum_of(c, resolve_loads(c.model), c.q).force;
  Vector3 total = Vector3::Zero();
  for (int i = 0; i < 7; ++i) total += force.segment<3>(c.model.node_dof[at(i)]);
  EXPECT_LT((total - 3.0 * Vector3(0, 2, 1)).norm(), 1e-14);
}

TEST(Loads, AFollowerTurnsWithItsEdgeAndItsAngle) {
  testing::SceneBuilder builder;
  builder.add_rod(testing::line(Vector3::Zero(), Vector3(0, 0, 2), 3), {}, false, Vector3::UnitX());
  builder.load(LoadKind::force, {0, 2}, Vector3(1.5, 0, 0), true);
  Case c = testing::states_of("follower", builder.scene, false)[0];
  const Loads loads = resolve_loads(c.model);
  c.q(c.model.edge_dof[1]) = 0.5 * testing::kPi;
  EXPECT_LT((sum_of(c, loads, c.q).force.segment<3>(c.model.node_dof[2]) - Vector3(0, 1.5, 0)).norm(), 1e-14);
  c.q(c.model.edge_dof[1]) = 0.0;
  c.q.segment<3>(c.model.node_dof[2]) = Vector3(1, 0, 1);  // the edge now points along x
  EXPECT_LT((sum_of(c, loads, c.q).force.segment<3>(c.model.node_dof[2]) - Vector3(0, 0, -1.5)).norm(), 1e-14);
}

TEST(Loads, AreUnsymmetricOnlyWhereTheyHaveTo) {
  const auto unsymmetric = [](LoadKind kind, bool follower, bool planar) {
    const LoadCase load{"", kind, {0, 5}, follower};
    return resolve_loads(cases_with(load, planar)[0].model).unsymmetric;
  };
  EXPECT_FALSE(unsymmetric(LoadKind::force, false, false));
  EXPECT_TRUE(unsymmetric(LoadKind::force, true, false));
  EXPECT_TRUE(unsymmetric(LoadKind::force, true, true));
  EXPECT_TRUE(unsymmetric(LoadKind::moment, false, false));
  EXPECT_FALSE(unsymmetric(LoadKind::moment, false, true));
}

TEST(Loads, AMomentThatFollowsTurnsWithItsEdge) {
  testing::SceneBuilder builder;
  builder.add_rod(testing::line(Vector3::Zero(), Vector3(0, 0, 2), 3), {}, false, Vector3::UnitX());
  builder.load(LoadKind::moment, {0, 2}, Vector3(0, 0, 1.5), true);  // about the tangent, wherever that points
  Case c = testing::states_of("moment", builder.scene, false)[0];
  const Loads loads = resolve_loads(c.model);
  c.q.segment<3>(c.model.node_dof[2]) = Vector3(1, 0, 1);
  const VectorX force = sum_of(c, loads, c.q).force;
  EXPECT_NEAR(force(c.model.edge_dof[1]), 1.5, 1e-14);
  for (const auto& [u, omega] : testing::rigid_motions(c.model)) {
    Case turned = c;
    turned.state.q = c.q;
    EXPECT_NEAR(force.dot(testing::rigid_motion(turned, u, omega)), Vector3(1.5, 0, 0).dot(omega), 1e-12);
  }
}

TEST(Loads, APressureOnAClosedRodIsTheGradientOfAnArea) {
  for (bool planar : {false, true}) {
    testing::SceneBuilder builder;
    testing::RodMaterial material;
    material.bend2 = material.bend1;
    builder.add_rod(testing::arc(6), material, true, Vector3::UnitY());
    builder.load(LoadKind::pressure, {0, 0}, Vector3(0.0, 0.9, 0.0));
    for (const Case& c : testing::states_of("ring", builder.scene, planar)) {
      const Loads loads = resolve_loads(c.model);
      EXPECT_FALSE(loads.unsymmetric);
      const Sum sum = sum_of(c, loads, c.q);
      EXPECT_LT((sum.jacobian - sum.jacobian.transpose()).norm(), 1e-14) << c.name;
      const auto energy = [&](const VectorX& q) {
        Configuration configuration;
        compute_configuration(c.model, c.state, q, configuration);
        Local local;
        double total = 0.0;
        for (const LoadPiece& piece : loads.pieces) {
          load_local(c.model, c.state, q, configuration, piece,
                     initial_parameters(c.model).loads.row(piece.load).transpose(), local);
          total += local.energy;
        }
        return VectorX::Constant(1, total);
      };
      EXPECT_TRUE(derivative_matches(energy, c.q, MatrixX(-sum.force.transpose()))) << c.name;
    }
  }
}

}  // namespace
}  // namespace withe
