#pragma once

#include "common/can/drive_group.hpp"
#include "common/core/health.hpp"
#include "common/core/snapshot.hpp"

namespace phantom::can {

/// What one tick is told of the drives of an arm.
struct ArmDrivesSense {
  bool known = false;  ///< every encoder has spoken; before that nothing else means anything
  core::JointArray position{}, velocity{}, torque{};  ///< as the drives say, of the newest answered SYNC
  bool follows = false;                               ///< all drives do what they are told
  bool fault = false;                                 ///< they hold or coast until a reset
};

/// A DriveGroup as slave_io and master_io use it: power comes on while the caller permits it and every joint
/// stands within its range; what is wrong is told to a thread that reports health.
class ArmDrives {
 public:
  /// `tolerance`: how far beyond its range a joint may stand when power comes on (rad or m). See DriveGroup.
  ArmDrives(const DriveGroupConfig& config, const core::JointArray& tolerance,
            std::vector<std::unique_ptr<CanBus>> buses);

  /// Takes what has come since the last step(). Real-time safe: yes.
  const ArmDrivesSense& sense() noexcept;
  /// One period under `command`. `command.enable` permits power: no drive is given any without it, whatever
  /// state an earlier process left the drives in. When it is withdrawn, drives that follow stop as in a fault
  /// (hold or coast, as configured), and those that hold go on holding where the reaction is to hold.
  /// `command.quick_stop` gives no power either; commanded from the first step on it stops drives that an
  /// earlier process left enabled. `command.hold` is set here. Real-time safe as DriveGroup::step().
  void step(DriveCommand command, core::Nanoseconds now_ns) noexcept;
  /// The last call of all: the drives hold or coast at once, as they are to in a fault, instead of going on
  /// with their last targets until they miss the heartbeat. What a bus does not take is left to that.
  void end(core::Nanoseconds now_ns) noexcept;

  const DriveGroupReport& report() const noexcept { return group_.report(); }
  /// One reader thread, any but that of step(). Its figures: the planned load of the fullest bus, SYNCs
  /// without an answer, frames that a bus did not take.
  core::ActuatorHealth health();

 private:
  struct Told {
    DriveGroupReport report;
    std::int32_t outside = -1;  // joint outside its range, which keeps the power off; −1: none
    bool permitted = false;     // as the caller said
  };
  std::int32_t joint_outside() const noexcept;
  std::string why_not_following() const;

  DriveGroupConfig config_;
  core::JointArray tolerance_;
  DriveGroup group_;
  ArmDrivesSense sense_;
  Told told_, read_;
  core::Snapshot<Told> for_health_;
  double worst_load_ = 0.0;  // share of the bit rate
};

}  // namespace phantom::can
