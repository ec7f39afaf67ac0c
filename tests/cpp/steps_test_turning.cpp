// Derivatives of the inertia of an edge about itself, written by hand, against those of its formula on dual numbers.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Geometry>

#include "steps/turning_inertia.hpp"
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

}  // namespace
}  // namespace withe
