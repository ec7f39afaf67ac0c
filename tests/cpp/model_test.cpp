// Decisions of `build`: planes, stencils, joints, layout of the unknowns, natural shapes, masses.

#include <gtest/gtest.h>

#include <numeric>

#include "model/edge_vectors.hpp"
#include "model/state.hpp"
#include "states.hpp"

namespace withe {
namespace {

using testing::kPi;
using testing::RodMaterial;
using testing::SceneBuilder;

RodMaterial isotropic() {
  RodMaterial m;
  m.bend2 = m.bend1;
  return m;
}

SceneBuilder flat_arc(const RodMaterial& material = isotropic()) {
  SceneBuilder builder;
  builder.add_rod(testing::arc(8), material, false, Vector3::UnitY());
  builder.scene.gravity = Vector3(0.0, 0.0, -9.81);
  return builder;
}

bool is_planar(const SceneDescription& scene) { return build_model(scene, std::nullopt).planar(); }

TEST(Plane, IsFoundForACurvedRodUnderGravityInIt) { EXPECT_TRUE(is_planar(flat_arc().scene)); }

TEST(Plane, IsFoundInAnyOrientation) {
  const Matrix3 R = rotation_exp(Vector3(0.7, -0.4, 1.3));
  SceneBuilder turned;
  turned.add_rod((testing::arc(8) * R.transpose()).rowwise() + Vector3(1, 2, 3).transpose(), isotropic(), false,
                 R.col(1));
  turned.scene.gravity = R * Vector3(0.0, 0.0, -9.81);
  const Model model = build_model(turned.scene, std::nullopt);
  ASSERT_TRUE(model.planar());
  EXPECT_NEAR(std::abs(model.plane->normal.dot(R.col(1))), 1.0, 1e-12);
}

TEST(Plane, IsSpannedByAStraightRodAndGravity) {
  SceneBuilder builder;
  builder.add_rod(testing::line(Vector3::Zero(), Vector3(1, 0, 0), 5), isotropic(), false, Vector3::UnitY());
  EXPECT_FALSE(is_planar(builder.scene));  // no gravity: it lies in no plane of its own
  builder.scene.gravity = Vector3(0, 0, -9.81);
  EXPECT_TRUE(is_planar(builder.scene));
}

TEST(Plane, IsNotFoundWhereAnythingLeavesIt) {
  const auto spoiled = [](auto&& spoil) {
    SceneBuilder builder = flat_arc();
    spoil(builder);
    const Model model = build_model(builder.scene, std::nullopt);
    EXPECT_EQ(model.planar(), model.plane_reason.empty());
    return !model.planar();
  };
  EXPECT_TRUE(spoiled([](SceneBuilder& b) { b.scene.gravity = Vector3(0, 1e-3, -9.81); }));
  EXPECT_TRUE(spoiled([](SceneBuilder& b) { b.scene.positions(3, 1) += 1e-3; }));
  EXPECT_TRUE(spoiled([](SceneBuilder& b) { b.load(LoadKind::force, {0, 7}, Vector3(0, 1, 0)); }));
  EXPECT_TRUE(spoiled([](SceneBuilder& b) { b.load(LoadKind::moment, {0, 7}, Vector3(1, 0, 0)); }));
  EXPECT_TRUE(spoiled([](SceneBuilder& b) {
    b.load(LoadKind::force, {0, 7}, Vector3(1, 0, 0));
    b.scene.loads[0].varies = true;
  }));
  EXPECT_TRUE(spoiled([](SceneBuilder& b) { b.scene.has_custom_force = true; }));
  SceneBuilder asked = flat_arc();
  asked.scene.has_custom_force = true;
  EXPECT_TRUE(build_model(asked.scene, true).planar());  // who asks for a plane keeps forces in it
  EXPECT_TRUE(spoiled([](SceneBuilder& b) { b.scene.rods[0].natural_twist(2) = 0.1; }));
  EXPECT_TRUE(spoiled([](SceneBuilder& b) { b.scene.rods[0].natural_curvature(2, 0) = 0.1; }));  // towards d1 = y
  EXPECT_TRUE(spoiled([](SceneBuilder& b) {
    const Vector3 tilted = Vector3(0, 1, 1).normalized();
    b.support(SupportKind::pin, {0, 0}, tilted * tilted.transpose());
  }));
  EXPECT_FALSE(spoiled([](SceneBuilder& b) { b.load(LoadKind::moment, {0, 7}, Vector3(0, 1, 0)); }));
  EXPECT_FALSE(spoiled([](SceneBuilder& b) { b.scene.rods[0].natural_curvature(2, 1) = 0.1; }));
  EXPECT_FALSE(spoiled(
      [](SceneBuilder& b) { b.support(SupportKind::pin, {0, 0}, Vector3::UnitZ() * Vector3::UnitZ().transpose()); }));
}

TEST(Plane, IsNotFoundForASectionAtAnAngleToIt) {
  RodMaterial flat;  // bend1 and bend2 differ
  SceneBuilder along, across, tilted;
  along.add_rod(testing::arc(8), flat, false, Vector3::UnitY());
  tilted.add_rod(testing::arc(8), flat, false, Vector3(0.4, 1.0, 0.0));
  EXPECT_TRUE(is_planar(along.scene));
  EXPECT_FALSE(is_planar(tilted.scene));
}

TEST(Plane, CanBeForbiddenAndDemanded) {
  EXPECT_FALSE(build_model(flat_arc().scene, false).planar());
  EXPECT_TRUE(build_model(flat_arc().scene, true).planar());
  SceneBuilder spatial;
  spatial.add_rod(testing::helix(8));
  EXPECT_THROW(build_model(spatial.scene, true), std::invalid_argument);
}

TEST(Plane, HalvesTheUnknowns) {
  EXPECT_EQ(build_model(flat_arc().scene, true).dof_count, 16);
  EXPECT_EQ(build_model(flat_arc().scene, false).dof_count, 8 * 4 - 1);
}

TEST(Plane, KeepsTheDrawnPositions) {
  const SceneBuilder builder = flat_arc();
  const Model model = build_model(builder.scene, true);
  for (int i = 0; i < model.node_count; ++i) {
    const int dof = model.node_dof[at(i)];
    const Vector3 x = model.plane->origin + model.initial_q(dof) * model.plane->first +
                      model.initial_q(dof + 1) * model.plane->second;
    EXPECT_LT((x - builder.scene.positions.row(i).transpose()).norm(), 1e-13);
  }
}

TEST(Stencils, OfAnOpenRodSitAtItsInnerNodes) {
  SceneBuilder builder;
  builder.add_rod(testing::helix(7));
  const Model model = build_model(builder.scene, std::nullopt);
  EXPECT_EQ(model.edge_count, 6);
  ASSERT_EQ(model.bend.size(), 5u);
  EXPECT_TRUE(model.half.empty());
  for (int s = 0; s < 5; ++s) {
    EXPECT_EQ(model.place[0][at(s)].bend, s);
    EXPECT_EQ(model.bend[at(s)].node[1], s + 1);
  }
}

TEST(Stencils, OfAClosedRingSitAtEveryNode) {
  SceneBuilder builder;
  builder.add_rod(testing::ring(8, 1.0, 0.3), {}, true);
  const Model model = build_model(builder.scene, std::nullopt);
  EXPECT_EQ(model.edge_count, 8);
  ASSERT_EQ(model.bend.size(), 8u);
  EXPECT_EQ(model.bend[0].edge[0], 7);
  EXPECT_EQ(model.bend[0].edge[1], 0);
  EXPECT_EQ(model.bend[0].node[1], 0);
  EXPECT_EQ(model.dof_count, 8 * 4);
}

TEST(Stencils, OfAClampHaveHalfTheLengthOfItsEdge) {
  SceneBuilder builder;
  builder.add_rod(testing::helix(7));
  builder.support(SupportKind::clamp, {0, 6});
  const Model model = build_model(builder.scene, std::nullopt);
  ASSERT_EQ(model.half.size(), 1u);
  EXPECT_FALSE(model.half[0].frame_first);
  EXPECT_EQ(model.half[0].edge, 5);
  EXPECT_NEAR(model.half_voronoi(0), 0.5 * model.edge_length(5), 1e-15);
  EXPECT_EQ(model.wall_half[0][1], 0);
  EXPECT_EQ(model.wall_half[0][0], -1);
}

TEST(Stencils, OfAClampInsideARodReplaceTheOrdinaryOne) {
  SceneBuilder builder;
  builder.add_rod(testing::helix(7));
  builder.support(SupportKind::clamp, {0, 3});
  const Model model = build_model(builder.scene, std::nullopt);
  EXPECT_EQ(model.bend.size(), 4u);
  EXPECT_EQ(model.half.size(), 2u);
  EXPECT_EQ(model.place[0][2].bend, -1);
  EXPECT_GE(model.place[0][2].half[0], 0);
  EXPECT_GE(model.place[0][2].half[1], 0);
}

/// A straight rod cut in two at its middle; the second part's directors turned by `roll` [rad].
SceneBuilder cut_rod(double roll, bool reversed = false) {
  SceneBuilder builder;
  const Vector3 a(0, 0, 0), b(1, 0, 0), c(2, 0, 0);
  const Vector3 normal = Vector3::UnitY();
  builder.add_rod(testing::line(a, b, 4), {}, false, normal);
  const MatrixX3 rest = reversed ? testing::line(c, b, 4) : testing::line(b, c, 4);
  builder.add_rod(rest, {}, false, rotation_exp(roll * Vector3::UnitX()) * normal);
  builder.join({{0, 3}, {1, reversed ? 3 : 0}});
  return builder;
}

TEST(Joints, EndToEndAreOneRodWithTheOrdinaryStencil) {
  const Model model = build_model(cut_rod(0.0).scene, false);
  EXPECT_EQ(model.frame_count, 0);
  EXPECT_EQ(model.bend.size(), 5u);
  EXPECT_TRUE(model.half.empty());
}

TEST(Joints, EndToEndOwnAFrameWhereDirectorsOrDirectionsDiffer) {
  for (const SceneBuilder& builder : {cut_rod(0.3), cut_rod(0.0, true)}) {
    const Model model = build_model(builder.scene, false);
    EXPECT_EQ(model.frame_count, 1);
    EXPECT_EQ(model.half.size(), 2u);
    EXPECT_EQ(model.bend.size(), 4u);
  }
}

TEST(Joints, OfThreeRodsOwnOneFrameWithOneStencilForEachEdge) {
  const Model model = build_model(testing::tee(JointForm::frame, false).scene, std::nullopt);
  EXPECT_EQ(model.frame_count, 1);
  EXPECT_EQ(model.half.size(), 4u);  // the bar passes through
  int leaving = 0;
  for (const FrameStencil& s : model.half) leaving += s.frame_first;
  EXPECT_EQ(leaving, 2);
}

TEST(Joints, OfFormPairsHaveAStencilForEveryPairOfEdges) {
  const Model model = build_model(testing::tee(JointForm::pairs, false).scene, std::nullopt);
  EXPECT_EQ(model.frame_count, 0);
  // Own stencils: 3 of the bar and one of each stem; pairs: 4 edges give 6, less the bar's own.
  EXPECT_EQ(model.bend.size(), 3u + 1u + 1u + 5u);
}

TEST(Joints, DoNotStressWhatIsDrawn) {
  for (JointForm form : {JointForm::frame, JointForm::pairs}) {
    SceneBuilder builder = testing::tee(form, false);
    const Model model = build_model(builder.scene, std::nullopt);
    const State state = initial_state(model);
    Configuration c;
    compute_configuration(model, state, state.q, c);
    const Parameters p = initial_parameters(model);
    for (std::size_t b = 0; b < model.bend.size(); ++b) {
      if (model.bend_owner[b].first >= 0) continue;
      const auto i = static_cast<Eigen::Index>(b);
      const double factor = bend_factor(p.measure, c.bend_strain.row(i).head<2>().squaredNorm()).value;
      c.bend_strain.row(i) *= factor;
      EXPECT_LT((c.bend_strain.row(i) - p.bend_natural.row(i)).norm(), 1e-13);
    }
  }
}

TEST(Joints, PinnedOnlyShareTheirNode) {
  SceneBuilder builder = testing::tee(JointForm::frame, false);
  builder.scene.joints[0].clusters = {{{0, 2}}, {{1, 2}}, {{2, 0}}};
  const Model model = build_model(builder.scene, std::nullopt);
  EXPECT_EQ(model.frame_count, 0);
  EXPECT_TRUE(model.half.empty());
  EXPECT_EQ(model.bend.size(), 3u + 1u + 1u);
  EXPECT_EQ(model.node_count, 5 + 2 + 2);
}

TEST(Joints, RevoluteAddOneAngleEach) {
  const Model model = build_model(testing::hinged().scene, std::nullopt);
  EXPECT_EQ(model.hinges.size(), 2u);
  EXPECT_EQ(model.frame_count, 1);
  EXPECT_EQ(model.dof_count, 3 * model.node_count + model.edge_count + 3 + 2);
}

TEST(Joints, RevoluteAboutTheNormalLieBetweenTwoFramesInAPlane) {
  SceneBuilder builder;
  const Vector3 o(0, 0, 0), y = Vector3::UnitY();
  builder.add_rod(testing::line(Vector3(-2, 0, 0), o, 3), isotropic(), false, y);
  builder.add_rod(testing::line(o, Vector3(1, 0, 2), 3), isotropic(), false, y);
  builder.join_revolute({{0, 2}}, {1, 0}, y);
  const Model model = build_model(builder.scene, true);
  EXPECT_TRUE(model.hinges.empty());
  EXPECT_EQ(model.bend.size(), 2u);
  EXPECT_EQ(model.half.size(), 2u);
  EXPECT_EQ(model.frame_count, 2);
  EXPECT_EQ(model.dof_count, 2 * model.node_count + 2);
  VectorX q = model.initial_q;
  EXPECT_EQ(model.joint_angles.at(0).angle(q), 0.0);
  q[model.joint_angles[0].turning] += model.plane->normal.y() * 0.3;
  EXPECT_NEAR(model.joint_angles[0].angle(q), 0.3, 1e-15);
  SceneBuilder other;
  other.add_rod(testing::line(Vector3(-2, 0, 0), o, 3), isotropic(), false, y);
  other.add_rod(testing::line(o, Vector3(1, 0, 2), 3), isotropic(), false, y);
  other.join_revolute({{0, 2}}, {1, 0}, Vector3::UnitX());
  const Model held = build_model(other.scene, true);
  EXPECT_EQ(held.half.size(), 2u);  // about another axis it cannot turn in the plane
  EXPECT_EQ(held.frame_count, 1);
  EXPECT_FALSE(held.joint_angles.at(0).turns());
  other.scene.joints[0].links[0].moment = 0.1;
  EXPECT_FALSE(build_model(other.scene, std::nullopt).planar());
}

TEST(Joints, RodsThatAPlaneLetsTurnByNothingAreOneWhoeverIsJoinedToWhom) {
  SceneBuilder builder;
  const Vector3 o(0, 0, 0), y = Vector3::UnitY();
  builder.add_rod(testing::line(Vector3(-2, 0, 0), o, 3), isotropic(), false, y);
  builder.add_rod(testing::line(o, Vector3(1, 0, 2), 3), isotropic(), false, y);
  builder.add_rod(testing::line(o, Vector3(1, 0, -2), 3), isotropic(), false, y);
  JointLink first, second;
  first.parent = 0, first.child = 1, first.axis = Vector3::UnitX();
  second.parent = 2, second.child = 1, second.axis = Vector3::UnitX();
  builder.scene.joints.push_back(
      {.clusters = {{{0, 2}}, {{1, 0}}, {{2, 0}}}, .bodies = {}, .links = {first, second}, .form = JointForm::frame});
  const Model model = build_model(builder.scene, true);
  EXPECT_EQ(model.frame_count, 1);
  EXPECT_EQ(model.half.size(), 3u);
}

/// A hub may be the first or the second of each of its joints: what turns is the other.
TEST(Joints, EveryHingeTurnsAgainstTheHubWhicheverComesFirst) {
  for (bool first_swapped : {false, true})
    for (bool second_swapped : {false, true}) {
      SceneDescription scene = testing::hinged().scene;
      std::vector<JointLink>& links = scene.joints[0].links;
      if (first_swapped) std::swap(links[0].parent, links[0].child);
      if (second_swapped) std::swap(links[1].parent, links[1].child);
      const Model model = build_model(scene, std::nullopt);
      EXPECT_EQ(model.frame_count, 1);
      for (const FrameStencil& half : model.half) {
        EXPECT_EQ(half.frame, 0);
        const int rod = model.edge_rod[at(half.edge)];
        EXPECT_EQ(half.hinge, rod == 2 ? 0 : rod == 3 ? 1 : -1);
      }
      EXPECT_EQ(model.joint_angles.at(0).sign, first_swapped ? -1.0 : 1.0);
      EXPECT_EQ(model.joint_angles.at(1).sign, second_swapped ? -1.0 : 1.0);
    }
}

TEST(Joints, OfTwoRodsAtAHingeTheOneThatIsClampedStays) {
  for (int clamped : {0, 1}) {
    SceneBuilder builder;
    builder.add_rod(testing::line(Vector3(-2, 0, 0), Vector3::Zero(), 3), isotropic());
    builder.add_rod(testing::line(Vector3::Zero(), Vector3(1, 0, 2), 3), isotropic());
    builder.join_revolute({{0, 2}}, {1, 0}, Vector3::UnitY());
    builder.support(SupportKind::clamp, {clamped, clamped == 0 ? 2 : 0});
    const Model model = build_model(builder.scene, false);
    EXPECT_EQ(model.joint_angles.at(0).sign, clamped == 1 ? -1.0 : 1.0);
    for (const FrameStencil& half : model.half)
      EXPECT_EQ(half.hinge, model.edge_rod[at(half.edge)] == clamped ? -1 : 0);
  }
}

TEST(Layout, NumbersEveryUnknownOnce) {
  for (const testing::Case& c : testing::all_cases()) {
    const Model& m = c.model;
    std::vector<int> used(at(m.dof_count), 0);
    const auto use = [&](int first, int count) {
      for (int i = 0; i < count; ++i) ++used.at(at(first + i));
    };
    for (int dof : m.node_dof) use(dof, m.dimension);
    for (int dof : m.edge_dof) use(dof, 1);
    for (int dof : m.frame_dof) use(dof, m.frame_size());
    for (const Hinge& hinge : m.hinges) use(hinge.dof, 1);
    EXPECT_EQ(used, std::vector<int>(at(m.dof_count), 1)) << c.name;
  }
}

TEST(Layout, RefusesTwoSupportsOfOneNode) {
  SceneBuilder builder;
  builder.add_rod(testing::helix(5));
  builder.support(SupportKind::pin, {0, 0});
  builder.support(SupportKind::clamp, {0, 0});
  EXPECT_THROW(build_model(builder.scene, std::nullopt), std::invalid_argument);
}

TEST(NaturalCurvature, OfTheSmoothRodTurnsAStencilByItsVoronoiLength) {
  const Vector2 k(1.1, -0.6);
  const double voronoi = 0.4;
  EXPECT_NEAR(discrete_curvature(k, voronoi).norm(), 2.0 * std::tan(0.5 * k.norm() * voronoi), 1e-14);
  EXPECT_LT((smooth_curvature(discrete_curvature(k, voronoi), voronoi) - k).norm(), 1e-14);
  EXPECT_EQ(discrete_curvature(Vector2::Zero(), voronoi).norm(), 0.0);
  EXPECT_THROW(discrete_curvature(Vector2(8.0, 0.0), voronoi), std::invalid_argument);
}

TEST(NaturalCurvature, OfACircleLeavesItsDrawingWithoutStress) {
  // A polygon inscribed in a circle turns by 2 pi / n a node; its sides are shorter than the arc.
  const int n = 24;
  SceneBuilder builder;
  const double turn = 2.0 * kPi / n, side = 2.0 * std::sin(0.5 * turn);
  RodMaterial material = isotropic();
  material.curvature = Vector2(0.0, turn / side);  // d1 = z, so d2 = t x z points outwards
  builder.add_rod(testing::ring(n), material, true, Vector3::UnitZ());
  const Model model = build_model(builder.scene, false);
  const State state = initial_state(model);
  Configuration c;
  compute_configuration(model, state, state.q, c);
  const Parameters p = initial_parameters(model);
  const double kappa = 2.0 * std::tan(0.5 * turn);
  c.bend_strain *= bend_factor(p.measure, kappa * kappa).value;
  EXPECT_LT((c.bend_strain.cwiseAbs() - p.bend_natural.cwiseAbs()).norm(), 1e-12);
}

TEST(Masses, AddUpToTheRods) {
  for (const testing::Case& c : testing::all_cases()) {
    const Parameters p = initial_parameters(c.model);
    EXPECT_NEAR(p.node_mass.sum(), 1.3 * c.model.edge_length.sum(), 1e-12) << c.name;
  }
}

TEST(StencilStiffness, OfUnequalEdgesActsInSeries) {
  SceneBuilder builder;
  MatrixX3 points(3, 3);
  points << 0, 0, 0, 1, 0, 0, 4, 0, 0;
  builder.add_rod(points);
  builder.scene.rods[0].bend_stiffness.row(1) *= 10.0;
  const Model model = build_model(builder.scene, false);
  const Parameters p = initial_parameters(model);
  EXPECT_NEAR(1.0 / p.bend_stiffness(0, 0), 0.5 / 1.0 + 1.5 / 10.0, 1e-14);
}

TEST(AcceptConfiguration, KeepsDirectorsAndTransportsFramesOverAWholeTurn) {
  // A straight rod carried once round a cone: its directors come back turned by the solid angle.
  SceneBuilder builder;
  builder.add_rod(testing::line(Vector3::Zero(), Vector3(0, 0, 1), 2), {}, false, Vector3::UnitX());
  const Model model = build_model(builder.scene, false);
  State state = initial_state(model);
  Configuration c;
  const double half_angle = 0.5;
  const int steps = 4000;
  const auto point = [&](double a) {
    return Vector3(std::sin(half_angle) * std::cos(a), std::sin(half_angle) * std::sin(a), std::cos(half_angle));
  };
  const auto go = [&](const Vector3& tip) {
    VectorX q = state.q;
    q.segment<3>(model.node_dof[1]) = tip;
    compute_configuration(model, state, q, c);
    accept_configuration(model, q, c, state);
  };
  go(point(0.0));
  const Vector3 before = to_eigen(state.director[0]);
  for (int k = 1; k <= steps; ++k) go(point(2.0 * kPi * k / steps));
  const Vector3 after = to_eigen(state.director[0]);
  const double solid_angle = 2.0 * kPi * (1.0 - std::cos(half_angle));
  EXPECT_NEAR(signed_angle(to_vec3(before), to_vec3(after), state.tangent[0]), solid_angle, 1e-5);
  EXPECT_NEAR(after.norm(), 1.0, 1e-14);
  EXPECT_NEAR(after.dot(to_eigen(state.tangent[0])), 0.0, 1e-14);
}

TEST(ComputeConfiguration, FollowsTwistOverManyTurns) {
  SceneBuilder builder;
  builder.add_rod(testing::line(Vector3::Zero(), Vector3(2, 0, 0), 3));
  const Model model = build_model(builder.scene, false);
  State state = initial_state(model);
  Configuration c;
  for (int k = 1; k <= 20; ++k) {
    VectorX q = state.q;
    q(model.edge_dof[1]) = k;
    compute_configuration(model, state, q, c);
    accept_configuration(model, q, c, state);
  }
  EXPECT_NEAR(c.bend_strain(0, 2), 20.0, 1e-12);
}

TEST(EdgeVectors, LieInThePlaneOfAPlanarSceneAndTouchNoOtherUnknowns) {
  const Model model = build_model(flat_arc().scene, true);
  const State state = initial_state(model);
  Configuration c;
  compute_configuration(model, state, state.q, c);
  for (int e = 0; e < model.edge_count; ++e) {
    const Vec3d along = (1.0 / c.edge[at(e)].inverse_length) * c.edge[at(e)].tangent;
    EXPECT_NEAR((to_eigen(edge_vector(model, state.q, e)) - to_eigen(along)).norm(), 0.0, 1e-15);
    VectorX rows = VectorX::Zero(model.dof_count);
    add_to_edge(model, e, {1.0, 2.0, 3.0}, rows);
    EXPECT_EQ(rows.cwiseAbs().sum(), 6.0);
    EXPECT_EQ(rows(model.head_dof[at(e)] + 1), 2.0);
  }
}

}  // namespace
}  // namespace withe
