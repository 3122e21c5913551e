#include "common/teleop/guards/contact_force_limit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/teleop/tests/period.hpp"

namespace phantom::teleop {
namespace in_contact_force_limit {
namespace {

constexpr double kBound_Nm = 20.0, kStiffness = 1000.0;  // N·m/rad of the position loop

ContactForceLimitParameters bounds(double tool_N = 0.0) {
  ContactForceLimitParameters p{.joint_count = 2, .tool_force_N = tool_N};
  p.torque_Nm = {kBound_Nm, kBound_Nm};
  p.yield_speed = {0.2, 0.2};
  return p;
}

/// A joint whose position loop presses on a rigid wall, in sense `way`; its torque is measured late.
struct Pressing {
  int way = 1;
  double wall_rad = 0.1, late_s = 0.02;
  ContactForceLimit limit{bounds()};
  core::JointArray reference{}, target{};
  double measured_Nm = 0.0;
  bool known = true;

  double torque_Nm() const {  // of the wall on the joint
    const double beyond = way * reference[0] - wall_rad;
    return beyond > 0.0 ? -way * kStiffness * beyond : 0.0;
  }
  void run(double duration_s) {
    for (double t = 0.0; t < duration_s; t += kDt) {
      measured_Nm += kDt / (kDt + late_s) * (torque_Nm() - measured_Nm);
      const auto allowed =
          limit.step(target, reference, {.measured = known, .external_Nm = {measured_Nm}}, kDt);
      for (std::size_t j = 0; j < 2; ++j)
        reference[j] += std::clamp(allowed[j] - reference[j], -kDt, kDt);  // at 1 rad/s
    }
  }
};

TEST(ContactForceLimit, FreeMotionIsTheTarget) {
  Pressing joint;
  joint.wall_rad = 10.0;
  joint.target = {0.5, -0.3};
  joint.run(1.0);
  EXPECT_NEAR(joint.reference[0], 0.5, 1e-12);
  EXPECT_NEAR(joint.reference[1], -0.3, 1e-12);
  EXPECT_EQ(joint.limit.held_joint(), -1);
}

TEST(ContactForceLimit, SR22_PressesWithItsBoundHoweverFarTheTargetIs) {
  for (const int way : {1, -1}) {
    for (const double late_s : {0.0, 0.02, 0.1}) {
      Pressing joint;
      joint.way = way, joint.late_s = late_s;
      joint.target[0] = way * 3.0;
      joint.target[1] = 0.2;
      joint.run(2.0);
      EXPECT_NEAR(joint.torque_Nm(), -way * kBound_Nm, 0.01 * kBound_Nm) << way << ' ' << late_s;
      EXPECT_EQ(joint.limit.held_joint(), 0);
      EXPECT_NEAR(joint.limit.held_force(), kBound_Nm, 0.01 * kBound_Nm);
      EXPECT_NEAR(joint.reference[1], 0.2, 1e-12) << "another joint is free";
      double greatest = 0.0;
      for (int i = 0; i < 1000; ++i)
        joint.run(kDt), greatest = std::max(greatest, std::abs(joint.torque_Nm()));
      EXPECT_LT(greatest, 1.02 * kBound_Nm) << "and stays there";
    }
  }
}

TEST(ContactForceLimit, SR22_YieldsWhereTheSurroundingsComeAndFollowsWhereTheyGo) {
  Pressing joint;
  joint.target[0] = 1.0;
  joint.run(2.0);
  for (const double speed : {-0.05, 0.05}) {
    for (int i = 0; i < 1000; ++i) joint.wall_rad += speed * kDt, joint.run(kDt);
    joint.run(1.0);
    EXPECT_NEAR(joint.torque_Nm(), -kBound_Nm, 0.02 * kBound_Nm) << speed;
  }
  joint.wall_rad = 0.5;  // gone: it goes on no faster than it yields
  const double before = joint.reference[0];
  joint.run(0.5);
  EXPECT_LE(joint.reference[0] - before, 0.2 * 0.5 + 2 * kDt);
  EXPECT_GT(joint.reference[0] - before, 0.05);
}

TEST(ContactForceLimit, ComesAwayAtOnceAndPressesAnewByItsBound) {
  Pressing joint;
  joint.target[0] = 1.0;
  joint.run(2.0);
  joint.target[0] = 0.05;  // the master has come back
  joint.run(0.2);
  EXPECT_NEAR(joint.reference[0], 0.05, 1e-12);
  EXPECT_EQ(joint.limit.held_joint(), -1);
  joint.target[0] = 1.0;
  joint.run(2.0);
  EXPECT_NEAR(joint.torque_Nm(), -kBound_Nm, 0.01 * kBound_Nm);
}

TEST(ContactForceLimit, AJointThatIsPushedYields) {
  ContactForceLimit limit(bounds());
  core::JointArray reference{}, target{};
  for (int i = 0; i < 500; ++i)
    reference = limit.step(target, reference, {.measured = true, .external_Nm = {2.0 * kBound_Nm}}, kDt);
  EXPECT_NEAR(reference[0], 0.2 * 0.5, 0.002) << "at its yield speed, where it is pushed";
}

TEST(ContactForceLimit, WithoutAMeasurementItStaysWhereItIs) {
  Pressing joint;
  joint.target[0] = 1.0;
  joint.run(2.0);
  const double at = joint.reference[0];
  joint.known = false;
  joint.run(1.0);
  EXPECT_EQ(joint.reference[0], at);
  joint.limit.reset();
  joint.run(0.1);
  EXPECT_GT(joint.reference[0], at) << "nothing is known of a contact";
}

TEST(ContactForceLimit, TheToolsBoundHoldsTheJointsThatBearItsForce) {
  ContactForceLimit limit(bounds(50.0));
  core::JointArray reference{}, target{1.0, 1.0};
  const ContactForce force{.measured = true, .external_Nm = {-5.0, 0.1}, .tool_force_N = 50.0};
  for (int i = 0; i < 100; ++i) reference = limit.step(target, reference, force, kDt);
  EXPECT_EQ(reference[0], 0.0);
  EXPECT_EQ(reference[1], 1.0) << "bears nothing of it";
  EXPECT_EQ(limit.held_joint(), 0);
  EXPECT_TRUE(limit.held_by_tool());
  EXPECT_EQ(limit.held_force(), 50.0);
}

TEST(ContactForceLimit, SR22_WhatTheTouchedObjectBearsHoldsTheJointsThatBearItsForce) {
  ContactForceLimit limit(bounds(50.0));
  core::JointArray reference{}, target{1.0, 1.0};
  ContactForce force{.measured = true,
                     .external_Nm = {-5.0, 0.1},
                     .tool_force_N = 40.0,
                     .object_force_N = 8.0,
                     .object_bound_N = 8.0};
  for (int i = 0; i < 100; ++i) reference = limit.step(target, reference, force, kDt);
  EXPECT_EQ(reference[0], 0.0);
  EXPECT_EQ(reference[1], 1.0) << "bears nothing of it";
  EXPECT_TRUE(limit.held_by_object());
  EXPECT_FALSE(limit.held_by_tool());
  EXPECT_EQ(limit.held_force(), 8.0);
  force.object_bound_N = 0.0;  // it bears any force
  for (int i = 0; i < 30'000; ++i) reference = limit.step(target, reference, force, kDt);
  EXPECT_EQ(reference[0], 1.0) << "below the tool's bound";
  EXPECT_FALSE(limit.held_by_object());
}

TEST(ContactForceLimit, WhoBearsTheSameForceYieldsWithTheJointAtItsBound) {
  ContactForceLimit limit(bounds());
  core::JointArray reference{}, target{1.0, 1.0};
  const ContactForce force{.measured = true, .external_Nm = {-2.0 * kBound_Nm, -0.5 * kBound_Nm}};
  for (int i = 0; i < 100; ++i) reference = limit.step(target, reference, force, kDt);
  EXPECT_NEAR(reference[0], -0.02, 1e-9);
  EXPECT_NEAR(reference[1], -0.02, 1e-9);
  EXPECT_EQ(limit.held_joint(), 0);
}

TEST(ContactForceLimit, SR22_NumbersThatAreNoneAreNoForce) {
  ContactForceLimit limit(bounds(50.0));
  const double none = std::numeric_limits<double>::quiet_NaN();
  const core::JointArray target{1.0, 1.0};
  const auto allowed = limit.step(target, {},
                                  {.measured = true,
                                   .external_Nm = {none, -1e308},
                                   .tool_force_N = none,
                                   .object_force_N = none,
                                   .object_bound_N = 1.0},
                                  kDt);
  EXPECT_EQ(allowed[0], 1.0);
  EXPECT_TRUE(std::isfinite(allowed[1]));
}

}  // namespace
}  // namespace in_contact_force_limit
}  // namespace phantom::teleop
