#pragma once

// The servo with drives on a bus in this process, on a clock of the test's own: repeats exactly.

#include <algorithm>
#include <cmath>
#include <memory>

#include "common/teleop/tests/servo_rig.hpp"
#include "components/slave_io/can_arm.hpp"
#include "components/slave_io/servo.hpp"
#include "components/slave_io/tests/drive_rig.hpp"

namespace phantom::slave_io {

struct ArmBench : teleop::ServoRig<Inbox, SlaveReport> {
  explicit ArmBench(Config with = can_config(), const core::JointArray& start = shipped_arm().home,
                    const DriveRig::Change& change = {}, const ArmModel& model = shipped_arm())
      : rig(std::move(with), start, change), config(rig.config), drives(rig.drives), frozen(rig.frozen) {
    arm = std::make_unique<CanArm>(model, config, rig.connect());
    servo = std::make_unique<Servo>(model, config, *arm, inbox, 1, stops);
    master.position = shipped_arm().home;
    master.state = teleop::LinkState::kCoupled;
  }

  void tick() {
    now_ns += period_ns;
    if (heard) {
      renew(master);
      inbox.master.write(master);
    }
    ServoRig::tick(*servo, config.period_s);
    pass();
  }
  /// The servo does not run for a period in which it should have; the drives do.
  void miss() {
    now_ns += period_ns;
    pass();
  }
  void pass() {
    rig.pass(now_ns + period_ns, period_ns);
    for (std::size_t j = 0; j < drives.size(); ++j)
      fastest = std::max(fastest, std::abs(speed(j)) / shipped_arm().arm.joints()[j].max_speed);
  }
  void run(double duration_s) {
    for (double t = 0; t < duration_s; t += config.period_s) tick();
  }
  bool reaches(teleop::LinkState wanted, double most_s = 10.0) {
    return ServoRig::reaches(wanted, config.period_s, most_s, [this] { tick(); });
  }
  double joint(std::size_t j) const { return rig.position(j); }
  double speed(std::size_t j) const { return rig.velocity(j); }
  void reset() { inbox.stops.reset({.own = stops.record.id}); }

  DriveRig rig;
  const Config& config;
  std::vector<std::unique_ptr<simulated_drive::SimulatedDrive>>& drives;
  std::vector<bool>& frozen;
  core::Nanoseconds period_ns = core::from_seconds(config.period_s);
  std::unique_ptr<CanArm> arm;
  std::unique_ptr<Servo> servo;
  MasterSample master;
  double fastest = 0.0;  // greatest speed of a joint ÷ its greatest speed allowed, since it was set to 0
};

}  // namespace phantom::slave_io
