#include "common/teleop/rendering/torque_slew.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "common/teleop/tests/period.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::teleop::torque_slew_test {
namespace {

constexpr std::size_t kSlewJoints = 4;

TorqueSlewParameters parameters(robot::DragMode mode) {
  TorqueSlewParameters p{.joint_count = kSlewJoints, .mode = mode};
  for (std::size_t j = 0; j < kSlewJoints; ++j) {
    const double size = 1.0 + static_cast<double>(j);
    p.percept_cap_Nm[j] = 2.0 * size;
    p.feedback_cap_Nm[j] = 4.0 * size;
    p.limit_Nm[j] = j == 2 ? 5.0 : 8.0 * size;  // one device that cannot bear both caps
    p.rate_Nm_per_s[j] = 300.0 * size;
  }
  return p;
}

class Slew : public testing::TestWithParam<robot::DragMode> {};
INSTANTIATE_TEST_SUITE_P(Modes, Slew,
                         testing::Values(robot::DragMode::kSeparable, robot::DragMode::kCoupled));

/// Any input that there is: steps, reversals, numbers that are none.
struct AnyInput {
  std::mt19937 engine{5};
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine);
  }
  double value(double scale) {
    constexpr double kEndless = std::numeric_limits<double>::infinity();
    const double kind = uniform(0, 1);
    if (kind < 0.01) return std::numeric_limits<double>::quiet_NaN();
    if (kind < 0.02) return uniform(0, 1) < 0.5 ? kEndless : -kEndless;
    if (kind < 0.03) return uniform(-1, 1) * 1e308;
    if (kind < 0.2) return 0.0;
    return uniform(-scale, scale);
  }
  core::JointArray values(double scale) {
    core::JointArray all{};
    for (std::size_t j = 0; j < kSlewJoints; ++j) all[j] = value(scale);
    return all;
  }
};

TEST_P(Slew, WhateverComesCapSlewAndPassivityHold) {
  const auto p = parameters(GetParam());
  TorqueSlew slew(p);
  AnyInput any;
  SlewedTorque before;
  core::JointArray percept{}, feedback{}, v{};
  int let_go = 0;
  for (int i = 0; i < 200'000; ++i) {
    // Inputs stay for a while, so that the torque gets somewhere.
    if (any.uniform(0, 1) < 0.05) percept = any.values(12.0);
    if (any.uniform(0, 1) < 0.05) feedback = any.values(30.0);
    if (any.uniform(0, 1) < 0.1) v = any.values(2.0);
    const SlewedTorque now = [&] {
      const test::HeapGuard guard;
      return slew.step(percept, feedback, v, kDt);
    }();
    double power_W = 0.0, greatest_W = 0.0;
    for (std::size_t j = 0; j < kSlewJoints; ++j) {
      ASSERT_LE(std::abs(now.percept_Nm[j]), p.percept_cap_Nm[j] + 1e-12) << i;
      ASSERT_LE(std::abs(now.feedback_Nm[j]), p.feedback_cap_Nm[j] + 1e-12) << i;
      ASSERT_LE(std::abs(now.motor_Nm[j]), p.limit_Nm[j]) << i;
      ASSERT_NEAR(now.motor_Nm[j], now.percept_Nm[j] + now.feedback_Nm[j], 1e-12) << i;
      // It would push, or its power is no number.
      const bool may_fall = before.percept_Nm[j] * v[j] > 0.0 || !(std::abs(v[j]) < 1e300);
      const double allowed_Nm = p.rate_Nm_per_s[j] * kDt + 1e-12;
      if (may_fall) {
        // What falls, falls towards nothing and not beyond.
        ASSERT_GE(now.percept_Nm[j] * before.percept_Nm[j], -allowed_Nm * allowed_Nm) << i;
        let_go += std::abs(now.motor_Nm[j] - before.motor_Nm[j]) > allowed_Nm;
      } else {
        ASSERT_LE(std::abs(now.motor_Nm[j] - before.motor_Nm[j]), allowed_Nm) << i;
      }
      ASSERT_LE(std::abs(now.motor_Nm[j] - before.motor_Nm[j]), allowed_Nm + p.percept_cap_Nm[j]) << i;
      if (!std::isfinite(v[j])) {
        ASSERT_EQ(now.percept_Nm[j], 0.0) << i;
        continue;
      }
      const double watts = now.percept_Nm[j] * v[j];
      power_W += watts;
      greatest_W = std::max(greatest_W, std::abs(watts));
      if (GetParam() == robot::DragMode::kSeparable) {
        ASSERT_LE(watts, 0.0) << i << " joint " << j;
      }
    }
    ASSERT_LE(power_W, 1e-12 * greatest_W) << i;
    before = now;
  }
  EXPECT_GT(let_go, 100) << "the case that conflicts was tried";
}

