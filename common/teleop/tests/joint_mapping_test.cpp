#include "common/teleop/coupling/joint_mapping.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace {

// Two joints of a joystick on five of a robot: the first on a slide, the second backwards on a hinge.
JointMappingParameters joystick() {
  JointMappingParameters parameters{.master_joints = 2, .arm_joints = 5, .led = {}};
  parameters.led[0] = {.arm_joint = 0, .ratio = 0.13, .at_zero = 0.36};
  parameters.led[1] = {.arm_joint = 3, .ratio = -0.5, .at_zero = 0.2};
  return parameters;
}

core::JointArray random_values(std::mt19937& random) {
  core::JointArray values{};
  std::uniform_real_distribution<double> any(-3.0, 3.0);
  for (double& value : values) value = any(random);
  return values;
}

TEST(JointMapping, LedJointsFollowByRatioAndTheOthersStandWhereTheyAreHeld) {
  const JointMapping mapping(joystick());
  const core::JointArray others{9.0, 0.1, 0.4, 9.0, 1.2};
  const auto q = mapping.arm_position({1.0, 2.0}, others);
  EXPECT_DOUBLE_EQ(q[0], 0.49);
  EXPECT_DOUBLE_EQ(q[3], -0.8);
  for (const std::size_t j : {1U, 2U, 4U}) {
    EXPECT_EQ(q[j], others[j]);
    EXPECT_FALSE(mapping.leads(j));
  }
  const auto v = mapping.arm_velocity({2.0, 0.4});
  EXPECT_EQ(v, (core::JointArray{0.26, 0.0, 0.0, -0.2}));
  const auto back = mapping.master_position(q);
  EXPECT_DOUBLE_EQ(back[0], 1.0);
  EXPECT_DOUBLE_EQ(back[1], 2.0);
}

TEST(JointMapping, TorqueComesBackByTheSameRatioSoThatPowerIsPower) {
  const JointMapping mapping(joystick());
  std::mt19937 random(5);
  for (int i = 0; i < 1000; ++i) {
    const auto torque = random_values(random), v_master = random_values(random);
    const auto v = mapping.arm_velocity(v_master), at_master = mapping.master_torque(torque);
    double arm_W = 0.0, master_W = 0.0;
    for (std::size_t j = 0; j < v.size(); ++j) {
      arm_W += torque[j] * v[j];
      master_W += at_master[j] * v_master[j];
    }
    EXPECT_NEAR(master_W, arm_W, 1e-12);
    EXPECT_EQ(at_master[2], 0.0) << "a joint that the master does not have";
  }
}

TEST(JointMapping, NothingOfJointsThatAreNotLedComesBack) {
  const JointMapping mapping(joystick());
  EXPECT_EQ(mapping.master_torque({0.0, 5.0, -7.0, 0.0, 3.0}), core::JointArray{});
  core::JointArray values{1.0, 2.0, 3.0, 4.0, 5.0};
  mapping.keep_led(values);
  EXPECT_EQ(values, (core::JointArray{1.0, 0.0, 0.0, 4.0, 0.0}));
}

TEST(JointMapping, AllocatesNothing) {
  const JointMapping mapping(joystick());
  core::JointArray torque{};
  {
    const test::HeapGuard guard;
    core::JointArray q = mapping.arm_position({0.1, 0.2}, {});
    mapping.keep_led(q);
    torque = mapping.master_torque(mapping.arm_velocity(mapping.master_position(q)));
  }
  EXPECT_DOUBLE_EQ(torque[1], 0.25 * 0.2);
}

}  // namespace
}  // namespace phantom::teleop
