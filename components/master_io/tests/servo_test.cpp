#include "components/master_io/servo.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "components/master_io/tests/fixture.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::master_io {
namespace {

using teleop::LinkState;
constexpr double kServoPeriod_s = 0.001;

/// The servo with a simulated device and a slave that follows perfectly.
struct SimulatedRig : ServoRig {
  explicit SimulatedRig(const Config& config = shipped_config())
      : device(config, shipped_arm().home), servo(config, shipped_arm().home, device, inbox, 1, stops) {
    slave.position = shipped_arm().home;
  }

  void run(double duration_s) {
    for (double t = 0; t < duration_s; t += kServoPeriod_s) {
      now_ns += core::from_seconds(kServoPeriod_s);
      if (heard) {
        renew(slave);
        renew(drag);
        slave.position = stuck_at                                 ? *stuck_at
                         : last.outputs.state == LinkState::kInit ? shipped_arm().home
                                                                  : last.position;
        drag.round_trip_s = 0.0007;
        inbox.slave.write(slave);
        if (drag_heard) inbox.drag.write(drag);
      }
      tick(servo, kServoPeriod_s);
      double power_W = 0.0;
      for (std::size_t j = 0; j < 7; ++j) power_W += last.percept_torque_Nm[j] * last.velocity[j];
      greatest_power_W = std::max(greatest_power_W, power_W);
    }
  }

  SimulatedDevice device;
  Servo servo;
  bool drag_heard = true;
  std::optional<core::JointArray> stuck_at;  // where something keeps the slave from following
  double greatest_power_W = -1e9;
};

TEST(MasterServo, StaysHomeWhileNobodyIsThere) {
  SimulatedRig bench;
  bench.heard = false;
  bench.run(3.0);
  EXPECT_EQ(bench.last.outputs.state, LinkState::kInit);
  EXPECT_EQ(bench.last.reach, -1);
  for (std::size_t j = 0; j < 7; ++j) EXPECT_NEAR(bench.last.position[j], shipped_arm().home[j], 1e-3);
}

TEST(MasterServo, ReachesBeginOnceCoupledAndAlternateThePercept) {
  SimulatedRig bench;
  bench.run(20.0);
  const auto& log = bench.servo.reaches();
  ASSERT_GE(log.size(), 3U);
  EXPECT_TRUE(log[0].percept);
  EXPECT_FALSE(log[1].percept);
  EXPECT_EQ(log[0].index, log[1].index);
  EXPECT_NE(log[2].index, log[1].index);
  EXPECT_GT(log[0].peak_percept_Nm, 0.01);
  EXPECT_LE(bench.greatest_power_W, 1e-12) << "published torque times published velocity";
}

TEST(MasterServo, ASlaveThatIsHeldBackIsMetWhereItIsAndCoupledAgain) {
  SimulatedRig bench;
  bench.run(4.0);
  ASSERT_EQ(bench.last.outputs.state, LinkState::kCoupled);
  bench.heard = false;
  bench.run(0.5);
  bench.stuck_at = bench.last.position;
  (*bench.stuck_at)[1] += 0.1;
  bench.slave.contact = true;
  bench.heard = true;
  bench.run(1.5);
  EXPECT_EQ(bench.last.outputs.state, LinkState::kReady) << "it may come by itself";
  EXPECT_TRUE(bench.last.outputs.slave_touches);
  EXPECT_GT(std::abs(bench.last.position[1] - (*bench.stuck_at)[1]), 0.05);
  for (int i = 0; i < 80 && bench.last.outputs.state != LinkState::kCoupled; ++i) bench.run(0.05);
  EXPECT_EQ(bench.last.outputs.state, LinkState::kCoupled);
}

// Tries master_io: slave silent
TEST(MasterServo, LosingTheSlaveStopsTheReachWhereItIs) {
  SimulatedRig bench;
  bench.run(2.5);
  ASSERT_EQ(bench.last.reach, 0);
  bench.heard = false;
  bench.run(0.5);
  EXPECT_EQ(bench.last.outputs.state, LinkState::kDegraded);
  EXPECT_EQ(bench.last.outputs.motor_Nm, core::JointArray{});
  const auto there = bench.last.position;
  bench.run(1.0);
  for (std::size_t j = 0; j < 7; ++j) EXPECT_NEAR(bench.last.position[j], there[j], 2e-3);
}

// Tries master_io: phantom_sensing silent
TEST(MasterServo, ThePerceptEndsWhenThePhantomFallsSilent) {
  const Config config = shipped_config();
  SimulatedRig bench(config);
  const auto greatest_Nm = [&bench] {
    double most_Nm = 0.0;
    for (const double torque_Nm : bench.last.percept_torque_Nm)
      most_Nm = std::max(most_Nm, std::abs(torque_Nm));
    return most_Nm;
  };
  for (int i = 0; i < 5000 && greatest_Nm() < 0.05; ++i) bench.run(kServoPeriod_s);
  ASSERT_GE(greatest_Nm(), 0.05);
  bench.drag_heard = false;
  bench.run(config.percept_staleness_s + config.percept.ramp_down_s + 3 * kServoPeriod_s);
  EXPECT_EQ(greatest_Nm(), 0.0);
  EXPECT_EQ(bench.last.outputs.state, LinkState::kCoupled);
}

// Tries master_io: answering what is longer ago
TEST(MasterServo, ASlaveThatAnswersWhatIsLongAgoIsLost) {
  SimulatedRig bench;
  const double limit_s = shipped_config().link.round_trip_limit_s;
  for (int i = 0; i < 500; ++i) {
    bench.slave.answers_ns = bench.now_ns - core::from_seconds(0.8 * limit_s);
    bench.run(kServoPeriod_s);
  }
  ASSERT_EQ(bench.last.outputs.state, LinkState::kCoupled);
  bench.run(0.2 * limit_s + 2 * kServoPeriod_s);  // its samples go on coming, their answers do not get newer
  EXPECT_EQ(bench.last.outputs.state, LinkState::kDegraded);
}

TEST(MasterServo, RoundTripsAreToldOncePerNewDragField) {
  SimulatedRig bench;
  bench.run(0.1);
  EXPECT_EQ(bench.last.round_trip_s, 0.0007);
  bench.heard = false;
  bench.run(0.002);
  EXPECT_EQ(bench.last.round_trip_s, -1.0);
}

TEST(MasterServo, SameInputsSameOutputs) {
  SimulatedRig one, two;
  one.run(6.0);
  two.run(6.0);
  EXPECT_EQ(one.last.position, two.last.position);
  EXPECT_EQ(one.last.outputs.motor_Nm, two.last.outputs.motor_Nm);
}

TEST(MasterServo, TheTickUsesNoHeap) {
  SimulatedRig bench;
  const test::HeapGuard guard;
  bench.run(15.0);
}

}  // namespace
}  // namespace phantom::master_io
