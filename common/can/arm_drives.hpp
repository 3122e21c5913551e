#pragma once

#include "common/can/drive_group.hpp"
#include "common/core/health.hpp"
#include "common/core/snapshot.hpp"

namespace phantom::can {

/// Digital inputs of a drive (object 0x60FD).
struct DigitalInputs {
  std::uint32_t bits = 0;
  core::Nanoseconds at_ns = 0;  ///< when they were received; 0: never
};

/// State of an arm's drives at a tick.
struct ArmDrivesSense {
  bool known = false;  ///< every encoder has reported; before that nothing else is valid
  core::JointArray position{}, velocity{}, torque{};  ///< as the drives report for the newest answered SYNC
  bool current = false;       ///< that SYNC is the last one, or for a single one of a drive the one before
  bool follows = false;       ///< all drives follow their commands
  bool needs_homing = false;  ///< the position is unknown until the drives are homed, which may begin now
  bool homing = false;
  /// The drives hold or coast until a reset. Not set while all that is wrong is a setting that drives refuse,
  /// and none was ready since the start: nothing gets power, and a reset would change nothing.
  bool fault = false;
  DigitalInputs inputs;  ///< of the first drive that is to send them
};

/// A DriveGroup as slave_io and master_io use it. Power comes on while the caller permits it and every joint
/// is within its range. Problems are reported through health(), for another thread.
class ArmDrives {
 public:
  /// `tolerance`: how far outside its range a joint may be when power comes on (rad or m). See DriveGroup.
  ArmDrives(const DriveGroupConfig& config, const core::JointArray& tolerance,
            std::vector<std::unique_ptr<CanBus>> buses);

  /// Reads what the buses received since the last step(). Real-time safe: yes.
  const ArmDrivesSense& sense() noexcept;
  /// Runs one period under `command`.
  ///
  /// `command.enable` permits power: without it no drive is given power, whatever state an earlier process
  /// left the drives in. When it is withdrawn, drives that follow stop as in a fault (hold or coast, as
  /// configured). Drives that hold already go on holding if the reaction is to hold.
  /// `command.quick_stop` gives no power either. If it is commanded from the first step on, it stops drives
  /// that an earlier process left enabled. `command.hold` is set here. Real-time safe as DriveGroup::step().
  void step(DriveCommand command, core::Nanoseconds now_ns) noexcept;
  /// Makes the drives hold or coast at once, as in a fault, instead of following their last targets until
  /// the heartbeat is missed. Drives on a bus that refuses the frames stop when they miss the heartbeat. This
  /// is the last call.
  void end(core::Nanoseconds now_ns) noexcept;

  const DriveGroupReport& report() const noexcept { return group_.report(); }
  /// Returns the drives' health. Only one thread may call it, and not that of step(). `reset`: what ends a
  /// fault, for people. Its figures: the
  /// planned load of the fullest bus, SYNCs without an answer, frames that a bus refused.
  core::ActuatorHealth health(const char* reset = "a reset");

 private:
  struct Published {
    DriveGroupReport report;
    std::int32_t outside = -1;  // joint outside its range, which prevents power; −1: none
    bool permitted = false;     // the caller permits power
    bool refused = false;       // drives refuse their settings, and none was ready since the start
  };
  std::int32_t joint_outside() const noexcept;
  bool merely_refused() const noexcept;
  std::string why_not_following() const;

  DriveGroupConfig config_;
  core::JointArray tolerance_;
  DriveGroup group_;
  std::size_t inputs_axis_;  // the first drive that sends its digital inputs; as many as there are: none
  ArmDrivesSense sense_;
  bool were_ready_ = false;  // since the start
  Published published_, read_;
  core::Snapshot<Published> for_health_;
  double worst_load_ = 0.0;  // share of the bit rate
};

}  // namespace phantom::can
