// The master's servo with drives on a bus in this process, on a clock of the test's own: repeats exactly.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/core/errors.hpp"
#include "components/master_io/servo.hpp"
#include "components/master_io/tests/fixture.hpp"
#include "components/simulated_drive/tests/drive_like.hpp"
#include "tests/support/heap_guard.hpp"
#include "tests/support/local_bus.hpp"

namespace phantom::master_io {
namespace {

using teleop::LinkState;
using testing::HasSubstr;
constexpr std::size_t kBusJoints = 7;

// The shipped file with a drive for every joint; `more` stands in the first joint's.
std::string with_drives(const std::string& more = "") {
  std::string yaml = test::text_of(kShipped);
  yaml.replace(yaml.find("driver: sim"), 11, "driver: can");
  yaml.replace(yaml.find("rate_Hz: 1000"), 13, "rate_Hz: 500");
  yaml +=
      "\ncan:\n  on_fault: coast\n  boot_timeout_s: 0.2\n  heartbeat_timeout_s: 0.2\n  buses: [{address: \"user:a\"}, {address: "
      "\"user:b\"}]\n  drives:\n";
  for (std::size_t j = 0; j < kBusJoints; ++j) {
    yaml += "    " + shipped_arm().arm.joints()[j].name + ": {bus: " + std::to_string(j % 2) +
            ", node: " + std::to_string(j + 1) +
            ", counts_per_turn: 65536, gear_ratio: 5, torque_constant_Nm_per_A: 0.5, rated_current_A: 4" +
            (j == 0 ? ", travel_per_turn_m: 0.2" + more : "") + "}\n";
  }
  return yaml;
}
Config can_config(const std::string& more = "") {
  return load_config(test::new_file(with_drives(more)), hot_cell().file, shipped_arm().arm,
                     shipped_arm().home, {});
}

// A slave that follows perfectly, drag that is everywhere the same, and a hand that pushes joint 4.
struct Bench : ServoRig {
  Bench() {
    std::vector<std::unique_ptr<can::CanBus>> ports;
    for (auto& bus : buses) ports.push_back(bus.connect("master_io"));
    const auto& axes = config.can->group.axes;
    for (std::size_t j = 0; j < kBusJoints; ++j) {
      simulated_drive::DriveOptions o =
          simulated_drive::drive_like(axes[j], shipped_arm().home[j], config.device.joints[j].inertia);
      o.motor.load_Nm = j == 3 ? push_Nm : 0.0;
      drives.push_back(
          std::make_unique<simulated_drive::SimulatedDrive>(o, buses[axes[j].bus].connect(axes[j].name)));
    }
    device = std::make_unique<CanDevice>(config, std::move(ports));
    servo = std::make_unique<Servo>(config, shipped_arm().home, *device, inbox, 1, stops);
  }
  void tick() {
    now_ns += period_ns;
    renew(slave);
    renew(drag);
    if (published > 0) slave.position = last.position;
    inbox.slave.write(slave);
    inbox.drag.write(drag);
    {
      const test::HeapGuard guard;
      ServoRig::tick(*servo, config.period_s);
    }
    pass();
  }
  /// The servo does not run for a period in which it should have; the drives do.
  void miss() {
    now_ns += period_ns;
    pass();
  }
  void pass() {
    for (int part = 1; part <= 4; ++part) {
      for (auto& bus : buses) bus.advance_to(now_ns + period_ns * part / 4);
      for (auto& drive : drives) drive->step(now_ns + period_ns * part / 4);
    }
  }
  bool reaches(LinkState wanted, double most_s = 10.0) {
    return ServoRig::reaches(wanted, config.period_s, most_s, [this] { tick(); });
  }

  static constexpr double push_Nm = 0.05;
  Config config = can_config();
  std::array<simulation::LocalBus, 2> buses{simulation::LocalBus({.bit_rate = 1e6}),
                                            simulation::LocalBus({.bit_rate = 1e6})};
  std::vector<std::unique_ptr<simulated_drive::SimulatedDrive>> drives;
  std::unique_ptr<CanDevice> device;
  std::unique_ptr<Servo> servo;
  core::Nanoseconds period_ns = core::from_seconds(config.period_s);
};

TEST(CanDevice, RendersDragOnTheHandThroughItsDrivesAndItsEncodersAreTheMastersJoints) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.device->health().message;
  for (int i = 0; i < 1500; ++i) bench.tick();
  ASSERT_EQ(bench.last.outputs.state, LinkState::kCoupled);
  EXPECT_NEAR(bench.last.position[3], bench.drives[3]->motor().joint_rad(), 0.01);
  EXPECT_GT(bench.last.velocity[3], 0.0) << "the hand pushes";
  EXPECT_LT(bench.last.percept_torque_Nm[3], 0.0) << "drag against the motion";
  EXPECT_NEAR(bench.last.outputs.motor_Nm[3], -Bench::push_Nm, 0.02) << "at the end as strong as the push";
  const double exerted_Nm = bench.drives[3]->torque_mille() * 1e-3 * 2.0 * 5.0;
  EXPECT_NEAR(exerted_Nm, bench.last.outputs.motor_Nm[3], 0.012) << "the drive's steps of one per mille";
  EXPECT_EQ(bench.last.reach, -1) << "a person makes no scripted reaches";
}

// Tries master_io: a drive of a master on CAN in fault
TEST(CanDevice, AFaultTakesTheTorquesUntilAReset) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.device->health().message;
  bench.drives[4]->trip(0x2310);
  ASSERT_TRUE(bench.reaches(LinkState::kStopped, 0.05));
  EXPECT_THAT(bench.device->health().message, HasSubstr("coast until a reset"));
  for (int i = 0; i < 500; ++i) bench.tick();
  EXPECT_EQ(bench.last.outputs.state, LinkState::kStopped);
  for (const double torque_Nm : bench.last.outputs.motor_Nm) EXPECT_EQ(torque_Nm, 0.0);
  bench.inbox.stops.reset({.own = bench.stops.record.id});
  EXPECT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.device->health().message;
}

