#include "common/teleop/guards/energy_tank.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "common/teleop/tests/period.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::teleop::energy_tank_test {
namespace {

constexpr EnergyTankParameters kOne{.joint_count = 1, .allowance_J = 0.05, .store_J = 0.1};

/// A hand that moves joint 1 as it likes; returns the energy given to it, at most over the time.
double most_given(EnergyTank& tank, double for_s,
                  const std::function<double(double t, double q, double v)>& torque,
                  const std::function<double(double t)>& way) {
  double given_J = 0.0, most_J = 0.0, last_Nm = 0.0, last_q = way(0.0);
  for (double t = 0.0; t < for_s; t += kDt) {
    const double q = way(t), v = (way(t + kDt) - q) / kDt;
    given_J += last_Nm * (q - last_q);
    most_J = std::max(most_J, given_J);
    const test::HeapGuard guard;
    last_Nm = tank.step({torque(t, q, v)}, {q}, kDt)[0];
    last_q = q;
  }
  return most_J;
}

double swings(double t) { return 0.1 * std::sin(5.0 * t); }
double goes_on(double t) { return 0.3 * t; }

TEST(EnergyTank, DragPassesUnchanged) {
  EnergyTank tank(kOne);
  for (double t = 0.0; t < 5.0; t += kDt) {
    const double drag_Nm = -5.0 * 0.5 * std::cos(5.0 * t);
    ASSERT_DOUBLE_EQ(tank.step({drag_Nm}, {swings(t)}, kDt)[0], drag_Nm) << t;
  }
}

// A torque that is held over a period makes a spring give some energy with each press (here 4 mJ, so 8 % at
// most).
TEST(EnergyTank, ASpringThatIsPressedAndReturnsPassesNearlyUnchanged) {
  EnergyTank spring({.joint_count = 1, .allowance_J = 0.05, .store_J = 1.0});
  for (double t = 0.0; t < M_PI / 5.0; t += kDt) {
    const double torque_Nm = -100.0 * std::max(0.0, swings(t));
    ASSERT_NEAR(spring.step({torque_Nm}, {swings(t)}, kDt)[0], torque_Nm, 0.1 * std::abs(torque_Nm)) << t;
  }
}

// The velocity has the wrong sign: CiA 402 has separate polarity bits for position and velocity.
TEST(EnergyTank, SR14_DragOfANegatedVelocityGivesNoMoreThanTheAllowance) {
  for (const auto& way : {&swings, &goes_on}) {
    EnergyTank tank(kOne);
    EXPECT_LT(most_given(
                  tank, 20.0, [](double, double, double v) { return 20.0 * v; }, way),
              0.055);
    EXPECT_TRUE(tank.active());
  }
}

// Tries master_io: a reaction that gives energy
TEST(EnergyTank, SR14_AConstantOrMovingReactionGivesNoMoreThanTheAllowance) {
  const auto constant = [](double, double, double) { return 4.0; };
  const auto moving = [](double t, double q, double) {
    return std::clamp(-200.0 * (q - 0.3 * t - 0.05), -4.0, 4.0);
  };
  for (const auto& torque : {std::function<double(double, double, double)>(constant),
                             std::function<double(double, double, double)>(moving)}) {
    for (const auto& way : {&swings, &goes_on}) {
      EnergyTank tank(kOne);
      EXPECT_LT(most_given(tank, 20.0, torque, way), 0.06);
    }
  }
}

TEST(EnergyTank, WhatWasTakenMayBeGivenBackUpToTheStore) {
  EnergyTank tank(kOne);
  const auto against = [](double, double, double) { return -4.0; };
  most_given(tank, 1.0, against, goes_on);
  EXPECT_NEAR(tank.balance_J(), 0.1, 1e-9);
  EXPECT_NEAR(most_given(tank, 10.0, against, [](double t) { return 0.3 - 0.3 * t; }), 0.15, 0.01);
}

TEST(EnergyTank, OneFactorForAllJoints) {
  EnergyTank tank({.joint_count = 2, .allowance_J = 0.05, .store_J = 0.1});
  for (double t = 0.0; t < 5.0; t += kDt) {
    const auto torque = tank.step({2.0, -1.0}, {goes_on(t), goes_on(t)}, kDt);
    ASSERT_NEAR(torque[0], -2.0 * torque[1], 1e-12);
  }
  EXPECT_NEAR(tank.balance_J(), -0.05, 0.002);
}

TEST(EnergyTank, NumbersThatAreNoneGiveNothing) {
  const double bad = std::numeric_limits<double>::quiet_NaN();
  EnergyTank tank(kOne);
  EXPECT_EQ(tank.step({bad}, {bad}, kDt)[0], 0.0);
  EXPECT_EQ(tank.step({1.0}, {0.0}, kDt)[0], 1.0);
  tank.note_rendered({bad});
  tank.step({1.0}, {0.1}, kDt);
  EXPECT_EQ(tank.balance_J(), 0.0);
}

}  // namespace
}  // namespace phantom::teleop::energy_tank_test
