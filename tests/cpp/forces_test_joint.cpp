// Torques of revolute joints: what they work, and their derivatives.

#include "forces/joint.hpp"

#include <gtest/gtest.h>

namespace withe {
namespace {

TEST(JointTorque, ShareOfTurnsMakesWorkThatOfAngles) {
  for (double x : {-1.3, -0.2, 0.0, 1e-7, 0.4, 1.5})
    for (double y : {-1.1, 0.0, 1e-7, 3e-3, 0.4, 1.2}) {
      const double along = 2.0 * std::tan(0.5 * x) - 2.0 * std::tan(0.5 * y);
      EXPECT_NEAR(share_of_turns(x, y) * along, x - y, 1e-14) << x << ", " << y;
    }
}

TEST(JointTorque, ShareOfTurnsHasItsDerivatives) {
  constexpr double kStep = 1e-5;
  for (double x : {-1.3, 0.0, 0.4})
    for (double y : {-1.1, 0.0, 0.395, 0.4, 1.2}) {
      const Dual<2> share = share_of_turns(Dual<2>::unknown(x, 0), Dual<2>::unknown(y, 1));
      EXPECT_NEAR(share.value, share_of_turns(x, y), 1e-15);
      EXPECT_NEAR(share.slope[0], (share_of_turns(x + kStep, y) - share_of_turns(x - kStep, y)) / (2.0 * kStep), 1e-8);
      EXPECT_NEAR(share.slope[1], (share_of_turns(x, y + kStep) - share_of_turns(x, y - kStep)) / (2.0 * kStep), 1e-8);
    }
}

TEST(JointTorque, InTheMiddleOfAStepWorksWhatTheSpringLosesLessWhatTheDamperTakes) {
  const JointTorque joint{.stiffness = 3.0, .rest_angle = 0.4, .damping = 0.7};
  constexpr double kStart = -0.3, kEnd = 1.9, kDuration = 0.2;
  const double turned = kEnd - kStart, rate = turned / kDuration;
  const double work = torque_of(joint, 0.5 * (kStart + kEnd), rate) * turned;
  EXPECT_NEAR(work, joint.energy(kStart) - joint.energy(kEnd) - joint.damping * rate * turned, 1e-13);
}

}  // namespace
}  // namespace withe
