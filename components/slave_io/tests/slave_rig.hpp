#pragma once

#include "common/simulation/tests/half_space.hpp"
#include "common/teleop/tests/servo_rig.hpp"
#include "components/slave_io/servo.hpp"
#include "components/slave_io/simulated_arm.hpp"
#include "components/slave_io/tests/fixture.hpp"

namespace phantom::slave_io::slave_rig {

using teleop::LinkState;
inline constexpr double kDt = 0.001;
inline constexpr std::size_t kJoints = 7;

/// The servo with a simulated arm, and a master that says what the test wants.
struct ServoRig : teleop::ServoRig<Inbox, SlaveReport> {
  simulation::HalfSpace floor{Eigen::Vector3d::UnitZ(), -5.0};
  SimulatedArm arm{shipped_arm(), shipped_config(), floor};
  Servo servo{shipped_arm(), shipped_config(), arm, inbox, 1, stops};
  MasterSample master = [] {
    MasterSample sample;
    sample.position = shipped_arm().home;
    sample.state = LinkState::kCoupled;
    return sample;
  }();

  void run(double duration_s) {
    for (double t = 0; t < duration_s; t += kDt) {
      now_ns += core::from_seconds(kDt);
      if (heard) {
        renew(master);
        inbox.master.write(master);
      }
      tick(servo, kDt);
    }
  }
};

}  // namespace phantom::slave_io::slave_rig
