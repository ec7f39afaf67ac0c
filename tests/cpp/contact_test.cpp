// Touching pairs, against brute force. The oracles:
//   - closest points: the least of |p - q|^2 plus the small weights over a fine grid of both parameters;
//   - overlaps of boxes: every pair, one by one;
//   - what touches, and how far an iterate may go: every pair of edges, along the way too, without memory of others.
// Invariants: the distance is symmetric in its segments and its gradient continuous across classes and at parallel
// segments; each law's derivatives are those of its energy.

#include "contact/contact.hpp"

#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "contact/contact_law.hpp"
#include "contact/pressing.hpp"
#include "derivative_check.hpp"
#include "scenes.hpp"

namespace withe {
namespace {

using testing::RandomNumbers;

Vec3d random_point(RandomNumbers& random) {
  const Vector3 v = random.vector();
  return {v.x(), v.y(), v.z()};
}

double weighted_square(const Vec3d (&x)[4], double s, double t, double A, double B) {
  const Vec3d d = x[0] + s * (x[1] - x[0]) - x[2] - t * (x[3] - x[2]);
  return dot(d, d) + A * (s - 0.5) * (s - 0.5) + B * (t - 0.5) * (t - 0.5);
}

TEST(SegmentDistance, IsTheLeastOverBothSegments) {
  RandomNumbers random(3);
  for (int k = 0; k < 300; ++k) {
    Vec3d x[4] = {random_point(random), random_point(random), random_point(random), random_point(random)};
    if (k % 3 == 0) x[3] = x[2] + x[1] - x[0];  // parallel
    if (k % 7 == 0) x[3] = x[2];                // a point
    const double A = 1e-3, B = 2e-3;
    const ClosestPoints p = closest_points(x[0], x[1], x[2], x[3], A, B);
    EXPECT_NEAR(p.square, weighted_square(x, p.s, p.t, A, B), 1e-12);
    const int n = 60;
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j)
        ASSERT_LE(p.square, weighted_square(x, i / double(n), j / double(n), A, B) + 1e-12) << "case " << k;
  }
}

TEST(SegmentDistance, GradientIsContinuousThroughParallel) {
  const Vec3d a0{-0.5, 0, 0}, a1{0.5, 0, 0};
  Vec3d last{};
  for (int k = -20; k <= 20; ++k) {
    const double turn = 1e-3 * k;
    const Vec3d b0{-0.4, -0.4 * turn, 0.2}, b1{0.6, 0.6 * turn, 0.2};
    const ClosestPoints p = closest_points(a0, a1, b0, b1, 1e-3, 1e-3);
    double w[4];
    end_weights(p.s, p.t, w);
    const Vec3d g = w[0] * p.between;
    if (k > -20) {
      const Vec3d step = g - last;
      EXPECT_LT(std::sqrt(dot(step, step)), 0.02 * 0.2) << "turned by " << turn;
    }
    last = g;
  }
}

TEST(ContactLaw, DerivativesAreThoseOfTheEnergy) {
  const double radii = 1.0, tolerance = 0.1;
  for (ContactLaw law : {ContactLaw::imcv2, ContactLaw::barrier, ContactLaw::imcv1, ContactLaw::spillmann_teschner})
    for (double distance : {0.5, 0.89, 0.91, 0.97, 1.0, 1.003, 1.02, 1.05, 1.09}) {
      if (law == ContactLaw::barrier && distance <= 1.001) continue;
      if (law == ContactLaw::spillmann_teschner && distance >= 1.0) continue;
      const ContactEnergy e = contact_energy(law, distance, radii, tolerance);
      const auto value = [&](const VectorX& x) { return contact_energy(law, x(0), radii, tolerance).value; };
      const auto slope = [&](const VectorX& x) {
        return VectorX::Constant(1, contact_energy(law, x(0), radii, tolerance).first);
      };
      const double h = distance < 1.01 ? 3e-4 : 5e-4;
      EXPECT_TRUE(testing::gradient_matches(value, VectorX::Constant(1, distance), VectorX::Constant(1, e.first), h))
          << "law " << static_cast<int>(law) << ", distance " << distance;
      EXPECT_TRUE(testing::derivative_matches(slope, VectorX::Constant(1, distance),
                                              Eigen::MatrixXd::Constant(1, 1, e.second), h))
          << "law " << static_cast<int>(law) << ", distance " << distance;
    }
}

TEST(ContactLaw, IsNothingBeyondItsReach) {
  for (ContactLaw law : {ContactLaw::imcv2, ContactLaw::barrier, ContactLaw::imcv1})
    EXPECT_EQ(contact_energy(law, 1.1 + 1e-12, 1.0, 0.1).value, 0.0);
  EXPECT_EQ(contact_energy(ContactLaw::spillmann_teschner, 1.0, 1.0, 0.1).value, 0.0);
}

TEST(ContactLaw, BeginsWithoutAStepInEnergyOrForce) {
  const double tolerance = 0.1;
  for (ContactLaw law : {ContactLaw::imcv2, ContactLaw::barrier, ContactLaw::imcv1, ContactLaw::spillmann_teschner}) {
    const double reach = law == ContactLaw::spillmann_teschner ? 1.0 : 1.0 + tolerance;
    const ContactEnergy e = contact_energy(law, reach - 1e-9, 1.0, tolerance);
    EXPECT_NEAR(e.value, 0.0, 1e-15) << "law " << static_cast<int>(law);
    EXPECT_NEAR(e.first, 0.0, 3e-8) << "law " << static_cast<int>(law);
  }
}

/// [Choi, dissertation, (4.16)]: in lengths of h, with K1 = 50, h = 1 and C = 2.
TEST(ContactLaw, Imcv1IsThatOfTheSource) {
  const double h = 1.6e-3, tolerance = 0.3 * h;
  for (double depth : {-0.02, 0.0, 0.02, 0.1}) {
    const double source = std::log1p(std::exp(50.0 * depth)) / 50.0;
    EXPECT_NEAR(contact_energy(ContactLaw::imcv1, (2.0 - depth) * h, 2.0 * h, tolerance).value, source * h * h,
                2e-5 * source * h * h);  // the tangent at its end
  }
}

TEST(BroadPhase, FindsTheOverlapsThatBruteForceFinds) {
  RandomNumbers random(9);
  BroadPhase broad_phase;
  for (int round = 0; round < 60; ++round) {
    std::vector<Box> boxes;
    const double spread = round % 3 == 0 ? 0.3 : 3.0;
    for (int i = 0; i < 120; ++i) {
      const Vec3d at = spread * random_point(random);
      const double size = round % 4 == 0 && i % 10 == 0 ? 3.0 : 0.3;
      boxes.push_back(Box::around(at, at + size * random_point(random), 0.05));
    }
    std::set<std::pair<int, int>> expected, found;
    for (int i = 0; i < 120; ++i)
      for (int j = i + 1; j < 120; ++j)
        if (boxes[static_cast<std::size_t>(i)].overlaps(boxes[static_cast<std::size_t>(j)])) expected.insert({i, j});
    const std::vector<BroadPhase::Pair>& pairs = broad_phase.find(boxes);
    for (const BroadPhase::Pair& p : pairs) found.insert({p.a, p.b});
    EXPECT_EQ(found, expected);
    EXPECT_EQ(pairs.size(), found.size()) << "a pair came twice";
  }
}

/// A rod with a surface, closed or not.
SceneDescription tube(const MatrixX3& points, bool closed, double radius) {
  testing::SceneBuilder builder;
  builder.add_rod(points, {}, closed);
  RodDescription& rod = builder.scene.rods.back();
  rod.contact_radius.setConstant(rod.rest_lengths.size(), radius);
  builder.scene.contact.rods = true;
  return builder.scene;
}

TEST(Surfaces, NeighboursAlongTheRodDoNotTouchHoweverFineItIs) {
  for (int nodes : {11, 41, 161}) {
    const double radius = 0.1, length = 4.0;
    const Model model =
        build_model(tube(testing::line(Vector3::Zero(), Vector3(length, 0, 0), nodes), false, radius), std::nullopt);
    const Surfaces surfaces(model);
    const double limit = 0.5 * testing::kPi * 2.1 * radius, edge = length / (nodes - 1);
    for (int other = 1; other < nodes - 1; ++other) {
      const double between = (other - 1) * edge;  // of the nearest ends of edges 0 and `other`
      EXPECT_EQ(surfaces.may_touch(0, other), between >= limit) << nodes << " nodes, edge " << other;
    }
  }
}

TEST(Surfaces, NeighboursAreCountedRoundAClosedRod) {
  const Model model = build_model(tube(testing::ring(40, 1.0, 0.0), true, 0.1), std::nullopt);
  const Surfaces surfaces(model);
  EXPECT_FALSE(surfaces.may_touch(0, 39));
  EXPECT_FALSE(surfaces.may_touch(0, 38));
  EXPECT_TRUE(surfaces.may_touch(0, 20));
}

/// Three rods and a ball, near each other.
SceneDescription tangle(RandomNumbers& random) {
  testing::SceneBuilder builder;
  for (int rod = 0; rod < 3; ++rod) {
    MatrixX3 points = testing::line(Vector3::Zero(), Vector3(1.2, 0, 0), 9);
    const Vector3 shift = 0.3 * random.vector();
    for (Eigen::Index i = 0; i < points.rows(); ++i) points.row(i) += (shift + 0.05 * random.vector()).transpose();
    builder.add_rod(points);
    builder.scene.rods.back().contact_radius.setConstant(8, rod == 0 ? 0.03 : 0.05);
  }
  builder.scene.contact.rods = true;
  ObstacleDescription ball;
  ball.kind = ObstacleKind::capsule;
  ball.point = ball.other = Vector3(0.5, -0.4, 0.1);
  ball.radius = 0.2;
  builder.scene.contact.obstacles.push_back(ball);
  builder.scene.contact.obstacle_friction = MatrixX3::Zero(1, 3);
  builder.scene.contact.obstacle_restitution = VectorX::Ones(1);
  return builder.scene;
}

/// Every pair of surfaces of a scene.
std::vector<ContactPair> all_pairs(const Model& model, const Surfaces& surfaces) {
  std::vector<ContactPair> pairs = surfaces.obstacle_pairs();
  for (int a = 0; a < model.edge_count; ++a)
    for (int b = a + 1; b < model.edge_count; ++b)
      if (surfaces.may_touch(a, b)) pairs.push_back(surfaces.pair(a, b));
  return pairs;
}

/// D; and how far centrelines are apart, as a curve's is.
struct Apart {
  double distance, centrelines;
};

ClosestPoints closest(const Bodies& bodies, const ContactPair& pair, const VectorX& q) {
  Vec3d x[4];
  bodies.end_points(pair, q, x);
  return closest_points(x[0], x[1], x[2], x[3], pair.weight_a, pair.weight_b);
}

Apart apart(const Bodies& bodies, const ContactPair& pair, const VectorX& q) {
  if (pair.curve()) {
    Vec3d x[3];
    for (int i = 0; i < pair.piece.weights->nodes; ++i) x[i] = local_position(*bodies.model, q, pair.piece.node[i]);
    const double d = curve_distance(pair.piece, bodies.obstacle(pair), x).distance;
    return {d, d};
  }
  const ClosestPoints c = closest(bodies, pair, q);
  return {std::sqrt(c.square), std::sqrt(dot(c.between, c.between))};
}

/// Candidates that have seen much, and the same without memory.
struct Walk {
  const Model& model;
  Surfaces surfaces{model};
  Candidates candidates{model, surfaces};
  Bodies bodies{&model, surfaces.obstacles()};
  std::vector<ContactPair> pairs = all_pairs(model, surfaces);
  VectorX q = initial_state(model).q;
  int cut = 0, touching = 0;

