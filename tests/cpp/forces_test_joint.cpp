// Torques of revolute joints: what they work, and their derivatives.

#include "forces/joint.hpp"

#include <type_traits>

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

TEST(JointTorque, SaturatedServoWorksWhatItsEnergyLoses) {
  const JointTorque joint{.stiffness = 3.0, .rest_angle = 0.4, .max_torque = 0.6};
  for (double from = -1.0; from < 1.5; from += 0.17)
    for (double to = -1.1; to < 1.5; to += 0.13) {
      const JointChange<double> change{0.5 * (from + to), 0.0, from, to, 0.0};
      const double torque = torque_of(joint, change);
      EXPECT_LE(std::abs(torque), 0.6 * (1.0 + 1e-15));
      EXPECT_NEAR(torque * (to - from), joint.energy(from) - joint.energy(to), 4e-15) << from << ", " << to;
    }
}

TEST(JointTorque, SaturatedServoHasItsDerivatives) {
  constexpr double kStep = 1e-6;
  const JointTorque joint{.stiffness = 3.0, .rest_angle = 0.4, .max_torque = 0.6};
  const auto torque = [&](const auto& from, const auto& to) {
    using Scalar = std::decay_t<decltype(from)>;
    return torque_of(joint, JointChange<Scalar>{Scalar(0.5 * (from + to)), Scalar(0.0), from, to, 0.0});
  };
  for (double from : {-0.7, 0.25, 0.37, 0.9})
    for (double to : {-0.6, 0.31, 0.45, 1.1}) {
      const Dual<2> exact = torque(Dual<2>::unknown(from, 0), Dual<2>::unknown(to, 1));
      EXPECT_NEAR(exact.slope[0], (torque(from + kStep, to) - torque(from - kStep, to)) / (2.0 * kStep), 1e-8);
      EXPECT_NEAR(exact.slope[1], (torque(from, to + kStep) - torque(from, to - kStep)) / (2.0 * kStep), 1e-8);
    }
}

TEST(JointTorque, StopsPushMoreOnTheWayInAndNeverPull) {
  const JointStops stops{.low = -1.0, .high = 1.0, .stiffness = 10.0, .restitution = 0.5, .impact_loss = 0.8};
  EXPECT_DOUBLE_EQ(impact_factor(stops, 2.0, 2.0), 1.8);
  EXPECT_DOUBLE_EQ(impact_factor(stops, -1.0, 2.0), 0.6);
  EXPECT_EQ(impact_factor(stops, -4.0, 2.0), 0.0);
  EXPECT_EQ(impact_factor(stops, 0.0, 0.0), 1.0);
}

}  // namespace
}  // namespace withe
