#pragma once

#include <cstdint>
#include <limits>

#include "common/core/clock.hpp"
#include "common/core/joints.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/teleop/joint_servo.hpp"
#include "common/teleop/link_state.hpp"
#include "common/teleop/slave_plant.hpp"
#include "components/slave_io/config.hpp"

namespace phantom::slave_io {

/// The newest valid master_state.
using MasterSample = messages::Answer<messages::MasterState>;

struct SlaveInputs {
  MasterSample master;
  double master_age_s = std::numeric_limits<double>::infinity();  ///< since it was received; ∞: none yet
  double master_round_trip_s = 0.0;  ///< since the slave_state was made that it answers; 0: none of ours yet
  std::uint32_t stop_requests = 0;   ///< emergency stops that were asked for so far
  const teleop::StopReset* reset = nullptr;  ///< one that came since the last tick
  core::JointArray position{};               ///< as the encoders say
  core::JointArray velocity{};
  core::JointArray gravity_Nm{};  ///< torques that hold the weight; used if feed-forward is configured
  bool drives_follow = true;  ///< false: the arm does not do what it is told (power off, starting, stopped)
  bool drive_fault = false;   ///< it needs a reset
};

struct SlaveOutputs {
  teleop::LinkState state = teleop::LinkState::kInit;
  teleop::StopRecord stop;  ///< in force
  teleop::ResetOutcome reset = teleop::ResetOutcome::kNone;
  bool power = false;               ///< the drives may have power
  bool master_unconfirmed = false;  ///< stopped for a while, and the master does not say that it is stopped
  bool master_elsewhere = false;    ///< the master is heard, but answers another slave
  std::int8_t far_joint = -1;  ///< index of one that is too far from the master's to come by itself; −1: none
  teleop::ServoTorque torque;
  core::JointArray reference{};           ///< what the position loops follow
  core::JointArray reference_velocity{};  ///< and how fast that moves, as far as the master says so
};

/// The slave's controller: watches the link, leads the reference, closes the position loops.
///
/// init, degraded, stopped: holds the position it had when it came there. ready, aligned: goes slowly to the
/// master's pose if that is near, else holds. coupled: follows the master. While the drives do not follow,
/// the reference is where the arm is, so that nothing jumps when they do. Drives get power once the master is
/// heard and says that it is not stopped. Joint positions, speeds and torques
/// stay within the arm's limits whatever arrives.
class SlaveIo {
 public:
  /// `latch`: with the stop that outlived the process before this one, if there is one.
  SlaveIo(const robot::SerialArm& arm, const Config& config, const core::JointArray& start_q,
          const teleop::StopLatch& latch);

  /// One tick. Pure; real-time safe: yes.
  SlaveOutputs step(const SlaveInputs& in, double dt_s) noexcept;

 private:
  core::JointArray lead_reference(const SlaveInputs& in, bool master_near, double dt_s) noexcept;
  void limit_speed(const core::JointArray& v, core::JointArray& drive_Nm) const noexcept;
  core::JointArray as_far_as_free(const SlaveInputs& in) const noexcept;
  std::int8_t far_joint(const core::JointArray& q) const noexcept;

  std::size_t count_;
  bool gravity_feed_forward_;
  core::JointArray lower_{}, upper_{}, max_speed_{};
  core::JointArray align_tolerance_, align_speed_, align_range_;
  teleop::LinkMonitor link_;
  teleop::JointServo servo_;
  teleop::ReferenceLimiter limiter_;
};

}  // namespace phantom::slave_io