  double allowed(const VectorX& change) {
    const double kept = candidates.allowed(q, bodies, change);
    EXPECT_EQ(kept, Candidates(model, surfaces).allowed(q, bodies, change));
    cut += kept < 1.0 ? 1 : 0;
    return kept;
  }

  /// An iterate is shortened where surfaces come near, or after a hundred steps past surfaces that stay apart. By then
  /// the approach of two bodies is at most a hundred times their initial distance beyond the least distance.
  void expect_nothing_passes(const VectorX& change, double kept) const {
    const auto distance = [&](const ContactPair& pair, double share) {
      return apart(bodies, pair, q + share * change).centrelines;
    };
    const double past = 0.02 * kept * 2.0 * farthest(model, change);  // seen at a hundred points
    bool reached = kept == 1.0;
    for (const ContactPair& pair : pairs) {
      const double least = std::min(kMinDistance * distance(pair, 0.0), pair.nearest());
      double nearest = INFINITY;
      for (int k = 1; k <= (kept < 1.0 ? 100 : 20); ++k)
        nearest = std::min(nearest, distance(pair, kept * k / (kept < 1.0 ? 100.0 : 20.0)));
      ASSERT_GE(nearest, 0.98 * least);
      reached = reached || nearest <= 1.01 * least + past;
    }
    EXPECT_TRUE(reached) << "cut to " << kept << " for nothing";
  }

