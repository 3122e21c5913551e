#include "components/simulated_drive/motor.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace phantom::simulated_drive {
namespace {

constexpr double kDt = 0.00025;

TEST(Motor, AHandSwingsTheJointToAndFroAndGivesWay) {
  MotorParameters parameters;
  parameters.joint = {.inertia = 0.05, .viscous = 0.02, .coulomb = 0.03, .lower = -3.0, .upper = 3.0};
  parameters.start_rad = 0.4;
  parameters.hand = {.swing_rad = 0.25, .period_s = 4.0};
  Motor free(parameters), held(parameters);
  double lowest = 1e9, highest = -1e9;
  for (int i = 0; i < 32000; ++i) {
    free.step(0.0, kDt);
    lowest = std::min(lowest, free.joint_rad());
    highest = std::max(highest, free.joint_rad());
    // A drive that holds with a stiff spring: the hand is compliant and does not force it.
    const double torque_Nm = -2000.0 * (held.joint_rad() - 0.4) - 20.0 * held.joint_rad_s();
    held.step(torque_Nm / (1e-3 * parameters.rated_torque_Nm * parameters.gear_ratio), kDt);
  }
  EXPECT_NEAR(highest, 0.65, 0.01);
  EXPECT_NEAR(lowest, 0.15, 0.01);
  EXPECT_NEAR(held.joint_rad(), 0.4, 0.02);
}

TEST(Motor, WithoutAHandAFreeJointStays) {
  Motor motor({.start_rad = 0.4});
  for (int i = 0; i < 4000; ++i) motor.step(0.0, kDt);
  EXPECT_EQ(motor.joint_rad(), 0.4);
}

}  // namespace
}  // namespace phantom::simulated_drive
