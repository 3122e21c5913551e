#include "common/teleop/guards/passivity_guard.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <random>

#include "common/teleop/tests/period.hpp"

namespace phantom::teleop {
namespace {

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
    const double torque_Nm =
        guard.step(first(std::clamp(spring_Nm, -4.0, 4.0)), first(q), first(v), 1.0, kDt)[0];
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
    EXPECT_GT(deflection_after(false, delay, 30.0), 0.1);  // grows, or never dies
    EXPECT_LT(deflection_after(true, delay, 30.0), 0.02);
  }
}

// However much it took from the hand before: what it may give back unnoticed is bounded.
TEST(PassivityGuard, EnergyThatWasTakenIsSavedUpToTheStoreOnly) {
  const PassivityParameters p = one_joint(0.01, 0.05, 10.0);
  PassivityGuard guard(p);
  double q = 0.0;
  const auto push = [&](double torque_Nm) {
    guard.step(first(torque_Nm), first(q), first(1.0), 1.0, kDt);
    q += kDt;
  };
  for (int i = 0; i < 10000; ++i) push(-1.0);  // takes 10 J
  EXPECT_FALSE(guard.active());
  EXPECT_NEAR(guard.energy_J(0), p.store_J[0], 1e-9);
  double given_J = 0.0;
  for (; !guard.active() && given_J < 1.0; given_J += kDt) push(1.0);
  EXPECT_NEAR(given_J, p.store_J[0] + p.allowance_J[0], 0.005);
}

TEST(PassivityGuard, LetsADissipativeFeedbackThroughUntouched) {
  PassivityGuard guard(one_joint(0.0, 1.0, 10.0));
  double q = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const double v = std::sin(0.002 * i);
    const auto torque = guard.step(first(-0.7 * v), first(q), first(v), 1.0, kDt);
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
    EXPECT_EQ(guard.step(first(1.0), first(q), first(1.0), 1.0, kDt)[0], 1.0);
  }
  EXPECT_NEAR(guard.energy_J(0), -0.4, 1e-9);
}

// Property: whatever the torque, what is given beyond the allowance is bounded, and the guard itself never
// jerks.
TEST(PassivityGuard, SR13_TheBalanceNeverFallsFarBelowTheAllowance) {
  constexpr double kLimit = 8.0, kTorque_Nm = 3.0;
  std::mt19937 random(4);
  std::uniform_real_distribution<double> any(-1, 1);
  PassivityGuard guard(one_joint(0.01, 0.05, kLimit));
  double q = 0.0, v = 1.0, lowest_J = 0.0, damping_before_Nm = 0.0, v_before = v;
  for (int i = 0; i < 50000; ++i) {
    v = std::clamp(v + 0.02 * any(random), -1.0, 1.0);
    const double active_Nm = kTorque_Nm * (v > 0 ? 1 : -1) * std::abs(any(random)) * std::abs(v);
    const double torque_Nm = guard.step(first(active_Nm), first(q), first(v), 1.0, kDt)[0];
    const double damping_Nm = torque_Nm - active_Nm;
    ASSERT_LE(damping_Nm * v, 1e-12);
    ASSERT_LE(std::abs(damping_Nm), kLimit * std::abs(v) + 1e-12);
    const double most_Nm =
        kLimit * (kDt / PassivityGuard::kEngage_s * std::abs(v) + std::abs(v - v_before)) + 1e-9;
    ASSERT_LE(std::abs(damping_Nm - damping_before_Nm), most_Nm);
    damping_before_Nm = damping_Nm, v_before = v;
    q += kDt * v;
    lowest_J = std::min(lowest_J, guard.energy_J(0));
  }
  // Until the guard has engaged, the feedback can give at most torque × speed × time.
  EXPECT_GT(lowest_J, -0.01 - 2 * kTorque_Nm * 1.0 * PassivityGuard::kEngage_s);
  EXPECT_LT(lowest_J, -0.01);  // it was put to the test
}

TEST(PassivityGuard, WithoutAuthorityItDoesNothingAndForgets) {
  PassivityGuard guard(one_joint(0.0, 0.05, 8.0));
  for (int i = 0; i < 100; ++i) guard.step(first(2.0), first(0.001 * i), first(1.0), 1.0, kDt);
  EXPECT_TRUE(guard.active());
  EXPECT_EQ(guard.step(first(0.0), first(0.1), first(1.0), 0.0, kDt)[0], 0.0);
  EXPECT_FALSE(guard.active());
  EXPECT_EQ(guard.energy_J(0), 0.0);
}

TEST(PassivityGuard, NumbersThatAreNoneGiveNoTorqueAndSpoilNothing) {
  PassivityGuard guard(one_joint(0.0, 1.0, 10.0));
  EXPECT_EQ(guard.step(first(std::nan("")), first(0), first(1), 1.0, kDt)[0], 0.0);
  EXPECT_EQ(guard.step(first(1.0), first(std::nan("")), first(std::nan("")), 1.0, kDt)[0], 1.0);
  EXPECT_EQ(guard.step(first(-1.0), first(0.01), first(1), 1.0, kDt)[0], -1.0);
  EXPECT_TRUE(std::isfinite(guard.energy_J(0)));
}

}  // namespace
}  // namespace phantom::teleop