  /// Also in one and the same order, and without a trace.
  void expect_found() {
    using Found = std::vector<std::pair<ContactKey, double>>;
    Found found, unseen, expected;
    const auto into = [](Found& out) {
      return [&out](const ContactPair& pair, const Proximity& p) { out.emplace_back(pair.key, p.distance); };
    };
    CandidateSearch search;
    std::as_const(candidates).find(q, bodies, search, into(unseen));
    candidates.find(q, bodies, into(found));
    for (const ContactPair& pair : pairs)
      if (const double d = apart(bodies, pair, q).distance; d < pair.reach()) expected.emplace_back(pair.key, d);
    EXPECT_EQ(found, expected);
    EXPECT_EQ(unseen, expected);
    touching += static_cast<int>(found.size());
  }
};

/// Walks of many iterates, tiny and wide, on which candidates are found anew and bounds let pairs be skipped, with
/// obstacles that move between them.
TEST(Candidates, FindWhatTouchesAndHowFarItMayGoAsBruteForceDoesWhateverCameBefore) {
  RandomNumbers random(17);
  int cut = 0, touching = 0;
  for (int scene = 0; scene < 12; ++scene) {
    const Model model = build_model(tangle(random), std::nullopt);
    Walk walk{model};
    for (int iterate = 0; iterate < 72; ++iterate) {
      const double wide = std::pow(10.0, -1.0 - 0.5 * ((iterate / 6 + iterate) % 6));
      if (iterate % 6 == 0 && scene % 2 == 1)
        for (Obstacle& o : walk.bodies.obstacles) {
          const Vec3d shift = 0.1 * random_point(random);
          o.point += shift;
          o.other += shift;
        }
      const VectorX change = wide * random.vector(model.dof_count);
      const double kept = walk.allowed(change);
      ASSERT_NO_FATAL_FAILURE(walk.expect_nothing_passes(change, kept));
      walk.q += kept * change;
      walk.expect_found();
      ASSERT_FALSE(::testing::Test::HasFailure());
    }
    cut += walk.cut;
    touching += walk.touching;
  }
  EXPECT_GT(cut, 100);
  EXPECT_GT(touching, 100);
}

/// Results that a step needs from contact, as bits.
std::vector<double> answers(Contact& contact, const VectorX& q, const VectorX& change) {
  std::vector<double> out{contact.allowed(q, change)};
  contact.update(q + out[0] * change);
  VectorX friction;
  contact.friction_force(friction);
  out.insert(out.end(), friction.begin(), friction.end());
  ContactLocal local{};
  ContactLinearisation linearisation;
  contact.predict_friction(1e-3 * change, linearisation);
  for (int i = 0; i < contact.count(); ++i) {
    contact.local(i, true, local, linearisation);
    out.insert(out.end(), std::begin(local.gradient), std::end(local.gradient));
    for (const auto& row : local.hessian) out.insert(out.end(), std::begin(row), std::end(row));
  }
  out.insert(out.end(), {contact.energy(), contact.start_energy(), contact.pressing_gain(change),
                         contact.obstacle_work(), contact.unresolved(1e-2) ? 1.0 : 0.0});
  return out;
}

/// Two of one scene take the same steps, and one of them is asked in between for contacts and energies of states.
TEST(Contact, ReadOutsChangeNoBitOfWhatFollows) {
  RandomNumbers random(23);
  int touching = 0;
  for (FrictionLaw law : {FrictionLaw::implicit, FrictionLaw::lagged, FrictionLaw::anchored})
    for (Pressing pressing : {Pressing::still, Pressing::end, Pressing::mean, Pressing::mean_direction}) {
      SceneDescription scene = tangle(random);
      scene.contact.friction = 0.4;
      scene.contact.restitution = 0.5;
      scene.contact.friction_law = law;
      scene.contact.obstacle_friction = MatrixX3::Constant(1, 3, 0.3);
      const Model model = build_model(scene, std::nullopt);
      const Parameters parameters = initial_parameters(model);
      State state = initial_state(model), other = state;
      Contact plain(model), asked(model);
      plain.initialise(state, parameters);
      other.contact_stiffness = state.contact_stiffness;
      ContactAtRest asked_before;
      const auto ask = [&] {
        other.q = state.q + 0.05 * random.vector(model.dof_count);
        const std::vector<ContactReport> reports = asked.report(other, parameters);
        touching += static_cast<int>(reports.size());
        ContactAtRest rest;
        EXPECT_EQ(asked.energy_of(other, parameters, asked_before), Contact(model).energy_of(other, parameters, rest));
      };
      for (int step = 0; step < 8; ++step) {
        state.v = random.vector(model.dof_count);
        State twin = state;
        ask();
        plain.begin(state, parameters, 1e-2, pressing);
        asked.begin(twin, parameters, 1e-2, pressing);
        for (int iterate = 0; iterate < 3; ++iterate) {
          const VectorX change = 0.03 * random.vector(model.dof_count);
          ask();
          ASSERT_EQ(answers(plain, state.q, change), answers(asked, twin.q, change));
        }
        ask();
        ASSERT_EQ(plain.near(), asked.near());
        ASSERT_EQ(plain.accept(state, 1.0), asked.accept(twin, 1.0));
        ASSERT_EQ(state.contact_stiffness, twin.contact_stiffness);
        ASSERT_EQ(state.contacts.size(), twin.contacts.size());
        for (std::size_t i = 0; i < state.contacts.size(); ++i) {
          ASSERT_EQ(state.contacts[i].stiffness, twin.contacts[i].stiffness);
          ASSERT_EQ(state.contacts[i].age, twin.contacts[i].age);
        }
        state.q = plain.contacts().q();
      }
    }
  EXPECT_GT(touching, 100);
}

/// Share of a distance by three heights, over a motion for which the directions at both ends do works that differ by
/// `apart`.
StartShare share_of(double apart, double nearer) {
  const double way[3] = {-1e-4, -2e-4, -1e-4}, first[3] = {0.1, 0.8, 0.1};
  const double last[3] = {0.1 + 1e-3, 0.8 - 0.5e-3 + 0.5e4 * apart, 0.1};
  double p = 0.0;
  for (int i = 0; i < 3; ++i) p += 0.5 * (first[i] + last[i]) * way[i];
  return start_share(first, last, way, p + nearer);
}

TEST(StartShare, DoesTheWorkOfTheDistanceWhereDirectionsDiffer) {
  for (double apart : {1e-6, 1e-5, -1e-5}) EXPECT_NEAR(share_of(apart, 0.2 * apart).value, 0.7, 2e-4);
}

TEST(StartShare, GoesFromOneEndToTheOtherWithoutAJump) {
  // A contact whose distance bends otherwise than in second order: without a, the share is 0 or 1 wherever |d| < 2 e.
  double before = share_of(-1e-6, 1e-10).value;
  for (double apart = -1e-6; apart <= 1e-6; apart += 1e-10) {
    const double now = share_of(apart, 1e-10).value;
    EXPECT_NEAR(now, before, 0.02) << apart;
    before = now;
  }
}

}  // namespace
}  // namespace withe
