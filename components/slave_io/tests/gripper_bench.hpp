#pragma once

// The servo of slave_io with a simulated arm and gripper, on a clock of the test's own: repeats exactly.

#include <gtest/gtest.h>

#include "common/simulation/tests/half_space.hpp"
#include "common/teleop/tests/servo_rig.hpp"
#include "components/slave_io/servo.hpp"
#include "components/slave_io/simulated_arm.hpp"
#include "components/slave_io/simulated_gripper.hpp"
#include "components/slave_io/tests/fixture.hpp"

namespace phantom::slave_io {

inline constexpr const char* kGripperSection =
    "gripper: {widest_m: 0.1, max_speed_m_s: 0.1, least_force_N: 3, greatest_force_N: 60, force_N: 30, "
    "object_width_m: 0.042}\n\nforce_sensor:";

inline Config config_with_gripper() {
  return load_config(changed("force_sensor:", kGripperSection), shipped_arm().arm, shipped_arm().home);
}

struct GripperBench : teleop::ServoRig<Inbox, SlaveReport> {
  Config config = config_with_gripper();
  simulation::HalfSpace floor{Eigen::Vector3d::UnitZ(), -5.0};
  SimulatedArm arm{shipped_arm(), config, floor};
  SimulatedGripper gripper{arm.plant()};
  Servo servo{shipped_arm(), config, arm, inbox, 1, stops, &gripper};
  MasterSample master = [] {
    MasterSample sample;
    sample.position = shipped_arm().home;
    sample.state = teleop::LinkState::kCoupled;
    return sample;
  }();

  GripperBench() { inbox.gripper.open(config.gripper->limits); }
  void run(double duration_s) {
    for (double t = 0; t < duration_s; t += config.period_s) {
      now_ns += core::from_seconds(config.period_s);
      if (heard) {
        renew(master);
        inbox.master.write(master);
      }
      tick(servo, config.period_s);
    }
  }
  const messages::GripperState& state_of_it() const { return last.gripper.value(); }
  void grip() {
    run(0.5);
    ASSERT_TRUE(inbox.gripper.ask_width(0.0));
    run(1.0);
    ASSERT_TRUE(state_of_it().holds);
  }
};

}  // namespace phantom::slave_io
