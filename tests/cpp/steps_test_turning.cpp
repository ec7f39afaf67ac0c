// Derivatives of the inertia of an edge about itself, written by hand, against those of its formula on dual numbers.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Geometry>

#include "steps/turning_inertia.hpp"
#include "steps/turning_kernels.hpp"
#include "steps/turning_slopes.hpp"

namespace withe {
namespace {

using ByEdge = Dual<TurningSlopes::kUnknowns>;

TurningForce<ByEdge> force_on_duals(const TurningStep& step, const Vector3& across) {
  const auto vector = [](const Vec3d& v, int first) -> Vec3<ByEdge> {
    return {ByEdge::unknown(v.x, first), ByEdge::unknown(v.y, first + 1), ByEdge::unknown(v.z, first + 2)};
  };
  const Vec3<ByEdge> e = vector(step.edge, 0), e0 = vector(step.start, 4), e1 = ByEdge(2.0) * e - e0;
  const ByEdge length = sqrt(dot(e, e)), length0 = sqrt(dot(e0, e0)), length1 = sqrt(dot(e1, e1));
  const Vec3<ByEdge> source = (1.0 / length0) * e0;
  const EdgeFrame<ByEdge> f =
      edge_frame<ByEdge>(e, length, source, {across.x(), across.y(), across.z()}, ByEdge(1.0), ByEdge(0.0));
  const TurningEdge<ByEdge> edge{.tangent = f.tangent,
                                 .spin = f.spin,
                                 .inverse_length = f.inverse_length,
                                 .start_tangent = source,
                                 .end_tangent = (1.0 / length1) * e1,
                                 .start_length = length0,
                                 .end_length = length1,
                                 .change = ByEdge::unknown(step.change, 3) - ByEdge::unknown(0.0, 7),
                                 .start_rate = ByEdge::unknown(step.rate, 8)};
  if (step.rule == StepRule::backward_euler) return euler_turning<ByEdge>(step.inertia, step.duration, edge, e - e0);
  return midpoint_turning<ByEdge>(step.inertia, step.duration, step.rule == StepRule::energy_momentum, edge);
}

TEST(TurningSlopes, AreThoseOfDualNumbersAtRandomSteps) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  const auto vector = [&] { return Vector3(number(random), number(random), number(random)); };
  for (int i = 0; i < 300; ++i)
    for (const StepRule rule : {StepRule::backward_euler, StepRule::midpoint, StepRule::energy_momentum}) {
      const double duration = 0.3 + 0.2 * number(random);
      const Vector3 edge = vector(), start = edge + 0.3 * edge.norm() * vector();
      const TurningStep step{rule, duration, 1.3, to_vec3(edge), to_vec3(start), 0.7 * number(random), number(random)};
      const TurningForce<ByEdge> force = force_on_duals(step, start.unitOrthogonal());
      TurningSlopes found;
      set_turning_slopes(step, found);
      double greatest = 0.0, off = 0.0;
      for (int k = 0; k < TurningSlopes::kUnknowns; ++k)
        for (int row = 0; row < 4; ++row) {
          const double expected = row < 3 ? force.head[row].slope[k] : force.torque.slope[k];
          greatest = std::max(greatest, std::abs(expected));
          off = std::max(off, std::abs(found.by[row][k] - expected));
        }
      EXPECT_LT(off, 1e-13 * greatest) << "rule " << static_cast<int>(rule);
    }
}

/// Edges at random, as kernels want them: nodes and an angle of its own for each.
struct DrawnEdges {
  int count;
  std::vector<int> tail, head, angle;
  std::vector<double> z, start_q, start_v, inertia, start_length, end_length, force, torque;
  std::vector<EdgeFrame<double>> frames, end_frames;
  std::vector<Vec3d> start_tangent;