// Tries master_io: a drive of a master on CAN with feedback that cannot be true
// Its drag would push the hand on. CiA 402 has separate polarity bits, so that a setting does it.
TEST(CanDevice, SR14_ADriveWithANegatedVelocityFeedsTheHandUntilItIsFoundOnly) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.device->health().message;
  bench.drives[3]->misbehaviour.negated_velocity = true;
  const double start_rad = bench.drives[3]->motor().joint_rad();
  double given_J = 0.0, before_rad = start_rad;
  int ticks = 0;
  for (; ticks < 5000 && bench.last.outputs.state == LinkState::kCoupled; ++ticks) {
    bench.tick();
    const double now_rad = bench.drives[3]->motor().joint_rad();
    given_J += bench.drives[3]->torque_mille() * 1e-3 * 2.0 * 5.0 * (now_rad - before_rad);
    before_rad = now_rad;
  }
  EXPECT_EQ(bench.last.outputs.state, LinkState::kStopped);
  EXPECT_THAT(bench.device->health().message,
              HasSubstr("j4_elbow reports a velocity that does not fit its position"));
  EXPECT_LT(std::abs(before_rad - start_rad), 0.05);
  EXPECT_LT(given_J, 0.02);
}

// Tries master_io: the servo's loop is held up
TEST(CanDevice, SR18_AfterAGapTheTorqueOnTheHandIsHeldDownAndAStarvedLoopLetsTheHandGo) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.device->health().message;
  for (int i = 0; i < 1500; ++i) bench.tick();
  const double before_Nm = std::abs(bench.last.outputs.motor_Nm[3]);
  ASSERT_GT(before_Nm, 0.8 * Bench::push_Nm);
  for (int i = 0; i < 19; ++i) bench.miss();
  bench.tick();
  ASSERT_TRUE(bench.last.outputs.loop.late);
  ASSERT_EQ(bench.last.outputs.state, LinkState::kCoupled) << "one gap of 40 ms is borne";
  EXPECT_LT(std::abs(bench.last.outputs.motor_Nm[3]), 0.2 * before_Nm);
  for (int i = 0; i < 1500; ++i) bench.tick();
  EXPECT_GT(std::abs(bench.last.outputs.motor_Nm[3]), 0.8 * before_Nm) << "and forgotten";
  for (int gap = 0; gap < 2; ++gap) {
    for (int i = 0; i < 19; ++i) bench.miss();
    bench.tick();
  }
  EXPECT_EQ(bench.last.outputs.state, LinkState::kDegraded);
  EXPECT_TRUE(bench.last.outputs.loop.starved);
  for (int i = 0; i < 100; ++i) bench.tick();
  EXPECT_FALSE(bench.last.outputs.power);
  for (const auto& drive : bench.drives) {
    EXPECT_EQ(drive->power(), simulated_drive::SimulatedDrive::Power::kSwitchOnDisabled) << "as configured";
    EXPECT_EQ(drive->torque_mille(), 0.0);
  }
  EXPECT_TRUE(bench.reaches(LinkState::kCoupled)) << "by itself: " << bench.device->health().message;
}

// Tries master_io: master_io ends in order
TEST(CanDevice, WhenMasterIoEndsTheHandIsFreeAtOnce) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.device->health().message;
  for (int i = 0; i < 500; ++i) bench.tick();
  ASSERT_NE(bench.drives[3]->torque_mille(), 0.0);
  bench.now_ns += bench.period_ns;
  bench.device->end(bench.now_ns);
  for (int i = 0; i < 4; ++i) {
    bench.now_ns += bench.period_ns;
    for (auto& bus : bench.buses) bus.advance_to(bench.now_ns);
    for (auto& drive : bench.drives) drive->step(bench.now_ns);
  }
  for (const auto& drive : bench.drives) {
    EXPECT_EQ(drive->power(), simulated_drive::SimulatedDrive::Power::kSwitchOnDisabled);
    EXPECT_EQ(drive->torque_mille(), 0.0);
  }
}

TEST(CanDevice, OnlyTorqueModeCanRender) {
  try {
    can_config(", mode: position");
    FAIL() << "accepted";
  } catch (const core::ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("can.drives.j1_gantry.mode: 'position'"));
    EXPECT_THAT(error.what(), HasSubstr("allowed: torque"));
  }
}

TEST(CanDevice, AMastersEncodersAreAbsolute) {
  try {
    can_config(", homing: {method: 35, search_speed_m_s: 1, zero_speed_m_s: 1, acceleration_m_s2: 1}");
    FAIL() << "accepted";
  } catch (const core::ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("can.drives.j1_gantry.homing"));
    EXPECT_THAT(error.what(), HasSubstr("is for the drives of slave_io"));
  }
}

}  // namespace
}  // namespace phantom::master_io
