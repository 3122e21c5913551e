#include "common/teleop/coupling/joint_servo.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "common/simulation/encoder.hpp"
#include "common/simulation/joint_mechanics.hpp"

namespace phantom::teleop {
namespace {

using simulation::Encoders;
using simulation::integrate;
using simulation::JointMechanics;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(JointServo, DerivedGainsGiveTheWantedFrequencyAndDamping) {
  const auto gains = gains_for(2.0, 5.0, 0.7, 100.0);
  EXPECT_NEAR(std::sqrt(gains.k_p / 2.0) / (2 * M_PI), 5.0, 1e-12);
  EXPECT_NEAR(gains.k_v / (2 * std::sqrt(gains.k_p * 2.0)), 0.7, 1e-12);
}

// The largest excursion in the last second of ten, of a loop whose torque comes late; integrated in small
// steps.
double swing_after_a_push(const JointServoGains& gains, double inertia, double delay_s) {
  constexpr double kStep_s = 2e-5;
  std::vector<double> late(static_cast<std::size_t>(std::lround(delay_s / kStep_s)) + 1, 0.0);
  double q = 1e-3, v = 0.0, largest = 0.0;
  for (std::size_t i = 0; i < 500000; ++i) {
    late[i % late.size()] = -gains.k_p * q - gains.k_v * v;
    v += kStep_s * late[(i + 1) % late.size()] / inertia;
    q += kStep_s * v;
    if (!(std::abs(q) < 1.0)) return 1.0;
    if (i > 450000) largest = std::max(largest, std::abs(q));
  }
  return largest;
}

TEST(JointServo, BelowItsDelayMarginALoopComesToRestAndAboveItSwings) {
  for (const double bandwidth_Hz : {2.0, 8.0, 30.0}) {
    for (const double damping : {0.3, 1.0, 3.0}) {
      const auto gains = gains_for(0.7, bandwidth_Hz, damping, 1e9);
      const double margin_s = delay_margin_s(gains, 0.7);
      EXPECT_LT(swing_after_a_push(gains, 0.7, 0.9 * margin_s), 1e-4) << bandwidth_Hz << " Hz, " << damping;
      EXPECT_GT(swing_after_a_push(gains, 0.7, 1.1 * margin_s), 2e-3) << bandwidth_Hz << " Hz, " << damping;
    }
  }
  EXPECT_EQ(delay_margin_s({10, 0, 1}, 0.7), 0.0) << "stiffness alone";
  EXPECT_DOUBLE_EQ(delay_margin_s({0, 10, 1}, 0.7), M_PI / 2 * 0.07) << "damping alone";
  EXPECT_EQ(delay_margin_s({}, 0.7), std::numeric_limits<double>::infinity());
}

TEST(JointServo, SR12_TorqueStaysWithinTheLimitWhateverComes) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1e6, 1e6);
  std::array<JointServoGains, core::kMaxJoints> gains{};
  gains[0] = {1000, 50, 12};
  gains[1] = {1000, 50, 7};
  const JointServo servo(2, gains);
  for (int i = 0; i < 1000; ++i) {
    core::JointArray q_ref{}, v_ref{}, q{}, v{}, ff{};
    for (std::size_t j = 0; j < 2; ++j)
      q_ref[j] = any(random), v_ref[j] = any(random), q[j] = any(random), v[j] = any(random),
      ff[j] = any(random);
    if (i % 5 == 0) q_ref[1] = kNan;
    if (i % 7 == 0) q[0] = std::numeric_limits<double>::infinity();
    const auto torque = servo.step(q_ref, v_ref, q, v, ff);
    ASSERT_LE(std::abs(torque.drive_Nm[0]), 12.0);
    ASSERT_LE(std::abs(torque.drive_Nm[1]), 7.0);
    if (i % 5 == 0) {
      ASSERT_EQ(torque.drive_Nm[1], 0.0);
    }
    if (i % 7 == 0) {
      ASSERT_EQ(torque.drive_Nm[0], 0.0);
    }
  }
}

TEST(JointServo, AFeedForwardThatIsNotFiniteGivesNoTorque) {
  const JointServo servo(1, {JointServoGains{1000, 50, 12}});
  for (const double bad :
       {kNan, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()}) {
    const auto torque = servo.step({0.001}, {}, {}, {}, {bad});
    EXPECT_EQ(torque.drive_Nm[0], 0.0);
    EXPECT_EQ(torque.loop_Nm[0], 0.0);
  }
  EXPECT_EQ(servo.step({0.001}, {}, {}, {}, {0.5}).drive_Nm[0], 1.5);
}

// Sampled as on a bus: the answer to one tick is in the next one's torque, which acts from the one after
// that.
double swing_after(const JointServo& servo, double inertia, double gap_s, double duration_s) {
  double q = 0.1, v = 0.0, seen_q = q, seen_v = v, torque_Nm = 0.0, next_Nm = 0.0, most = 0.0;
  for (double t = 0.0; t < duration_s; t += gap_s) {
    torque_Nm = next_Nm;
    next_Nm = servo.step({}, {}, {seen_q}, {seen_v}, {}, {.held_s = gap_s}).drive_Nm[0];
    seen_q = q, seen_v = v;
    q += v * gap_s + 0.5 * torque_Nm / inertia * gap_s * gap_s;
    v += torque_Nm / inertia * gap_s;
    if (t > 0.7 * duration_s) most = std::max(most, std::abs(q));
  }
  return most;
}

