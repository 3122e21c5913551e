#pragma once

#include <array>
#include <memory>
#include <vector>

#include "common/can/can_bus.hpp"
#include "common/can/drive.hpp"
#include "common/core/joints.hpp"

namespace phantom::can {

/// Command of the arm's controller to its drives for one cycle.
struct DriveCommand {
  bool enable = false;  ///< power on and follow; false: no drive is given power
  bool hold = false;    ///< without enable: a drive with power stops on its ramp and holds; false: power off
  bool quick_stop = false;  ///< stop on the drives' ramps and hold; gives no power; overrides enable
  bool reset = false;       ///< a rising edge ends faults whose cause is gone
  bool home = false;  ///< a rising edge homes the drives that need it, one after the other, unless quick_stop
  bool hasten = false;            ///< the cycle is late: the targets act with its SYNC, not with the next one
  int implausible_axis = -1;      ///< a drive with feedback that the caller has found false; −1: none
  ImplausibleMotion implausible;  ///< of that drive
  core::JointArray position{};    ///< rad or m, for axes in position mode
  core::JointArray velocity{};    ///< for axes in velocity mode
  core::JointArray torque{};  ///< N·m or N at the joint: target in torque mode, else added by the drive; or
                              ///< the greatest (AxisConfig::limits_force)
};

enum class DriveGroupState : std::uint8_t {
  kStarting,  ///< at least one drive is not ready yet
  kReady,     ///< all drives are ready; power is off
  kEnabling,
  kEnabled,  ///< all drives follow
  kQuickStop,
  kFault,  ///< a drive is or was in fault: the others hold or coast as configured, until a reset
};

const char* name_of(DriveGroupState state) noexcept;

struct DriveGroupReport {
  static constexpr std::size_t kMaxBuses = 8;
  DriveGroupState state = DriveGroupState::kStarting;
  core::JointArray position{}, velocity{}, torque{};  ///< as the drives report; kept while a drive is silent
  bool current = false;  ///< at the last listen(), every drive's position, velocity and torque were current
  bool has_positions = false;  ///< every drive has reported its position, and knows where that is
  bool needs_homing = false;   ///< a drive has to be homed, and all others are ready or have to be as well
  bool homing = false;         ///< a drive is being homed
  std::array<DriveReport, core::kMaxJoints> drives{};
  std::array<BusState, kMaxBuses> buses{};
  std::uint64_t refused_values = 0;  ///< commanded values that were not finite
  std::uint64_t not_sent = 0;        ///< frames that a bus refused
};

/// Returns one sentence on what prevents the drives of `axes` from following; empty if nothing does. Not
/// real-time safe.
std::string describe(const DriveGroupReport& report, const std::vector<AxisConfig>& axes);

/// Returns the device-specific warnings of the drives of `axes`, by name and code; empty if there is none.
/// Not real-time safe.
std::string warnings_of(const DriveGroupReport& report, const std::vector<AxisConfig>& axes);

/// Runs all drives of an arm, on one or several CAN buses, with one step per period. Used by slave_io and
/// master_io.
///
/// One cycle reads the received frames, advances every drive's state, sends SYNC, then the targets, then one
/// frame of configuration per drive. Targets take effect with the next SYNC; in a cycle that is late they are
/// sent first, as nobody knows when that would be. For any command: torques stay
/// within max_torque. Position targets start at the actual position, move at most at max_speed and stay in
/// the joint's range. A value that is not finite leaves position targets unchanged and gives no velocity or
/// torque. After a fault of any drive no drive follows until `reset`. Feedback that cannot be true
/// (PlausibilityMonitor) puts its drive into fault.
class DriveGroup {
 public:
  /// The configuration must have passed check(). `buses`: one open bus per bit rate in it.
  DriveGroup(const DriveGroupConfig& config, std::vector<std::unique_ptr<CanBus>> buses);

  /// Reads the received frames and updates position, velocity and torque of the report, so that a command may
  /// use the answers to the last SYNC. step() does the same for a caller that does not call this. Real-time
  /// safe: yes.
  const DriveGroupReport& listen() noexcept;
  /// Runs one period. `now_ns`: CLOCK_MONOTONIC. Bounded, without allocation or locks, so real-time safe;
  /// except in the cycle of a reset while a bus is off, because it restarts the bus.
  const DriveGroupReport& step(const DriveCommand& command, core::Nanoseconds now_ns) noexcept;

  const DriveGroupReport& report() const noexcept { return report_; }
  /// Returns what is known of one drive, frames of the last listen() included. Real-time safe: yes.
  const DriveReport& drive(std::size_t axis) const noexcept { return drives_[axis].report(); }
  /// Returns the sentence of describe(). Not real-time safe.
  std::string sentence() const { return describe(report_, config_.axes); }

 private:
  struct Bus {
    std::unique_ptr<CanBus> port;
    std::array<std::int8_t, 128> axis_of_node{};
    Outbox targets, others;
    core::Nanoseconds heartbeat_ns = -1;
    core::Nanoseconds sync_ns = 0;  // when the last SYNC was sent
  };
  void take_frames(Bus& bus) noexcept;
  bool take_reset(bool requested) noexcept;
  void check_feedback(std::size_t axis, const DriveCommand& command, core::Nanoseconds now_ns) noexcept;
  void note_target(std::size_t axis, const DriveTargets& sent) noexcept;
  DriveGoal goal_of(const DriveCommand& command, std::size_t axis) const noexcept;
  void choose_homing(const DriveCommand& command) noexcept;
  DriveTargets targets_of(const DriveCommand& command, std::size_t axis) noexcept;
  double lead_position(double wanted, std::size_t axis) noexcept;
  double finite_or_zero(double value) noexcept;
  void send(Bus& bus, std::size_t index, bool hasten, core::Nanoseconds now_ns) noexcept;
  void send_sync(Bus& bus, std::size_t index) noexcept;
  bool put(Bus& bus, const CanFrame& frame) noexcept;
  void update_motion() noexcept;
  void update_report(const DriveCommand& command) noexcept;

  DriveGroupConfig config_;
  std::vector<Bus> buses_;
  std::vector<Drive> drives_;
  std::vector<PlausibilityMonitor> monitors_;  // of each drive
  struct Target {
    TargetKind kind = TargetKind::kNone;
    double value = 0.0;  // joint units
  };
  std::vector<Target> targets_;  // sent to each drive in the last cycle
  core::JointArray reference_{};
  DriveGroupReport report_;
  bool fault_latched_ = false, reset_before_ = false, reset_pending_ = false;
  bool all_ready_ = false;
  bool home_before_ = false, homing_ = false, homing_begun_ = false;
  std::size_t homing_axis_ = 0;  // while homing_
};

}  // namespace phantom::can
