#include "components/simulated_drive/motor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "common/core/errors.hpp"
#include "components/simulated_drive/config.hpp"
#include "tests/support/files.hpp"

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

TEST(Motor, AWallPushesBackFromEitherSideAndNeverPulls) {
  for (const double side : {1.0, -1.0}) {
    MotorParameters parameters;
    parameters.start_rad = 0.4;
    parameters.joint = {.inertia = 0.05, .viscous = 0.0, .coulomb = 0.0, .lower = -100.0, .upper = 100.0};
    parameters.wall = {
        .at_rad = 0.4 + side * 0.2, .stiffness_Nm_per_rad = 2000.0, .damping_Nms_per_rad = 5.0};
    Motor pressing(parameters), thrown(parameters);
    const double push_mille = side * 2000.0;  // 10 N·m
    for (int i = 0; i < 8000; ++i) {
      pressing.step(push_mille, kDt);
      EXPECT_LE(side * pressing.wall_torque_Nm(), 0.0);
    }
    EXPECT_NEAR(side * pressing.wall_torque_Nm(), -10.0, 1e-6);
    EXPECT_NEAR(side * (pressing.joint_rad() - parameters.wall.at_rad), 10.0 / 2000.0, 1e-9);
    double fastest = 0.0;
    for (int i = 0; i < 8000; ++i) {
      thrown.step(i < 400 ? push_mille : 0.0, kDt);
      const double away = -side * thrown.joint_rad_s();
      fastest = std::max(fastest, -away);
      EXPECT_LT(away, fastest) << "it loses energy in the wall";
    }
    EXPECT_LT(side * thrown.joint_rad_s(), 0.0);
    EXPECT_EQ(thrown.wall_torque_Nm(), 0.0);
  }
}

TEST(Motor, WithoutAHandAFreeJointStays) {
  Motor motor({.start_rad = 0.4});
  for (int i = 0; i < 4000; ++i) motor.step(0.0, kDt);
  EXPECT_EQ(motor.joint_rad(), 0.4);
}

// What load_config says of the shipped file with this wall.
std::string problem_of_wall(const std::string& wall) {
  const auto file = test::changed(PHANTOM_SOURCE_DIR "/components/simulated_drive/simulated_drive.yaml",
                                  "    start_rad: 0 ", "    wall: {" + wall + "}\n    start_rad: 0 ");
  try {
    const Config config = load_config(file);
    return std::to_string(config.drives[0].motor.wall.at_rad);
  } catch (const core::ConfigError& error) {
    return error.what();
  }
}

TEST(DriveConfig, AWallThatCouldNotBeIsRefused) {
  EXPECT_EQ(problem_of_wall("at_rad: -0.3, stiffness_Nm_per_rad: 2000"), "-0.300000");
  EXPECT_THAT(problem_of_wall("at_rad: 0, stiffness_Nm_per_rad: 2000"),
              testing::HasSubstr("drives[0].wall.at_rad: '0' is start_rad; allowed: a place beside it"));
  EXPECT_THAT(problem_of_wall("at_rad: 0.3, stiffness_Nm_per_rad: 9e6"),
              testing::HasSubstr("is too much for the joint's inertia; allowed: up to 8000000"));
  EXPECT_THAT(problem_of_wall("at_rad: 0.3, stiffness_Nm_per_rad: 9, damping_Nms_per_rad: 3000"),
              testing::HasSubstr("damping_Nms_per_rad: '3000' is too much"));
}

}  // namespace
}  // namespace phantom::simulated_drive