  DrawnEdges(int edges, std::mt19937& random) : count(edges), force(3 * at(edges)), torque(at(edges)) {
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    for (int e = 0; e < edges; ++e) {
      tail.push_back(7 * e);
      head.push_back(7 * e + 3);
      angle.push_back(7 * e + 6);
      inertia.push_back(1.5 + number(random));
      for (int i = 0; i < 7; ++i) {
        start_q.push_back(number(random));
        z.push_back(start_q.back() + 0.1 * number(random));
        start_v.push_back(number(random));
      }
      const auto frame = [&](double share) {
        const auto apart = [&](int i) { return along(share, 7 * e + 3 + i) - along(share, 7 * e + i); };
        const Vec3d vector{apart(0), apart(1), apart(2)};
        const Vec3d source = e0(e);
        const double length = std::sqrt(dot(vector, vector)), from = std::sqrt(dot(source, source));
        const Vec3d t0 = (1.0 / from) * source, across = to_vec3(to_eigen(t0).unitOrthogonal());
        return edge_frame<double>(vector, length, t0, across, 1.0, 0.0);
      };
      frames.push_back(frame(1.0));
      end_frames.push_back(frame(2.0));
      start_tangent.push_back(frame(0.0).tangent);
      start_length.push_back(1.0 / frame(0.0).inverse_length);
      end_length.push_back(1.0 / frame(2.0).inverse_length);
    }
  }

  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  double along(double share, int i) const { return (1.0 - share) * start_q[at(i)] + share * z[at(i)]; }
  Vec3d e0(int e) const {
    return {start_q[at(7 * e + 3)] - start_q[at(7 * e)], start_q[at(7 * e + 4)] - start_q[at(7 * e + 1)],
            start_q[at(7 * e + 5)] - start_q[at(7 * e + 2)]};
  }
  Vec3d e1(int e) const { return (1.0 / frames[at(e)].inverse_length) * frames[at(e)].tangent; }

  TurningBatch batch(double interval) {
    return {.count = count,
            .tail = tail.data(),
            .head = head.data(),
            .angle = angle.data(),
            .z = z.data(),
            .start_q = start_q.data(),
            .start_v = start_v.data(),
            .interval = interval,
            .inertia = inertia.data(),
            .frames = &frames.data()->tangent.x,
            .start_tangent = &start_tangent.data()->x,
            .start_length = start_length.data(),
            .end_length = end_length.data(),
            .end_frames = &end_frames.data()->tangent.x,
            .force = force.data(),
            .torque = torque.data()};
  }
  TurningEdge<double> edge(int e) const {
    const int theta = 7 * e + 6;
    return {.tangent = frames[at(e)].tangent,
            .spin = frames[at(e)].spin,
            .inverse_length = frames[at(e)].inverse_length,
            .start_tangent = start_tangent[at(e)],
            .end_tangent = end_frames[at(e)].tangent,
            .start_length = start_length[at(e)],
            .end_length = end_length[at(e)],
            .change = z[at(theta)] - start_q[at(theta)],
            .start_rate = start_v[at(theta)]};
  }
};

TEST(TurningKernels, AreTheFormulasOnDoublesForAnyNumberOfEdges) {
  std::mt19937 random(7);
  constexpr double kInterval = 0.2;
  for (int count = 1; count <= 9; ++count)
    for (const StepRule rule : {StepRule::backward_euler, StepRule::midpoint, StepRule::energy_momentum}) {
      DrawnEdges edges(count, random);
      const TurningKernels& kernels = turning_kernels();
      const bool conserves = rule == StepRule::energy_momentum;
      (rule == StepRule::backward_euler ? kernels.euler
       : conserves                      ? kernels.energy_momentum
                                        : kernels.midpoint)(edges.batch(kInterval));
      for (int e = 0; e < count; ++e) {
        const double inertia = edges.inertia[edges.at(e)];
        const TurningForce<double> expected =
            rule == StepRule::backward_euler
                ? euler_turning(inertia, kInterval, edges.edge(e), edges.e1(e) - edges.e0(e))
                : midpoint_turning(inertia, 2.0 * kInterval, conserves, edges.edge(e));
        const double size = std::abs(expected.torque) + std::sqrt(dot(expected.head, expected.head));
        EXPECT_NEAR(edges.torque[edges.at(e)], expected.torque, 1e-13 * size);
        for (int i = 0; i < 3; ++i)
          EXPECT_NEAR(edges.force[edges.at(3 * e + i)], expected.head[i], 1e-13 * size)
              << "edge " << e << " of " << count;
      }
    }
}

TEST(TurningKernels, FiniteTurnsAreThoseOfDoubles) {
  const std::vector<double> change{0.0, 1e-9, -0.3, 1.5, -2.9, 3.1};
  const std::vector<int> place{5, 4, 3, 2, 1, 0, 2};
  std::vector<double> turn(place.size());
  turning_kernels().finite_turns(static_cast<int>(place.size()), place.data(), change.data(), turn.data());
  for (std::size_t i = 0; i < place.size(); ++i) {
    const double expected = finite_turn(change[static_cast<std::size_t>(place[i])]);
    EXPECT_NEAR(turn[i], expected, 1e-13 * std::max(1.0, expected * expected));
  }
}

}  // namespace
}  // namespace withe