TEST(JointServo, SR18_HoweverLongTorquesActTheLoopComesToRestAndWithoutTheGuardItSwings) {
  constexpr double kInertia = 2.0, kMaxSpeed = 1.2, kDelayPeriods = 2.5;
  std::array<JointServoGains, core::kMaxJoints> gains{};
  gains[0] = gains_for(kInertia, 8.0, 1.0, 60.0);
  const JointServo plain(1, gains);
  const HeldTorque held = held_torque(gains[0], kInertia, kMaxSpeed, kDelayPeriods);
  EXPECT_NEAR(held.longest_s, 0.5 * delay_margin_s(gains[0], kInertia) / 2.5, 1e-12);
  EXPECT_NEAR(held.longest_s, 0.00257, 0.00005) << "8 Hz: a gap of two and a half milliseconds";
  const JointServo guarded(1, gains, {held});
  for (const double gap_s : {0.004, 0.02, 0.05, 0.08}) {
    EXPECT_LT(swing_after(guarded, kInertia, gap_s, 400.0 * gap_s), 1e-3) << gap_s;
    if (gap_s > 0.01) {
      EXPECT_GT(swing_after(plain, kInertia, gap_s, 400.0 * gap_s), 0.1) << gap_s;
    }
  }
}

TEST(JointServo, SR18_WhileTorquesActLongTheirImpulseIsBoundedAndTheFeedForwardIsNot) {
  constexpr double kInertia = 2.0, kMaxSpeed = 1.2, kDelayPeriods = 2.5;
  std::array<JointServoGains, core::kMaxJoints> gains{};
  gains[0] = gains_for(kInertia, 8.0, 1.0, 60.0);
  const JointServo servo(1, gains, {held_torque(gains[0], kInertia, kMaxSpeed, kDelayPeriods)});
  for (const double held_s : {0.003, 0.01, 0.05, 0.5}) {
    const auto torque = servo.step({100.0}, {}, {}, {}, {7.0}, {.held_s = held_s});
    EXPECT_LE(torque.loop_Nm[0] * 3.0 * held_s / kInertia, 0.25 * kMaxSpeed + 1e-12) << held_s;
    EXPECT_NEAR(torque.drive_Nm[0], std::min(torque.loop_Nm[0] + 7.0, 60.0), 1e-12) << "the weight is borne";
    const auto none = servo.step({100.0}, {}, {std::nan("")}, {}, {7.0}, {.held_s = held_s});
    EXPECT_EQ(none.drive_Nm[0], 0.0);
  }
  EXPECT_EQ(servo.step({100.0}, {}, {}, {}, {}, {.held_s = 0.002}).loop_Nm[0], 60.0) << "a punctual tick";
}

TEST(JointServo, LoopTorqueLeavesTheFeedForwardOut) {
  std::array<JointServoGains, core::kMaxJoints> gains{};
  gains[0] = {100, 0, 1000};
  core::JointArray q_ref{}, ff{};
  q_ref[0] = 0.1;
  ff[0] = 30;
  const auto torque = JointServo(1, gains).step(q_ref, {}, {}, {}, ff);
  EXPECT_DOUBLE_EQ(torque.loop_Nm[0], 10.0);
  EXPECT_DOUBLE_EQ(torque.drive_Nm[0], 40.0);
}

TEST(JointServo, SettlesOnAStepThroughEncoders) {
  const JointMechanics joint{.inertia = 1.5, .viscous = 0.5, .coulomb = 0.2};
  std::array<JointServoGains, core::kMaxJoints> gains{};
  gains[0] = gains_for(1.5, 8, 1.0, 500);
  const JointServo servo(1, gains);
  core::JointArray resolution{}, q{}, v{}, q_ref{};
  resolution[0] = 1e-5;
  q_ref[0] = 0.3;
  Encoders encoders(1, resolution, 0.002);
  encoders.sample(q, 0.0);
  double overshoot = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const auto torque = servo.step(q_ref, {}, encoders.position(), encoders.velocity(), {});
    integrate(joint, torque.drive_Nm[0], 0.001, q[0], v[0]);
    encoders.sample(q, 0.001);
    overshoot = std::max(overshoot, q[0] - 0.3);
  }
  EXPECT_NEAR(q[0], 0.3, 0.2 / gains[0].k_p + 2e-5);  // stiction may hold it by c/K_p
  EXPECT_EQ(v[0], 0.0);
  EXPECT_LT(overshoot, 0.03);
}

TEST(ReferenceLimiter, SR10_SR12_NeverFasterThanAllowedNeverOutsideTheLimits) {
  core::JointArray lower{}, upper{}, speed{};
  lower[0] = -1, upper[0] = 2, speed[0] = 0.5;
  ReferenceLimiter limiter(1, lower, upper);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-20, 20);
  core::JointArray target{};
  double before = 0.0;
  for (int i = 0; i < 5000; ++i) {
    if (i % 300 == 0) target[0] = any(random);
    if (i % 1000 == 999) target[0] = kNan;
    const double now = limiter.step(target, speed, 0.01)[0];
    ASSERT_LE(std::abs(now - before), 0.005 + 1e-12);
    ASSERT_GE(now, -1.0);
    ASSERT_LE(now, 2.0);
    before = now;
  }
  target[0] = 50;
  limiter.reset(target);
  EXPECT_EQ(limiter.reference()[0], 2.0);
}

}  // namespace
}  // namespace phantom::teleop
