#pragma once

#include "common/can/arm_drives.hpp"
#include "components/slave_io/gripper.hpp"

namespace phantom::slave_io {

/// A gripper whose fingers one more CiA 402 drive moves, in position mode, with the greatest force in each
/// target (0x6072). It is a group of its own: its faults do not stop the arm. Its bus is one of the arm's,
/// whose group sends SYNC and heartbeat. Without them, and in a stop of its own, the drive holds by itself.
class CanGripper final : public GripperDriver {
 public:
  /// `bus`: a port of its own on the drive's bus.
  CanGripper(const can::DriveGroupConfig& config, std::unique_ptr<can::CanBus> bus);

  teleop::GripperSense sense() noexcept override;
  HomingRequest::State homing() const noexcept override { return homing_; }
  void move(const GripperCommand& command, double dt_s, core::Nanoseconds now_ns) noexcept override;
  core::ActuatorHealth health() override { return drive_.health("the next request to it"); }

 private:
  can::ArmDrives drive_;
  HomingRequest::State homing_ = HomingRequest::State::kNotYet;
};

}  // namespace phantom::slave_io
