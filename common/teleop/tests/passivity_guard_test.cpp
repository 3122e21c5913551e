#include "common/teleop/passivity_guard.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <random>

namespace phantom::teleop {
namespace {

constexpr double kDt = 0.001;

PassivityParameters one_joint(double allowance_J, double store_J, double damping_limit) {
  PassivityParameters p{.joint_count = 1, .allowance_J = {}, .store_J = {}, .damping_limit = {}};
  p.allowance_J[0] = allowance_J, p.store_J[0] = store_J, p.damping_limit[0] = damping_limit;
  return p;
}

core::JointArray first(double value) {
  core::JointArray values{};
  values[0] = value;
  return values;
}

/// A device held to a wall by a spring that the network delivers late: an active loop. Returns the greatest
/// deflection within the last of ten seconds.
double deflection_after(bool guarded, int delay_ticks, double stiffness) {
  PassivityParameters p = one_joint(0.001, 0.02, 4.0);
  p.enabled = guarded;
  PassivityGuard guard(p);
  std::deque<double> late(static_cast<std::size_t>(delay_ticks) + 1, 0.1);
  double q = 0.1, v = 0.0, greatest = 0.0;
  for (int i = 0; i < 10000; ++i) {
    const double spring_Nm = -stiffness * late.front();
    late.pop_front();
    const double torque_Nm = guard.step(first(std::clamp(spring_Nm, -4.0, 4.0)), first(q), first(v), kDt)[0];
    v += kDt / 0.05 * torque_Nm;
    q += kDt * v;
    late.push_back(q);
    if (i >= 9000) greatest = std::max(greatest, std::abs(q));
  }
  return greatest;
}

TEST(PassivityGuard, ALateSpringOscillatesWithoutItAndSettlesWithIt) {
  for (const int delay : {2, 5, 10, 20}) {
    SCOPED_TRACE(delay);
    EXPECT_GT(deflection_after(false, delay, 30.0), 0.1);   // grows, or never dies
    EXPECT_LT(deflection_after(true, delay, 30.0), 0.02);
  }
}

TEST(PassivityGuard, LetsADissipativeFeedbackThroughUntouched) {
  PassivityGuard guard(one_joint(0.0, 1.0, 10.0));
  double q = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const double v = std::sin(0.002 * i);
    const auto torque = guard.step(first(-0.7 * v), first(q), first(v), kDt);
    ASSERT_EQ(torque[0], -0.7 * v) << i;
    ASSERT_FALSE(guard.active());
    q += kDt * v;
  }
  EXPECT_GT(guard.energy_J(0), 0.0);
}

TEST(PassivityGuard, AnEnergyThatTheAllowanceCoversPasses) {
  PassivityGuard guard(one_joint(0.5, 1.0, 10.0));  // a weight of 1 N·m lowered by 0.4 rad gives 0.4 J
  for (int i = 0; i <= 400; ++i) {
    const double q = 0.001 * i;
    EXPECT_EQ(guard.step(first(1.0), first(q), first(1.0), kDt)[0], 1.0);
  }
  EXPECT_NEAR(guard.energy_J(0), -0.4, 1e-9);
}

// Property: with damping to spare the balance comes back above −allowance within a period, whatever the torque.
TEST(PassivityGuard, TheBalanceNeverStaysBelowTheAllowance) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> any(-1, 1);
  PassivityGuard guard(one_joint(0.01, 0.05, 1e6));
  double q = 0.0, v = 1.0, lowest_J = 0.0;
  for (int i = 0; i < 50000; ++i) {
    v += 0.02 * any(random);
    const double torque_Nm = guard.step(first(3.0 * (v > 0 ? 1 : -1) * std::abs(any(random))), first(q), first(v), kDt)[0];
    ASSERT_TRUE(std::isfinite(torque_Nm));
    q += kDt * v;
    lowest_J = std::min(lowest_J, guard.energy_J(0));
  }
  EXPECT_GT(lowest_J, -0.01 - 2 * 3.0 * kDt * 3.0);
  EXPECT_LT(lowest_J, -0.01);  // it was put to the test
}

TEST(PassivityGuard, NumbersThatAreNoneGiveNoTorqueAndSpoilNothing) {
  PassivityGuard guard(one_joint(0.0, 1.0, 10.0));
  EXPECT_EQ(guard.step(first(std::nan("")), first(0), first(1), kDt)[0], 0.0);
  EXPECT_EQ(guard.step(first(1.0), first(std::nan("")), first(std::nan("")), kDt)[0], 1.0);
  EXPECT_EQ(guard.step(first(-1.0), first(0.01), first(1), kDt)[0], -1.0);
  EXPECT_TRUE(std::isfinite(guard.energy_J(0)));
}

}  // namespace
}  // namespace phantom::teleop