// With drag as the law gives it, nothing is ever let go: only the rate is felt.
TEST(TorqueSlew, SR10_AJerkOfFeedbackComesOverTheConfiguredTime) {
  auto p = parameters(robot::DragMode::kSeparable);
  TorqueSlew slew(p);
  core::JointArray feedback{};
  feedback[0] = 4.0;
  double before_Nm = 0.0;
  int ticks = 0;
  for (; slew.step({}, feedback, {}, kDt).motor_Nm[0] < 4.0 - 1e-9; ++ticks) {
    const double now_Nm = slew.step({}, feedback, {}, 0.0).motor_Nm[0];
    ASSERT_LE(now_Nm - before_Nm, 200.0 * kDt + 1e-12);  // two thirds of 300, as the caps are 2 and 4
    before_Nm = now_Nm;
  }
  EXPECT_NEAR(ticks, 19, 1);
}

TEST(TorqueSlew, DragOfAHandThatIsThrownRoundIsLetGoAtOnce) {
  const auto p = parameters(robot::DragMode::kSeparable);
  TorqueSlew slew(p);
  core::JointArray drag{}, v{};
  drag[0] = -2.0, v[0] = 0.4;
  for (int i = 0; i < 100; ++i) slew.step(drag, {}, v, kDt);
  ASSERT_EQ(slew.step(drag, {}, v, kDt).percept_Nm[0], -2.0);
  drag[0] = 2.0, v[0] = -0.4;
  EXPECT_EQ(slew.step(drag, {}, v, kDt).percept_Nm[0], 0.0);
  EXPECT_NEAR(slew.step(drag, {}, v, kDt).percept_Nm[0], 0.1, 1e-12) << "a third of 300 N·m/s";
  v[0] = 0.0;
  drag[0] = 0.0;
  EXPECT_NEAR(slew.step(drag, {}, v, kDt).percept_Nm[0], 0.0, 1e-12) << "at rest it comes down at its rate";
}

TEST(TorqueSlew, TheDevicesLimitTakesFromTheFeedbackNotFromTheDrag) {
  const auto p = parameters(robot::DragMode::kSeparable);
  TorqueSlew slew(p);
  core::JointArray drag{}, feedback{}, v{};
  drag[2] = -5.0, v[2] = 1.0, feedback[2] = -10.0;
  SlewedTorque now;
  for (int i = 0; i < 1000; ++i) now = slew.step(drag, feedback, v, kDt);
  EXPECT_EQ(now.motor_Nm[2], -5.0);
  EXPECT_EQ(now.percept_Nm[2], -5.0);
  EXPECT_EQ(now.feedback_Nm[2], 0.0);
  EXPECT_TRUE(now.feedback_capped);
  EXPECT_FALSE(now.percept_capped);
}

TEST(TorqueSlew, SaysWhichPartIsAtItsCap) {
  const auto p = parameters(robot::DragMode::kSeparable);
  TorqueSlew slew(p);
  core::JointArray drag{}, feedback{}, v{};
  const auto settled = [&] {
    SlewedTorque now;
    for (int i = 0; i < 1000; ++i) now = slew.step(drag, feedback, v, kDt);
    return now;
  };
  v[1] = 1.0, drag[1] = -0.9 * p.percept_cap_Nm[1], feedback[1] = -0.9 * p.feedback_cap_Nm[1];
  SlewedTorque now = settled();
  EXPECT_FALSE(now.percept_capped || now.feedback_capped);
  drag[1] = -1.1 * p.percept_cap_Nm[1];
  now = settled();
  EXPECT_TRUE(now.percept_capped);
  EXPECT_FALSE(now.feedback_capped);
  drag[1] = 0.0, feedback[1] = 1.1 * p.feedback_cap_Nm[1];
  now = settled();
  EXPECT_FALSE(now.percept_capped);
  EXPECT_TRUE(now.feedback_capped);
}

}  // namespace
}  // namespace phantom::teleop::torque_slew_test
