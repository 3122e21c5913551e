#include "common/teleop/rendering/wrench_slew.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "common/teleop/tests/period.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace {

constexpr WrenchSlewParameters kWrist{
    .force_cap_N = 10.0, .moment_cap_N_m = 0.5, .force_rate_N_per_s = 500.0, .moment_rate_Nm_per_s = 25.0};

Spatial any(std::mt19937& random, double linear, double angular) {
  std::uniform_real_distribution<double> one(-1.0, 1.0);
  Spatial v;
  for (int i = 0; i < 6; ++i) v[i] = (i < 3 ? linear : angular) * one(random);
  const auto kind = random() % 200;
  if (kind == 0) v[static_cast<int>(random() % 6)] = std::numeric_limits<double>::quiet_NaN();
  if (kind == 1) v[static_cast<int>(random() % 6)] = std::numeric_limits<double>::infinity();
  if (kind == 2) v *= 1e300;
  return v;
}

TEST(WrenchSlew, WhateverComesCapsRateAndPowerHold) {
  std::mt19937 random(4);
  WrenchSlew slew(kWrist);
  Spatial wanted = Spatial::Zero(), twist = Spatial::Zero(), before = Spatial::Zero();
  int falls = 0;
  for (int i = 0; i < 200'000; ++i) {
    if (random() % 20 == 0) wanted = any(random, 30.0, 1.5);
    if (random() % 10 == 0) twist = any(random, 0.5, 2.0);
    Spatial now;
    {
      const test::HeapGuard guard;
      now = slew.step(wanted, twist, kDt);
    }
    ASSERT_TRUE(now.allFinite()) << i;
    ASSERT_LE(now.head<3>().norm(), kWrist.force_cap_N + 1e-12) << i;
    ASSERT_LE(now.tail<3>().norm(), kWrist.moment_cap_N_m + 1e-12) << i;
    const bool rated = (now - before).head<3>().norm() <= kWrist.force_rate_N_per_s * kDt + 1e-12 &&
                       (now - before).tail<3>().norm() <= kWrist.moment_rate_Nm_per_s * kDt + 1e-12;
    if (twist.allFinite() && twist.norm() < 1e3) {
      Spatial aim = Spatial::Zero();
      if (wanted.allFinite()) {
        const double force = wanted.head<3>().stableNorm(), moment = wanted.tail<3>().stableNorm();
        aim = wanted / std::max({1.0, force / kWrist.force_cap_N, moment / kWrist.moment_cap_N_m});
      }
      ASSERT_LE(now.dot(twist), std::max(0.0, aim.dot(twist)) + 1e-12) << i;
      if (!rated) {
        ++falls;
        ASSERT_LT(now.norm(), before.norm() + kWrist.force_rate_N_per_s * kDt)
            << "what falls, falls towards nothing";
        ASSERT_GT(before.dot(twist), -kWrist.force_rate_N_per_s * kDt * twist.norm())
            << "only what would push falls";
      }
    }
    before = now;
  }
  EXPECT_GT(falls, 100) << "the case that conflicts was tried";
}

TEST(WrenchSlew, AStepIsRenderedAtTheRateAndReachesItsValue) {
  WrenchSlew slew(kWrist);
  Spatial wanted = Spatial::Zero();
  wanted[0] = 5.0;
  for (int i = 1; i <= 10; ++i) EXPECT_NEAR(slew.step(wanted, Spatial::Zero(), kDt)[0], 0.5 * i, 1e-12);
  EXPECT_NEAR(slew.step(wanted, Spatial::Zero(), kDt)[0], 5.0, 1e-12);
}

TEST(WrenchSlew, OneFactorCapsBothPartsSoThatDragStaysDrag) {
  WrenchSlew slew(
      {.force_cap_N = 10, .moment_cap_N_m = 0.5, .force_rate_N_per_s = 1e9, .moment_rate_Nm_per_s = 1e9});
  Spatial twist, drag;
  twist << 0.1, 0.0, 0.0, -0.5, 0.0, 0.0;
  drag << -100.0, 0.0, 0.0, -4.0, 0.0, 0.0;  // the moment pushes, the force takes more
  ASSERT_LT(drag.dot(twist), 0.0);
  const Spatial felt = slew.step(drag, twist, kDt);
  EXPECT_NEAR(felt[0], -10.0, 1e-12);
  EXPECT_NEAR(felt[3], -0.4, 1e-12);
  EXPECT_LT(felt.dot(twist), 0.0);
}

}  // namespace
}  // namespace phantom::teleop
