// A master with fewer joints than the arm: the joystick of the thesis, whose two axes lead x and y of a
// Cartesian robot of five; simulated, and with drives on a bus.
#include "components/master_io/devices/mapped_device.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "components/master_io/servo.hpp"
#include "components/master_io/tests/fixture.hpp"
#include "components/simulated_drive/tests/drive_like.hpp"
#include "tests/support/heap_guard.hpp"
#include "tests/support/local_bus.hpp"

namespace phantom::master_io {
namespace {

using teleop::LinkState;
using testing::AllOf;
using testing::HasSubstr;

const std::string kDeploy = PHANTOM_SOURCE_DIR "/deploy/";
constexpr std::size_t kX = 0, kY = 1, kZ = 2;  // of the robot
constexpr double kThetaRatio = 0.13, kPhiRatio = 0.14;

const runtime::CellConfig& bench_cell() {
  static const auto cell = runtime::load_cell(kDeploy + "cells/joystick_bench/cell.yaml");
  return cell;
}
const ArmModel& robot_model() {
  static const auto model = load_arm(bench_cell(), "");
  return model;
}

/// A shipped file of the joystick, `from` in it replaced.
Config joystick_config(const std::string& file = "cells/joystick_bench/master_io.yaml",
                       const std::string& from = "", const std::string& to = "",
                       const Choices& choices = {}) {
  std::string yaml = test::replaced(test::text_of(kDeploy + file), from, to);
  for (const char* prefix : {"device: ../../arms/", "device: ../arms/"})
    yaml = test::all_replaced(yaml, prefix, "device: " + kDeploy + "arms/");
  for (const char* reaches :
       {"reaches_file: reaches.yaml", "reaches_file: ../cells/joystick_bench/reaches.yaml"})
    yaml =
        test::all_replaced(yaml, reaches, "reaches_file: " + kDeploy + "cells/joystick_bench/reaches.yaml");
  return load_config(test::new_file(yaml), bench_cell().file, robot_model().arm, robot_model().home, choices);
}

/// What load_config() says of the joystick's file with one piece of text replaced.
std::string refusal_of(const std::string& from, const std::string& to, const Choices& choices = {}) {
  try {
    joystick_config("cells/joystick_bench/master_io.yaml", from, to, choices);
  } catch (const core::ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

/// A device of two joints that does nothing but remember.
class RememberingDevice final : public Device {
 public:
  const DeviceSense& sense(core::Nanoseconds) noexcept override { return state; }
  void move(const DeviceDemand& demand, double, core::Nanoseconds) noexcept override { last = demand; }
  void end(core::Nanoseconds) noexcept override { ended = true; }
  bool makes_up_periods() const noexcept override { return false; }
  core::ActuatorHealth health() override { return {.message = "of the joystick"}; }

  DeviceSense state;
  DeviceDemand last;
  bool ended = false;
};

struct Remembered {
  explicit Remembered(const Config& config = joystick_config()) {
    auto made = std::make_unique<RememberingDevice>();
    own = made.get();
    device = std::make_unique<MappedDevice>(config.mapping.value(), std::move(made), robot_model().home);
  }
  void move(const DeviceDemand& demand) { device->move(demand, 0.001, 0); }

  RememberingDevice* own;
  std::unique_ptr<MappedDevice> device;
};

TEST(MappedDevice, IsAMasterWithTheArmsJointsToEveryoneElse) {
  Remembered r;
  r.own->state.position = r.own->state.hand_position = {-1.0, 0.5};
  r.own->state.velocity = r.own->state.hand_velocity = {2.0, -1.0};
  r.own->state.fault = true;
  const DeviceSense& sense = r.device->sense(0);
  EXPECT_NEAR(sense.position[kX], 0.36 - kThetaRatio, 1e-12);
  EXPECT_NEAR(sense.position[kY], 0.45 + 0.5 * kPhiRatio, 1e-12);
  EXPECT_EQ(sense.position[kZ], robot_model().home[kZ]);
  EXPECT_EQ(sense.hand_position, sense.position);
  EXPECT_NEAR(sense.velocity[kX], 2.0 * kThetaRatio, 1e-12);
  EXPECT_EQ(sense.velocity[kZ], 0.0);
  EXPECT_TRUE(sense.fault);
  EXPECT_EQ(r.device->health().message, "of the joystick");
  r.move({.motor_Nm = {-2.0, 3.0, 99.0, 99.0, 99.0}, .hand_Nm = {1.0}, .power = true});
  EXPECT_NEAR(r.own->last.motor_Nm[0], -2.0 * kThetaRatio, 1e-12);
  EXPECT_NEAR(r.own->last.motor_Nm[1], 3.0 * kPhiRatio, 1e-12);
  EXPECT_EQ(r.own->last.motor_Nm[2], 0.0);
  EXPECT_NEAR(r.own->last.hand_Nm[0], kThetaRatio, 1e-12);
  EXPECT_TRUE(r.own->last.power);
  EXPECT_NEAR(r.device->mapping_figures()->greatest_torque_Nm[1], 3.0 * kPhiRatio, 1e-12);
  EXPECT_NEAR(r.device->mapping_figures()->energy_from_hand_J[0], 2.0 * kThetaRatio * 2.0 * 0.001, 1e-12);
  r.device->end(0);
  EXPECT_TRUE(r.own->ended);
}

TEST(MappedDevice, JointsThatAreNotLedStandWhereTheArmStoodBeforeCoupling) {
  Remembered r;
  core::JointArray arm = robot_model().home;
  const auto held_at = [&] { return r.device->sense(0).position[kZ]; };
  arm[kZ] = 0.31;
  r.move({.meet = &arm});
  EXPECT_EQ(held_at(), 0.31) << "taken as it is first heard";
  arm[kZ] = 0.305;
  r.move({.meet = &arm});
  EXPECT_EQ(held_at(), 0.31) << "an arm that sags a little is not followed down";
  arm[kZ] = 0.15;
  r.move({.meet = &arm});
  EXPECT_EQ(held_at(), 0.15) << "moved by hand meanwhile";
  arm[kZ] = 0.2;
  r.move({});
  EXPECT_EQ(held_at(), 0.15) << "coupled: it stands still";
  r.move({.meet = &arm});
  EXPECT_EQ(held_at(), 0.2) << "taken again after a loss";
}

TEST(MappedDevice, AConfiguredPlaceIsKeptWhereverTheArmStands) {
  Remembered r(
      joystick_config("cells/joystick_bench/master_io.yaml", "\ndevice:", "\n  held: {z: 0.33}\n\ndevice:"));
  core::JointArray arm = robot_model().home;
  EXPECT_EQ(r.device->sense(0).position[kZ], 0.33);
  arm[kZ] = 0.2;
  r.move({.meet = &arm});
  EXPECT_EQ(r.device->sense(0).position[kZ], 0.33);
}

/// The servo with the simulated joystick and a robot that follows perfectly.
struct JoystickRig : ServoRig {
  explicit JoystickRig(const Config& chosen = joystick_config())
      : config(chosen),
        device(*config.mapping,
               std::make_unique<SimulatedDevice>(config.mapping->device,
                                                 start_of(*config.mapping, robot_model().home)),
               robot_model().home),
        servo(config, robot_model().home, device, inbox, 1, stops) {
    slave.position = robot_model().home;
    drag.drag.plus.fill(0.5);
    drag.drag.minus.fill(0.5);
  }

  void run(double duration_s) {
    for (double t = 0; t < duration_s; t += config.period_s) {
      now_ns += core::from_seconds(config.period_s);
      renew(slave);
      renew(drag);
      if (last.outputs.state == LinkState::kCoupled) slave.position = last.position;
      inbox.slave.write(slave);
      inbox.drag.write(drag);
      {
        const test::HeapGuard guard;
        tick(servo, config.period_s);
      }
      const double power_W =
          std::inner_product(last.velocity.begin(), last.velocity.end(), last.percept_torque_Nm.begin(), 0.0);
      greatest_power_W = std::max(greatest_power_W, power_W);
      for (const std::size_t j : {kZ, std::size_t{3}, std::size_t{4}}) {
        off_led_Nm = std::max(off_led_Nm, std::abs(last.outputs.motor_Nm[j]));
        off_led_speed = std::max(off_led_speed, std::abs(last.velocity[j]));
      }
    }
  }

  Config config;
  MappedDevice device;
  Servo servo;
  double greatest_power_W = -1e9, off_led_Nm = 0.0, off_led_speed = 0.0;
};

TEST(MappedMaster, SR14_TheDragOfTheLedJointsComesBackToTheJoystickAndNeverPushes) {
  JoystickRig rig;
  rig.run(30.0);
  ASSERT_EQ(rig.last.outputs.state, LinkState::kCoupled);
  EXPECT_GE(rig.last.reach, 2) << "along x and along y";
  const MappingFigures& figures = *rig.device.mapping_figures();
  EXPECT_GT(figures.greatest_torque_Nm[0], 0.05);
  EXPECT_LE(figures.greatest_torque_Nm[0], 0.32);
  EXPECT_GT(figures.greatest_torque_Nm[1], 0.05);
  EXPECT_LE(figures.greatest_torque_Nm[1], 1.27);
  EXPECT_GT(figures.energy_from_hand_J[0], 0.01);
  EXPECT_GT(figures.energy_from_hand_J[1], 0.01);
  EXPECT_LE(rig.greatest_power_W, 1e-12);
  EXPECT_EQ(rig.off_led_Nm, 0.0) << "nobody holds these joints";
  EXPECT_EQ(rig.off_led_speed, 0.0);
}

TEST(MappedMaster, TheRobotIsCoupledAtItsOwnHeight) {
  JoystickRig rig;
  rig.slave.position[kZ] = 0.35;
  rig.run(2.0);
  ASSERT_EQ(rig.last.outputs.state, LinkState::kCoupled);
  EXPECT_EQ(rig.last.position[kZ], 0.35);
}

TEST(MappedMaster, WhatActsOnJointsThatAreNotLedIsNotFelt) {
  JoystickRig rig(joystick_config("cells/joystick_bench/master_io.yaml", "law: pf", "law: sctfb"));
  rig.slave.loop_torque_Nm = {100.0, 0.0, 300.0, 5.0, 5.0};
  rig.run(1.0);
  ASSERT_EQ(rig.last.outputs.state, LinkState::kCoupled);
  EXPECT_NEAR(rig.last.feedback_torque_Nm[kX], -0.0003 * 100.0, 0.002) << "of x it is";
  EXPECT_EQ(rig.last.feedback_torque_Nm[kZ], 0.0);
  EXPECT_EQ(rig.off_led_Nm, 0.0);
}

TEST(MappedMaster, CoupledDragIsThatOfTheLedJointsAmongThemselves) {
  JoystickRig rig(joystick_config("cells/joystick_bench/master_io.yaml", "mode: separable", "mode: coupled"));
  rig.drag.drag.coupled.fill(0.5);  // every joint with every other
  rig.run(12.0);
  EXPECT_GT(rig.device.mapping_figures()->energy_from_hand_J[0], 0.01);
  EXPECT_EQ(rig.off_led_Nm, 0.0);
  EXPECT_LE(rig.greatest_power_W, 1e-12);
}

TEST(MappedMaster, OneAxisLeadsOneJoint) {
  JoystickRig rig(joystick_config("cells/joystick_bench/master_io_one_axis.yaml"));
  ASSERT_EQ(rig.config.mapping->joints.size(), 1U);
  rig.run(12.0);
  EXPECT_GE(rig.last.reach, 0);
  EXPECT_GT(rig.device.mapping_figures()->energy_from_hand_J[0], 0.01);
  EXPECT_EQ(rig.last.position[kY], robot_model().home[kY]);
  EXPECT_LE(rig.greatest_power_W, 1e-12);
}

// The same with drives on a bus: theta's amplifier takes a voltage, phi's a current.
struct JoystickBench : ServoRig {
  JoystickBench() {
    std::vector<std::unique_ptr<can::CanBus>> ports;
    ports.push_back(bus.connect("master_io"));
    for (std::size_t m = 0; m < 2; ++m) {
      const can::AxisConfig& axis = config.can->group.axes[m];
      simulated_drive::DriveOptions o = simulated_drive::drive_like(
          axis, start_of(*config.mapping, robot_model().home)[m], config.mapping->device.joints[m].inertia);
      if (m == 0)
        o.motor.hand = {
            .swing_rad = 1.0, .period_s = 6.0, .stiffness_Nm_per_rad = 2.0, .damping_Nms_per_rad = 0.05};
      drives.push_back(std::make_unique<simulated_drive::SimulatedDrive>(o, bus.connect(axis.name)));
    }
    device = std::make_unique<MappedDevice>(
        *config.mapping, std::make_unique<CanDevice>(config, std::move(ports)), robot_model().home);
    servo = std::make_unique<Servo>(config, robot_model().home, *device, inbox, 1, stops);
    slave.position = robot_model().home;
    drag.drag.plus.fill(0.3);
    drag.drag.minus.fill(0.3);
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
    for (int part = 1; part <= 4; ++part) {
      bus.advance_to(now_ns + period_ns * part / 4);
      for (auto& drive : drives) drive->step(now_ns + period_ns * part / 4);
    }
  }
  bool reaches(LinkState wanted) {
    return ServoRig::reaches(wanted, config.period_s, 10.0, [this] { tick(); });
  }

  Config config = joystick_config("can/joystick_master_io.yaml");
  simulation::LocalBus bus = simulation::LocalBus({.bit_rate = 1e6});
  std::vector<std::unique_ptr<simulated_drive::SimulatedDrive>> drives;
  std::unique_ptr<MappedDevice> device;
  std::unique_ptr<Servo> servo;
  core::Nanoseconds period_ns = core::from_seconds(config.period_s);
};

TEST(MappedMaster, OnDrivesTheTorqueOfTheArmsJointComesBackThroughLambda) {
  JoystickBench bench;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.device->health().message;
  double greatest_N = 0.0, off_Nm = 0.0, off_m = 0.0, pushed_W = -1e9;
  for (int i = 0; i < 3000; ++i) {
    bench.tick();
    const double felt_N = bench.last.percept_torque_Nm[kX],
                 volts = bench.drives[0]->torque_mille() * 1e-3 * 3.6;
    greatest_N = std::max(greatest_N, std::abs(felt_N));
    off_Nm = std::max(off_Nm, std::abs(volts * 0.0888889 - kThetaRatio * felt_N));
    off_m = std::max(
        off_m, std::abs(bench.last.position[kX] - 0.36 - kThetaRatio * bench.drives[0]->motor().joint_rad()));
    pushed_W = std::max(pushed_W, felt_N * bench.last.velocity[kX]);
  }
  ASSERT_EQ(bench.last.outputs.state, LinkState::kCoupled);
  EXPECT_GT(greatest_N, 0.1) << "a hand moves theta, and feels the drag of x";
  EXPECT_LT(off_Nm, 0.001) << "τ = λ · command, and the ratio once; the answer to a SYNC is two periods old";
  EXPECT_LT(off_m, 0.002);
  EXPECT_LE(pushed_W, 1e-12);
  EXPECT_EQ(bench.drives[1]->torque_mille(), 0.0) << "phi stands still";
}

TEST(MappingConfig, TheJoystickIsSeenByTheArmsJointsThroughItsRatio) {
  const Config config = joystick_config();
  ASSERT_TRUE(config.mapping.has_value());
  const auto& device = config.device;
  EXPECT_NEAR(device.joints[kX].inertia, 0.0012 / (kThetaRatio * kThetaRatio), 1e-9);
  EXPECT_EQ(device.joints[kZ].inertia, kHeldInertia);
  EXPECT_NEAR(device.torque_limit_Nm[kX], 0.32 / kThetaRatio, 1e-9);
  EXPECT_NEAR(device.torque_limit_Nm[kY], 1.27 / kPhiRatio, 1e-9);
  EXPECT_NEAR(config.torque_rate_Nm_per_s[kX], 16.0 / kThetaRatio, 1e-9);
  EXPECT_NEAR(device.encoder_resolution[kX], 3.8e-05 * kThetaRatio, 1e-12);
  EXPECT_LE(config.percept.torque_cap_Nm[kX], device.torque_limit_Nm[kX]);
  EXPECT_EQ(config.hand.stiffness[kZ], 0.0) << "a simulated hand does not pull at what the joystick lacks";
  ASSERT_EQ(config.desk.banks.size(), 1U);
  EXPECT_THAT(config.desk.banks[0], testing::ElementsAre(0, 1, -1, -1, -1, -1)) << "sticks on the led joints";
  const auto start = start_of(*config.mapping, robot_model().home);
  EXPECT_NEAR(0.36 + kThetaRatio * start[0], robot_model().home[kX], 1e-12);
}

TEST(MappingConfig, EachFaultIsNamedWithWhatIsAllowed) {
  EXPECT_EQ(refusal_of("led_by: theta", "led_by: theta"), "accepted");
  EXPECT_THAT(refusal_of("led_by: theta", "led_by: psi"),
              AllOf(HasSubstr("joint_mapping.joints.x.led_by: 'psi' is no joint of the master"),
                    HasSubstr("allowed: theta, phi")));
  EXPECT_THAT(refusal_of("led_by: phi", "led_by: theta"),
              AllOf(HasSubstr("joint_mapping.joints.y.led_by"), HasSubstr("leads another joint already")));
  EXPECT_THAT(refusal_of("ratio: 0.13", "ratio: 0.2"),
              AllOf(HasSubstr("joint_mapping.joints.x.ratio"),
                    HasSubstr("lets theta lead x from -0.1636 to 0.8836"), HasSubstr("within 0 to 0.72")));
  EXPECT_THAT(refusal_of("ratio: 0.13", "ratio: 0"), HasSubstr("allowed: above or below 0"));
  EXPECT_THAT(refusal_of("inertia: 0.0012", "inertia: 0"), HasSubstr("joint_mapping.joints.x.inertia"));
  EXPECT_THAT(refusal_of("    x: {led_by", "    w: {led_by"), HasSubstr("joint_mapping.joints.w"));
  EXPECT_THAT(refusal_of("\ndevice:", "\n  held: {x: 0.3}\n\ndevice:"),
              AllOf(HasSubstr("joint_mapping.held"), HasSubstr("names x, which the master leads")));
  EXPECT_THAT(refusal_of("\ndevice:", "\n  held: {z: 0.5}\n\ndevice:"),
              AllOf(HasSubstr("has 0.5 for z"), HasSubstr("allowed: 0 to 0.442")));
  EXPECT_THAT(refusal_of("\ndevice:", "\n  held: {elbow: 0.5}\n\ndevice:"),
              AllOf(HasSubstr("no joint of the arm"), HasSubstr("allowed: x, y, z")));
  EXPECT_THAT(
      refusal_of("    encoder_step_m: 2e-05\n", "    encoder_step_m: 2e-05\n  joints: {x: {inertia: 3}}\n"),
      HasSubstr("stands beside joint_mapping"));
  EXPECT_THAT(refusal_of("driver: sim", "driver: cartesian"),
              AllOf(HasSubstr("joint_mapping"), HasSubstr("allowed: driver sim, desk or can")));
}

}  // namespace
}  // namespace phantom::master_io
