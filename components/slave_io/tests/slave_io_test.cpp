#include "components/slave_io/slave_io.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "components/slave_io/session.hpp"
#include "components/slave_io/simulated_arm.hpp"
#include "components/slave_io/tests/slave_rig.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::slave_io {
namespace {

using slave_rig::kDt;
using slave_rig::kJoints;
using slave_rig::ServoRig;
using teleop::LinkState;

TEST(SlaveIo, HoldsAtHomeUntilAMasterIsHeard) {
  ServoRig bench;
  bench.heard = false;
  bench.run(0.5);
  EXPECT_EQ(bench.state(), LinkState::kInit);
  EXPECT_EQ(bench.last.master_echo.sequence_number, 0U);
  for (std::size_t j = 0; j < kJoints; ++j) EXPECT_NEAR(bench.last.position[j], shipped_arm().home[j], 1e-4);
}

TEST(SlaveIo, CouplesWhenAlignedAndFollows) {
  ServoRig bench;
  bench.run(0.5);
  ASSERT_EQ(bench.state(), LinkState::kCoupled);
  for (int i = 0; i < 1000; ++i) {
    for (std::size_t j = 1; j < kJoints; ++j)
      bench.master.position[j] += 0.0002, bench.master.velocity[j] = 0.2;
    bench.run(kDt);
  }
  EXPECT_EQ(bench.last.master_echo.sequence_number, bench.master.stamp.sequence_number);
  for (std::size_t j = 1; j < kJoints; ++j)
    EXPECT_NEAR(bench.last.position[j], bench.master.position[j], 0.02) << j;
  for (std::size_t j = 1; j < kJoints; ++j) EXPECT_NEAR(bench.last.velocity[j], 0.2, 0.03) << j;
}

// Master samples that come at uneven times describe one smooth motion, and the reference must be that motion.
TEST(SlaveIo, TheReferenceDoesNotShakeWithThePhaseOfTheSamples) {
  const auto start_q = shipped_arm().home;
  SlaveIo slave(shipped_arm().arm, shipped_config(), start_q, teleop::StopLatch(1, {}));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> age_s(0.0, 0.002);
  constexpr double kSpeed = 0.4;
  double t_s = 0.0, greatest = 0.0;
  for (int i = 0; i < 3000; ++i, t_s += kDt) {
    SlaveInputs in;
    in.partner_age_s = age_s(random);
    const double moved_s = std::max(0.0, t_s - 1.0);
    in.master.state = LinkState::kCoupled;
    in.master.position = start_q;
    in.position = start_q;
    if (moved_s > 0.0) {
      in.master.position[3] += kSpeed * (moved_s - in.partner_age_s);
      in.master.velocity[3] = kSpeed;
      in.position[3] += kSpeed * moved_s;
    }
    const SlaveOutputs out = slave.step(in, kDt);
    if (moved_s > 0.1) {
      ASSERT_EQ(out.state, LinkState::kCoupled);
      greatest = std::max(greatest, std::abs(out.reference[3] - (start_q[3] + kSpeed * moved_s)));
    }
  }
  EXPECT_LT(greatest, 1e-9) << "without the hold it would be up to " << kSpeed * 0.002;
}

TEST(SlaveIo, SR06_SR10_ComesSlowlyToANearMasterBeforeCouplingAndWaitsForAFarOne) {
  ServoRig bench;
  bench.master.position[3] += 0.3;
  bench.master.state = LinkState::kReady;
  double before = bench.servo.outbox.read(bench.last) ? 0 : shipped_arm().home[3];
  double fastest = 0.0;
  for (int i = 0; i < 5000 && bench.state() != LinkState::kAligned; ++i) {
    bench.run(kDt);
    fastest = std::max(fastest, std::abs(bench.last.position[3] - before) / kDt);
    before = bench.last.position[3];
  }
  EXPECT_EQ(bench.state(), LinkState::kAligned) << "not coupled: the master is only ready";
  EXPECT_LT(fastest, 0.3);
  ServoRig far;
  far.master.position[3] += 1.0;
  far.run(3.0);
  EXPECT_EQ(far.state(), LinkState::kReady);
  EXPECT_NEAR(far.last.position[3], shipped_arm().home[3], 0.01);
  EXPECT_EQ(far.last.outputs.far_joint, 3);
  EXPECT_EQ(bench.last.outputs.far_joint, -1);
}

TEST(SlaveIo, WhatKeepsItFromComingIsNotPressedHarder) {
  const Config config = shipped_config();
  const core::JointArray held = shipped_arm().home;
  SlaveIo slave(shipped_arm().arm, config, held, teleop::StopLatch(1, {}));
  SlaveInputs in;
  in.partner_age_s = 0.001;
  in.master.state = LinkState::kReady;
  in.master.position = in.position = held;
  in.master.position[3] += 0.3;
  SlaveOutputs out;
  double most_Nm = 0.0;
  for (int i = 0; i < 10000; ++i) {  // the arm cannot move
    out = slave.step(in, kDt);
    most_Nm = std::max(most_Nm, std::abs(out.torque.loop_Nm[3]));
  }
  EXPECT_EQ(out.state, LinkState::kReady);
  const double step = config.align_speed[3] * kDt;
  EXPECT_NEAR(out.reference[3] - held[3], config.align_tolerance[3], 2 * step);
  EXPECT_LE(most_Nm, config.gains[3].k_p * (config.align_tolerance[3] + 2 * step));
  in.master.position[3] = held[3] - 0.3;  // away from it the arm goes at once
  for (int i = 0; i < 1000; ++i) out = slave.step(in, kDt);
  EXPECT_LT(out.reference[3], held[3]);
  in.master.position[3] = held[3] + 0.5 * config.align_tolerance[3];  // or the master comes
  in.master.state = LinkState::kAligned;
  for (int i = 0; i < 1000; ++i) out = slave.step(in, kDt);
  EXPECT_EQ(out.state, LinkState::kCoupled);
}

// Tries slave_io: master silent
TEST(SlaveIo, SR07_StaleMasterMeansHoldingThePositionWithinTheLimit) {
  ServoRig bench;
  bench.run(0.5);
  for (int i = 0; i < 200; ++i) {
    bench.master.position[2] -= 0.0005;
    bench.master.velocity[2] = -0.5;
    bench.run(kDt);
  }
  bench.heard = false;
  bench.run(shipped_config().link.staleness_s + 2 * kDt);
  ASSERT_EQ(bench.state(), LinkState::kDegraded);
  const auto reference = bench.last.outputs.reference;
  bench.run(1.0);
  EXPECT_EQ(bench.state(), LinkState::kDegraded);
  EXPECT_EQ(bench.last.outputs.reference, reference);
  for (std::size_t j = 0; j < kJoints; ++j) {
    EXPECT_NEAR(bench.last.position[j], reference[j], 0.01);
    EXPECT_NEAR(bench.last.velocity[j], 0.0, 1e-3);
  }
  bench.heard = true;  // back, at rest, near: it recovers through an aligned pose
  bench.master.velocity = {};
  bench.run(3.0);
  EXPECT_EQ(bench.state(), LinkState::kCoupled);
}

TEST(SlaveIo, SR04_EmergencyStopHoldsUntilReset) {
  ServoRig bench;
  bench.run(0.5);
  bench.inbox.stops.stop();
  bench.run(0.01);
  EXPECT_EQ(bench.state(), LinkState::kStopped);
  EXPECT_EQ(bench.last.stop_requests, 1U);
  EXPECT_EQ(bench.stops.record, bench.last.outputs.stop) << "it is kept";
  bench.master.position[4] += 0.4;
  bench.run(1.0);
  EXPECT_EQ(bench.state(), LinkState::kStopped);
  EXPECT_NEAR(bench.last.position[4], shipped_arm().home[4], 0.01);
  bench.master.position[4] -= 0.4;
  bench.inbox.stops.reset({.own = bench.stops.record.id + 1});
  bench.run(0.5);
  EXPECT_EQ(bench.state(), LinkState::kStopped) << "the reset named another stop";
  bench.inbox.stops.reset({.own = bench.stops.record.id});
  bench.run(0.5);
  EXPECT_EQ(bench.state(), LinkState::kCoupled);
  EXPECT_EQ(bench.stops.record, teleop::StopRecord{});
  teleop::StopRequests::Result result;
  for (const bool released : {false, true}) {
    ASSERT_TRUE(bench.inbox.stops.take_result(result));
    EXPECT_EQ(result.released, released);
  }
}

// kill -9 and a new process: what was kept is in force before anything moves.
// Tries slave_io: slave_io dies
TEST(SlaveIo, SR03_AStopThatWasKeptIsInForceFromTheFirstTick) {
  ServoRig before;
  before.run(0.5);
  before.inbox.stops.stop();
  before.run(0.01);
  teleop::MemoryStopStore kept = before.stops;
  Inbox inbox;
  SimulatedArm arm(shipped_arm(), shipped_config(), before.floor);
  Servo servo(shipped_arm(), shipped_config(), arm, inbox, 2, kept);
  before.master.position[4] += 0.2;
  SlaveReport last;
  for (int ms = 0; ms < 2000; ++ms) {
    before.now_ns += core::from_seconds(kDt);
    before.master.received_ns = before.now_ns;
    inbox.master.write(before.master);
    servo.tick(kDt, before.now_ns);
    ASSERT_TRUE(servo.outbox.read(last));
    ASSERT_EQ(last.outputs.state, LinkState::kStopped);
    ASSERT_EQ(last.outputs.stop, before.stops.record);
    ASSERT_FALSE(last.outputs.power);
    ASSERT_NEAR(last.position[4], shipped_arm().home[4], 1e-3);
  }
}

// Tries slave_io: master stopped
TEST(SlaveIo, AMasterThatIsStoppedStopsTheSlave) {
  ServoRig bench;
  bench.run(0.5);
  ASSERT_EQ(bench.state(), LinkState::kCoupled);
  bench.master.state = LinkState::kStopped;
  bench.master.stop.id = 99;
  bench.master.position[4] += 0.2;  // it coasts
  bench.run(0.001);
  EXPECT_EQ(bench.state(), LinkState::kStopped);
  EXPECT_EQ(bench.last.outputs.stop.cause, teleop::StopCause::kPartner);
  bench.run(1.0);
  EXPECT_NEAR(bench.last.position[4], shipped_arm().home[4], 0.01) << "the slave does not go after it";
  bench.inbox.stops.reset({.own = bench.stops.record.id, .partner = 99});
  bench.run(1.0);
  EXPECT_EQ(bench.state(), LinkState::kInit) << "nothing is aligned with a master that is stopped";
}

// Whatever a master commands: positions, speeds and torques stay within the arm's limits.
TEST(SlaveIo, SR12_LimitsHoldWhateverArrives) {
  ServoRig bench;
  bench.run(0.5);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> wild(-50, 50);
  const auto config = shipped_config();
  double fastest = 0.0;
  for (int k = 0; k < 200; ++k) {
    for (std::size_t j = 0; j < kJoints; ++j) {
      bench.master.position[j] = wild(random);
      bench.master.velocity[j] = wild(random);
    }
    for (int i = 0; i < 20; ++i) {
      bench.run(kDt);
      for (std::size_t j = 0; j < kJoints; ++j) {
        const auto& joint = shipped_arm().arm.joints()[j];
        ASSERT_GE(bench.last.outputs.reference[j], joint.lower);
        ASSERT_LE(bench.last.outputs.reference[j], joint.upper);
        ASSERT_GE(bench.last.position[j], joint.lower - 1e-5);
        ASSERT_LE(bench.last.position[j], joint.upper + 1e-5);
        fastest = std::max(fastest, std::abs(bench.last.velocity[j]) / joint.max_speed);
        ASSERT_LE(std::abs(bench.last.outputs.torque.drive_Nm[j]), config.gains[j].torque_limit);
      }
    }
  }
  // A joint at its speed limit loses its torque a few samples (velocity filter) later, and what the other
  // joints do drives it, too.
  EXPECT_LT(fastest, 1.4);
  RecordProperty("fastest", std::to_string(fastest));
}

TEST(SlaveIo, SR11_NumbersThatAreNoneChangeNothing) {
  const auto& model = shipped_arm();
  SlaveIo controller(model.arm, shipped_config(), model.home, teleop::StopLatch(1, {}));
  SlaveInputs in;
  in.position = model.home;
  in.master.position = model.home;
  in.master.state = LinkState::kCoupled;
  in.partner_age_s = 0.001;
  for (int i = 0; i < 500; ++i) controller.step(in, kDt);
  in.master.position[1] = std::nan("");
  in.master.velocity[2] = std::numeric_limits<double>::infinity();
  const auto out = controller.step(in, kDt);
  for (std::size_t j = 0; j < kJoints; ++j) {
    EXPECT_EQ(out.reference[j], model.home[j]);
    EXPECT_TRUE(std::isfinite(out.torque.drive_Nm[j]));
  }
}

/// A controller that was coupled at home, and its inputs in the last tick.
struct CoupledSlave {
  SlaveIo controller{shipped_arm().arm, shipped_config(), shipped_arm().home, teleop::StopLatch(1, {})};
  SlaveInputs in;
  SlaveOutputs out;
  CoupledSlave() {
    in.position = in.master.position = shipped_arm().home;
    in.master.state = LinkState::kCoupled;
    in.partner_age_s = 0.001;
    for (int i = 0; i < 500; ++i) out = controller.step(in, kDt);
    EXPECT_EQ(out.state, LinkState::kCoupled);
  }
};

TEST(SlaveIo, WhileTheDrivesDoNotFollowTheReferenceIsWhereTheArmIs) {
  CoupledSlave slave;
  slave.in.drives_operational = false;
  for (int i = 0; i < 200; ++i) {  // somebody moves it, or it sinks
    slave.in.position[3] += 0.001;
    slave.out = slave.controller.step(slave.in, kDt);
    ASSERT_EQ(slave.out.reference, slave.in.position);
    ASSERT_NE(slave.out.state, LinkState::kCoupled);
  }
  slave.in.drives_operational = true;
  slave.out = slave.controller.step(slave.in, kDt);
  EXPECT_EQ(slave.out.torque.loop_Nm[3], 0.0) << "nothing jumps when they do again";
}

// Tries slave_io: the master answers another slave_io
TEST(SlaveIo, AMasterThatAnswersAnotherIsNotCoupledWithAndThatIsSaid) {
  CoupledSlave slave;
  EXPECT_FALSE(slave.out.peer_bound_elsewhere);
  slave.in.master.echoes_other_session = true;
  slave.out = slave.controller.step(slave.in, kDt);
  EXPECT_EQ(slave.out.state, LinkState::kDegraded);
  EXPECT_TRUE(slave.out.peer_bound_elsewhere);
  EXPECT_EQ(sentence(slave.out, shipped_arm().arm), "the master answers another slave_io: holding position");
  EXPECT_EQ(teleop::component_state(slave.out), core::ComponentState::kDegraded);
  EXPECT_EQ(slave.out.reference, slave.in.position) << "it holds";
  SlaveIo fresh(shipped_arm().arm, shipped_config(), shipped_arm().home, teleop::StopLatch(1, {}));
  for (int i = 0; i < 500; ++i) slave.out = fresh.step(slave.in, kDt);
  EXPECT_EQ(slave.out.state, LinkState::kInit);
  EXPECT_EQ(sentence(slave.out, shipped_arm().arm), "the master answers another slave_io: waiting");
}

// Something holds the arm away from where it was led to: without its master it does not go on pressing.
TEST(SlaveIo, WhenItBeginsToHoldItHoldsWhereItIs) {
  CoupledSlave slave;
  slave.in.master.position[3] += 0.05;  // the arm does not come
  for (int i = 0; i < 500; ++i) slave.out = slave.controller.step(slave.in, kDt);
  ASSERT_GT(std::abs(slave.out.torque.loop_Nm[3]), 0.1);
  slave.in.partner_age_s = 1.0;
  slave.out = slave.controller.step(slave.in, kDt);
  EXPECT_EQ(slave.out.state, LinkState::kDegraded);
  EXPECT_EQ(slave.out.reference, slave.in.position);
  EXPECT_EQ(slave.out.torque.loop_Nm[3], 0.0);
}

TEST(SlaveIo, ALateSampleIsBridgedForThreeMillisecondsAtMost) {
  CoupledSlave slave;
  slave.in.master.velocity[3] = 0.5;
  for (const double age_s : {0.001, 0.003, 0.010, 0.050}) {
    slave.in.partner_age_s = age_s;
    for (int i = 0; i < 50; ++i) slave.out = slave.controller.step(slave.in, kDt);
    ASSERT_EQ(slave.out.state, LinkState::kCoupled) << "not stale yet";
    EXPECT_NEAR(slave.out.reference[3] - shipped_arm().home[3], 0.5 * std::min(age_s, 0.003), 1e-12) << age_s;
  }
}

TEST(SlaveIo, AMasterThatAnswersWhatIsLongAgoIsLost) {
  ServoRig bench;
  const double limit_s = shipped_config().link.round_trip_limit_s;
  for (int i = 0; i < 500; ++i) {
    bench.master.answers_ns = bench.now_ns - core::from_seconds(0.8 * limit_s);
    bench.run(kDt);
  }
  ASSERT_EQ(bench.state(), LinkState::kCoupled);
  bench.run(0.2 * limit_s + 2 * kDt);  // its samples go on coming, their answers do not get newer
  EXPECT_EQ(bench.state(), LinkState::kDegraded);
}

/// Counts what a tick asks of an arm.
struct CountedArm final : ArmDriver {
  explicit CountedArm(bool simulated) : makes_up(simulated) { sensed.position = shipped_arm().home; }
  const ArmSense& sense() noexcept override { return sensed; }
  void move(const ArmDemand&, double dt_s, core::Nanoseconds) noexcept override {
    ++moves;
    passed_s += dt_s;
  }
  void end(core::Nanoseconds) noexcept override {}
  void fill(messages::SlaveState&) const noexcept override {}
  bool makes_up_periods() const noexcept override { return makes_up; }
  core::ActuatorHealth health() override { return {}; }
  ArmSense sensed;
  bool makes_up;
  int moves = 0;
  double passed_s = 0.0;
};

// Tries slave_io: periods missed by the host
TEST(SlaveIo, MissedPeriodsCostABoundedNumberOfStepsAndRealDrivesGetOneCommand) {
  for (const bool simulated : {true, false}) {
    Inbox inbox;
    CountedArm arm(simulated);
    teleop::MemoryStopStore stops;
    Servo servo(shipped_arm(), shipped_config(), arm, inbox, 1, stops);
    const auto tick = [&](double dt_s) {
      arm.moves = 0;
      arm.passed_s = 0.0;
      servo.tick(dt_s, 1'000'000'000);
    };
    tick(0.005);
    EXPECT_EQ(arm.moves, simulated ? 5 : 1);
    EXPECT_NEAR(arm.passed_s, 0.005, 1e-12);
    for (const double frozen_s : {30.0, 3e6, 1e12}) {
      tick(frozen_s);
      EXPECT_EQ(arm.moves, simulated ? teleop::kMaxMadeUp : 1);
      EXPECT_NEAR(arm.passed_s, teleop::kMaxMadeUp * kDt, 1e-12);
    }
  }
}

TEST(SlaveIo, MissedPeriodsAreMadeUpForWithinBounds) {
  ServoRig bench;
  bench.run(0.5);
  bench.servo.tick(0.005, bench.now_ns += 5'000'000);
  bench.servo.tick(
      30.0, bench.now_ns += 30'000'000'000);  // frozen for half a minute: one bounded tick, then degraded
  bench.servo.outbox.read(bench.last);
  EXPECT_EQ(bench.state(), LinkState::kDegraded);
}

TEST(SlaveIo, TheTickUsesNoHeap) {
  ServoRig bench;
  bench.run(0.3);
  const test::HeapGuard guard;
  for (int i = 0; i < 500; ++i) {
    bench.master.position[3] += 0.0003;
    bench.run(kDt);
  }
  bench.heard = false;
  bench.run(0.2);
}

}  // namespace
}  // namespace phantom::slave_io
