// Rings that rods slide through, among the equations: where the rod passes, forces are those of the energy, matrices
// the derivatives of forces, and over an energy-momentum step work is what the energy changes by.

#include <gtest/gtest.h>

#include "case_residual.hpp"
#include "model/edge_vectors.hpp"
#include "states.hpp"
#include "steps/equations.hpp"

namespace withe {
namespace {

using testing::bare;
using testing::Case;
using testing::CaseResidual;
using testing::derivative_matches;
using testing::expect_forces_of_energy;
using testing::expect_wrench_is_felt;
using testing::kRules;
using testing::MatrixX;
using testing::RandomNumbers;
using testing::SceneBuilder;

/// Means that hold the rod along itself, or nothing: a drive, a drive that slips, and friction.
enum class Along { nothing, drive, slipping_drive, friction };

/// Two rings on a rod, that the rod has moved from and within.
std::vector<Case> cases(bool planar, Along along) {
  SceneBuilder builder;
  testing::RodMaterial material;
  if (planar) material.bend2 = material.bend1;
  builder.add_rod(planar ? testing::arc(7) : testing::helix(7), material, false, Vector3(0.0, 1.0, 0.0));
  const double whole = builder.scene.rods[0].rest_lengths.sum();
  for (double share : {0.31, 0.66}) {
    builder.support(SupportKind::hand, {0, 0});
    HandDescription& hand = builder.scene.supports.back().hand;
    hand.at = share * whole;
    hand.yields = hand.slides = true;
    hand.stiffness = {3.0, 3.0, 3.0, 0.0, 0.0, 0.0};
    hand.feeds = along == Along::drive || along == Along::slipping_drive;
    if (along == Along::slipping_drive) hand.force_limit = 0.02;
    if (along == Along::friction) hand.friction = 0.3;
  }
  std::vector<Case> out = testing::states_of(planar ? "arc" : "helix", builder.scene);
  RandomNumbers random(5);
  for (Case& c : out)
    for (std::size_t s = 0; s < c.model.supports.size(); ++s) {
      HandState& hand = c.state.hands[s];
      const Support& support = c.model.supports[s];
      const Vector3 normal = planar ? c.model.plane->normal : Vector3(0.3, -0.8, 0.5).normalized();
      const auto in_plane = [&](const Vector3& v) -> Vector3 {
        return planar ? Vector3(v - normal * normal.dot(v)) : v;
      };
      const auto nodes = [&](int node) { return node_position(c.model, c.state.q, node); };
      hand.ring.place = support.curve.place(support.description.hand.at);
      hand.ring.origin = support.description.hand.at + 0.05;
      const Vector3 there = to_eigen(point_at(support.curve, hand.ring.place, nodes, Vector3::Zero()).across);
      hand.rotation = rotation_exp(0.2 * normal);
      hand.position = there + in_plane(0.03 * random.vector());
      hand.points = {in_plane(Vector3(0.02, -0.01, 0.03))};
      const Vector3 centre = hand.position + hand.rotation * hand.points.front();
      hand.ring.place = nearest_place(support.curve, hand.ring.place, nodes, centre);
      hand.ring.slip = passage_of(c.model, c.state, static_cast<int>(s)).slipped;
    }
  return out;
}

/// Rings move within the step, and their drives feed.
std::vector<SupportPose> moved_rings(const Case& c) {
  std::vector<SupportPose> poses;
  for (const HandState& hand : c.state.hands)
    poses.push_back({hand.position + 0.02 * (c.model.planar() ? c.model.plane->first : Vector3(0.6, 0.0, 0.8)),
                     hand.rotation, 0.03});
  return poses;
}

TEST(RodCurve, IsNearestWhereAFineScanFindsIt) {
  RandomNumbers random(3);
  for (const Case& c : cases(false, Along::nothing)) {
    const RodCurve& curve = c.model.supports[0].curve;
    const auto nodes = [&](int node) { return node_position(c.model, c.q, node); };
    for (int k = 0; k < 20; ++k) {
      const double at = curve.whole * (0.1 + 0.04 * k);
      const SplinePlace start = curve.place(at);
      const Vector3 p =
          to_eigen(point_at(curve, start, nodes, Vector3::Zero()).across) + Vector3(0.02 * random.vector());
      const SplinePlace found = nearest_place(curve, start, nodes, p);
      const auto distance = [&](double arc) {
        const Vec3d r = point_at(curve, curve.place(arc), nodes, p).across;
        return std::sqrt(dot(r, r));
      };
      const double there = curve.arc_at(found), own = distance(there);
      for (int i = -200; i <= 200; ++i) {
        const double near = std::clamp(there + 1e-4 * i * curve.whole, 0.0, curve.whole);
        EXPECT_LE(own, distance(near) + 1e-14) << c.name;
      }
      EXPECT_NEAR(curve.arc_between(start, found), there - at, 1e-14);
      const Vector3 way = to_eigen(way_between(curve, start, found, nodes)),
                    direct = to_eigen(point_at(curve, found, nodes, Vector3::Zero()).across -
                                      point_at(curve, start, nodes, Vector3::Zero()).across);
      EXPECT_LT((way - direct).norm(), 1e-14);
    }
  }
}

TEST(RodCurve, GoesRoundAClosedRodForEver) {
  SceneBuilder builder;
  testing::RodMaterial material;
  MatrixX3 circle(12, 3);
  for (int i = 0; i < 12; ++i) circle.row(i) << std::cos(testing::kPi * i / 6.0), std::sin(testing::kPi * i / 6.0), 0.0;
  builder.add_rod(circle, material, true, Vector3(0.0, 0.0, 1.0));
  builder.support(SupportKind::hand, {0, 0});
  HandDescription& hand = builder.scene.supports.back().hand;
  hand.yields = hand.slides = true;
  hand.stiffness = {3.0, 3.0, 3.0, 0.0, 0.0, 0.0};
  const Model model = build_model(builder.scene, std::nullopt);
  const RodCurve& curve = model.supports[0].curve;
  EXPECT_NEAR(curve.piece(-25).arc, curve.piece(11).arc - 3.0 * curve.whole, 1e-12);
  EXPECT_EQ(curve.piece(-25).node[1], curve.piece(11).node[1]);
  EXPECT_NEAR(curve.arc_between({-13, 0.5, false}, {14, 0.25, false}),
              curve.arc_at({14, 0.25, false}) - curve.arc_at({-13, 0.5, false}), 1e-12);
}

TEST(RingForces, MatrixIsTheDerivativeOfTheResidualUnderEveryRule) {
  for (bool planar : {false, true})
    for (Along along : {Along::nothing, Along::drive, Along::slipping_drive, Along::friction})
      for (StepRule rule : kRules)
        for (Case c : cases(planar, along)) {
          // Within the pieces that rings are on, where the matrix of an energy-momentum step is exact.
          if (rule == StepRule::energy_momentum) c.q = c.state.q + 3e-3 * RandomNumbers(8).vector(c.q.size());
          CaseResidual residual(c, rule);
          residual.move_hands(moved_rings(c));
          const MatrixX J = residual.matrix(c.q);
          EXPECT_TRUE(derivative_matches([&](const VectorX& q) { return residual(q); }, c.q, J, 0.1 * c.increment))
              << c.name << ", rule " << static_cast<int>(rule) << ", along " << static_cast<int>(along);
        }
}

TEST(RingForces, ForcesAreThoseOfTheEnergyThatReadOutsHave) {
  for (bool planar : {false, true})
    for (Along along : {Along::nothing, Along::drive})
      for (const Case& c : cases(planar, along)) expect_forces_of_energy(c, 0.1 * c.increment);
}

TEST(RingForces, WrenchIsWhatTheRodFeels) {
  for (bool planar : {false, true})
    for (Along along : {Along::nothing, Along::slipping_drive, Along::friction})
      for (StepRule rule : {StepRule::backward_euler, StepRule::midpoint})
        for (const Case& c : cases(planar, along)) expect_wrench_is_felt(c, rule);
}

TEST(RingForces, EnergyMomentumStepsBalanceEnergyHoweverFarTheRodSlides) {
  for (bool planar : {false, true})
    for (Along along : {Along::nothing, Along::drive, Along::slipping_drive, Along::friction})
      for (double size : {1e-6, 1e-3, 0.05})
        for (Case c : cases(planar, along)) {
          const VectorX change = size * RandomNumbers(9).vector(c.q.size());
          c.q = c.state.q + 0.5 * change;
          CaseResidual with(c, StepRule::energy_momentum);
          const std::vector<SupportPose> poses = moved_rings(c);
          with.move_hands(poses);
          const Case without = bare(c);
          CaseResidual rest(without, StepRule::energy_momentum);
          const VectorX forces = with(c.q) - rest(c.q), q1 = c.state.q + change;
          // Angles of a step are not those that work; rings act on nodes alone.
          double work = 0.0;
          for (int node = 0; node < c.model.node_count; ++node)
            work += node_vector(c.model, forces, node).dot(node_vector(c.model, change, node));
          Configuration configuration;
          const auto energy = [&](const State& at) {
            compute_configuration(c.model, at, at.q, configuration);
            return hand_energy(c.model, with.parameters.measure, at, configuration);
          };
          State after = c.state;
          after.q = q1;
          const RingForces& rings = with.with.hands()->rings();
          const double lost = rings.dissipated(with.with.problem(), c.q), done = rings.work(with.with.problem(), q1);
          const double before = energy(c.state);
          compute_configuration(c.model, after, q1, configuration);
          with.with.hands()->accept(poses, configuration, after);
          EXPECT_NEAR(energy(after) - before + lost, done + work, 1e-14 + 1e-12 * std::abs(work))
              << c.name << ", along " << static_cast<int>(along) << ", size " << size;
        }
}

}  // namespace
}  // namespace withe
