#include "common/can/plausibility_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "tests/support/heap_guard.hpp"

namespace phantom::can {
namespace {

constexpr double kCount = 1e-5;
const PlausibilityParameters kJoint{
    .max_speed = 1.2, .max_torque = 100.0, .count = kCount, .period_s = 0.002, .overspeed_ratio = 1.5};

/// A joint that moves as the test says, seen through a quantised encoder.
struct MonitorRig {
  PlausibilityMonitor monitor{kJoint};
  MotionSample sample;
  double q = 0.0, v = 0.0, torque = 0.0;
  double lag_s = 0.0, filtered_v = 0.0;  // of the drive's own velocity
  ImplausibleMotion found;
  int ticks = 0;

  /// Returns whether the feedback that `lie` makes of the truth is found within `most` ticks.
  bool run(
      int most, const std::function<void(MotionSample&)>& lie = [](MotionSample&) {}) {
    for (ticks = 0; ticks < most; ++ticks) {
      q += v * kJoint.period_s;
      filtered_v += kJoint.period_s / (kJoint.period_s + lag_s) * (v - filtered_v);
      sample.at_ns += core::from_seconds(kJoint.period_s);
      sample.position = std::floor(q / kCount + 0.5) * kCount;
      sample.velocity = filtered_v;
      sample.torque = torque;
      MotionSample told = sample;
      lie(told);
      const test::HeapGuard guard;
      found = monitor.step(told);
      if (found.reason != Implausibility::kNone) return true;
    }
    return false;
  }
};

TEST(PlausibilityMonitor, OrdinaryMotionIsBelieved) {
  MonitorRig rig;
  rig.lag_s = 0.008;
  double t = 0.0;
  for (int i = 0; i < 20000; ++i, t += kJoint.period_s) {
    rig.v = 1.2 * std::sin(6.0 * t);  // up to 7 rad/s²
    rig.torque = 60.0 * std::cos(6.0 * t);
    ASSERT_FALSE(rig.run(1)) << static_cast<int>(rig.found.reason) << " at " << t << ": " << rig.found.seen
                             << " > " << rig.found.allowed;
  }
}

TEST(PlausibilityMonitor, LostAndLateAnswersAreNoLies) {
  MonitorRig rig;
  rig.v = 1.2;
  std::mt19937 random(2);
  MotionSample last;
  for (int i = 0; i < 20000; ++i) {
    if (i % 500 == 0) rig.v = -rig.v;
    // One answer in ten is that to the SYNC before; one in ten does not come.
    const auto draw = random() % 10;
    const double period_s = kJoint.period_s;
    rig.q += rig.v * period_s;
    rig.sample.at_ns += core::from_seconds(period_s);
    MotionSample now{rig.sample.at_ns, rig.q, rig.v, 0.0};
    MotionSample told = now;
    if (draw == 0) told.position = last.position;
    last = now;
    if (draw == 1) continue;
    const ImplausibleMotion found = rig.monitor.step(told);
    ASSERT_EQ(found.reason, Implausibility::kNone) << i << ": " << found.seen << " > " << found.allowed;
  }
}

TEST(PlausibilityMonitor, TorqueAtAStandstillInContactIsBelieved) {
  MonitorRig rig;
  for (int i = 0; i < 2000;
       ++i) {  // presses a stiff body: 1e5 N·m/rad, of which the encoder sees some counts
    rig.torque = 90.0 * std::sin(0.01 * i);
    rig.q = rig.torque / 1e5;
    ASSERT_FALSE(rig.run(1)) << i;
  }
}

TEST(PlausibilityMonitor, AJumpIsFoundAtOnce) {
  for (const double jump : {2147483648.0 * kCount, -0.1, 0.05}) {
    MonitorRig rig;
    rig.v = 0.5;
    ASSERT_FALSE(rig.run(100));
    ASSERT_TRUE(rig.run(1, [jump](MotionSample& s) { s.position += jump; })) << jump;
    EXPECT_EQ(rig.found.reason, Implausibility::kJump);
    EXPECT_NEAR(rig.found.seen, std::abs(jump), 2e-3);
  }
}

// Also after a gap that starts the other checks over.
TEST(PlausibilityMonitor, AJumpIsFoundAfterAGap) {
  MonitorRig rig;
  ASSERT_FALSE(rig.run(100));
  rig.sample.at_ns += core::from_seconds(0.1);
  EXPECT_FALSE(rig.run(1));
  rig.sample.at_ns += core::from_seconds(0.1);
  EXPECT_TRUE(rig.run(1, [](MotionSample& s) { s.position += 1.0; }));
}

TEST(PlausibilityMonitor, ANegatedVelocityIsFoundWithinTheTolerance) {
  for (const double speed : {0.1, 0.5, 1.2}) {
    MonitorRig rig;
    ASSERT_FALSE(rig.run(100));
    rig.v = speed;
    ASSERT_TRUE(rig.run(2000, [](MotionSample& s) { s.velocity = -s.velocity; })) << speed;
    EXPECT_EQ(rig.found.reason, Implausibility::kVelocity);
    EXPECT_LT(rig.q, 0.02) << speed;  // (1.2 · 0.018 + 4e-5) ÷ 1.75, and what is forgotten meanwhile
  }
}

TEST(PlausibilityMonitor, AVelocityThatIsNoiseIsFound) {
  MonitorRig rig;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> garbage(-20.0, 20.0);
  rig.v = 0.5;
  ASSERT_TRUE(rig.run(500, [&](MotionSample& s) { s.velocity = garbage(random); }));
  EXPECT_EQ(rig.found.reason, Implausibility::kVelocity);
  EXPECT_LT(rig.ticks, 25) << "50 ms";
}

TEST(PlausibilityMonitor, AStuckEncoderIsFoundByItsVelocityOrByTheTorque) {
  MonitorRig velocity_told;
  velocity_told.v = 0.5;
  ASSERT_TRUE(velocity_told.run(500, [](MotionSample& s) { s.position = 0.0; }));
  EXPECT_EQ(velocity_told.found.reason, Implausibility::kVelocity);
  EXPECT_LT(velocity_told.q, 0.03);

  MonitorRig nothing_told;
  const auto stuck = [](MotionSample& s) { s.position = s.velocity = 0.0; };
  ASSERT_FALSE(nothing_told.run(500, stuck)) << "stands still";
  nothing_told.torque = 21.0;
  ASSERT_TRUE(nothing_told.run(20, stuck));
  EXPECT_LE(nothing_told.ticks, 8) << "16 ms";
  EXPECT_EQ(nothing_told.found.reason, Implausibility::kStuck);
}

// A step of torque moves an inertia by less than a count in the first cycles.
TEST(PlausibilityMonitor, AJointThatBeginsToMoveIsBelieved) {
  MonitorRig rig;
  ASSERT_FALSE(rig.run(100));
  rig.torque = 90.0;
  for (int i = 0; i < 50; ++i) {
    rig.v += 2.0 * kJoint.period_s;
    ASSERT_FALSE(rig.run(1)) << i;
  }
}

// What does not move freely may stand still under any torque: a brake holds it.
TEST(PlausibilityMonitor, ABrakeIsNoStuckEncoder) {
  MonitorRig rig;
  rig.torque = 90.0;
  EXPECT_FALSE(rig.run(100, [](MotionSample& s) { s.moves_freely = false; }));
  rig.torque = 0.0;
  EXPECT_FALSE(rig.run(100, [](MotionSample& s) { s.moves_freely = false; }));
}

// An encoder with a count of 1 mrad does not show how a joint yields to a torque.
TEST(PlausibilityMonitor, ACoarseEncoderMayStandStill) {
  MonitorRig rig;
  PlausibilityParameters coarse = kJoint;
  coarse.count = 1e-3;
  rig.monitor = PlausibilityMonitor(coarse);
  rig.torque = 0.0;
  rig.run(10);
  rig.torque = 90.0;
  EXPECT_FALSE(rig.run(100));
}

TEST(PlausibilityMonitor, SpeedIsLimitedByThePositionWhateverTheVelocity) {
  MonitorRig rig;
  rig.v = 1.7;  // within 1.5 · 1.2 = 1.8
  ASSERT_FALSE(rig.run(1000));
  rig.v = 2.0;
  ASSERT_TRUE(rig.run(1000));
  EXPECT_EQ(rig.found.reason, Implausibility::kOverspeed);
  EXPECT_LE(rig.ticks, 20) << "40 ms";
  EXPECT_NEAR(rig.found.allowed, 1.8, 0.01);
}

TEST(PlausibilityMonitor, SR12_FeedbackThatIsFrozenWithItsTorqueIsFound) {
  const struct {
    TargetKind kind;
    std::function<double(double)> target;  // of the time
  } kTargets[] = {{TargetKind::kTorque, [](double t) { return 100.0 * t; }},
                  {TargetKind::kPosition, [](double t) { return 0.5 * t; }},
                  {TargetKind::kVelocity, [](double) { return 0.5; }}};
  for (const auto& [kind, target] : kTargets) {
    MonitorRig rig;
    rig.sample.target_kind = kind;
    double t = 0.0;
    const auto frozen_for = [&](double for_s) {
      for (const double end = t + for_s; t < end; t += kJoint.period_s) {
        rig.sample.target = target(t);
        if (rig.run(1)) return true;
      }
      return false;
    };
    EXPECT_TRUE(frozen_for(0.5));
    EXPECT_EQ(rig.found.reason, Implausibility::kFrozen);
    EXPECT_LT(t, 0.35);

    MonitorRig limited;  // a drive at its limit does not follow, and reports the limit
    limited.sample.target_kind = kind;
    limited.sample.limited = true;
    std::swap(rig, limited);
    t = 0.0;
    EXPECT_FALSE(frozen_for(0.5));
  }
}

TEST(PlausibilityMonitor, AJointThatAnswersItsTargetByATorqueAloneIsNotFrozen) {
  MonitorRig rig;  // pressed against a wall
  rig.sample.target_kind = TargetKind::kPosition;
  for (int i = 0; i < 500; ++i) {
    rig.sample.target = 0.001 * i;
    rig.torque = 0.001 * i * 10.0;
    rig.q = rig.torque / 1e5;
    ASSERT_FALSE(rig.run(1)) << i;
  }
}

TEST(PlausibilityMonitor, SR12_AMotionAwayFromItsTargetIsFound) {
  for (const TargetKind kind : {TargetKind::kPosition, TargetKind::kVelocity}) {
    MonitorRig rig;
    rig.sample.target_kind = kind;
    rig.v = -0.6;
    bool found = false;
    for (int i = 0; i < 500 && !found; ++i) {
      rig.sample.target = kind == TargetKind::kPosition ? 0.6 * kJoint.period_s * i : 0.6;
      found = rig.run(1);
    }
    ASSERT_TRUE(found);
    EXPECT_EQ(rig.found.reason, Implausibility::kContrary);
    EXPECT_LT(std::abs(rig.q), 0.33) << "a quarter of a second of the greatest speed";
  }
}

// A joint at its greatest speed needs time to reverse.
TEST(PlausibilityMonitor, AJointThatTurnsBackAtItsAccelerationIsBelieved) {
  for (const TargetKind kind : {TargetKind::kPosition, TargetKind::kVelocity}) {
    MonitorRig rig;
    rig.sample.target_kind = kind;
    double wanted = 1.2, reference = 0.0;
    for (int i = 0; i < 5000; ++i) {
      if (i % 400 == 399) wanted = -wanted;
      reference += wanted * kJoint.period_s;
      rig.v += std::clamp(wanted - rig.v, -5.0 * kJoint.period_s, 5.0 * kJoint.period_s);
      rig.torque = 0.01 * i;
      rig.sample.target = kind == TargetKind::kPosition ? reference : wanted;
      ASSERT_FALSE(rig.run(1)) << i << ": " << static_cast<int>(rig.found.reason) << ' ' << rig.found.seen;
    }
  }
}

}  // namespace
}  // namespace phantom::can
