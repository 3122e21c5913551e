#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/can/cia402.hpp"
#include "common/can/drive_config.hpp"
#include "common/can/drive_setup.hpp"
#include "common/can/plausibility_monitor.hpp"
#include "common/can/sdo_client.hpp"

namespace phantom::can {

enum class DrivePhase : std::uint8_t {
  kSearching,    ///< asked to boot, not heard yet
  kConfiguring,  ///< configured by SDO
  kStarting,     ///< commanded to go operational; not all of its messages have arrived yet
  kReferencing,  ///< asked whether it knows where its home is; waits to be homed
  kHoming,       ///< moves to find its home
  kReady,        ///< power is off
  kEnabling,
  kEnabled,    ///< follows its targets
  kQuickStop,  ///< stops on its ramp, then holds
  kResetting,  ///< a fault of the drive is being reset
  kFault,      ///< see fault; latched until a reset
};

enum class DriveFault : std::uint8_t {
  kNone,
  kSetupRefused,        ///< the drive refused a setting, or does not match the configuration
  kSetupTimeout,        ///< no answer to an SDO request
  kNotOperational,      ///< does not become operational, or has left that state
  kModeMismatch,        ///< reports a mode other than the commanded one
  kDuplicateNode,       ///< its node id is used twice on the bus
  kPdoLength,           ///< sent a PDO shorter than the mapped one
  kFeedbackMissing,     ///< does not answer SYNCs
  kMeasurementMissing,  ///< answers SYNCs, but its velocity and torque do not arrive
  kHeartbeatLost,
  kRebooted,        ///< restarted by itself
  kBusOff,          ///< our CAN controller has left the bus
  kBusDown,         ///< our CAN interface is down or gone
  kFollowingError,  ///< its statusword reports a following error
  kEmergency,       ///< the drive sent an emergency message
  kDriveFault,      ///< its statusword reports a fault
  kEnableTimeout,   ///< does not reach the commanded power state
  kLeftEnabled,     ///< switched its power off by itself
  kBrakeClosed,     ///< has not moved under its full torque since it got power
  kHomingError,     ///< found no home, as it says itself
  kHomingTimeout,   ///< found no home in time
  kImplausible,     ///< its position, velocity and torque cannot belong to one motion
};

const char* name_of(DrivePhase phase) noexcept;
const char* name_of(DriveFault fault) noexcept;

/// Known state of one drive.
struct DriveReport {
  DrivePhase phase = DrivePhase::kSearching;
  DriveFault fault = DriveFault::kNone;
  bool answered = false;  ///< false: nothing was received from it since it was asked to boot
  PowerState power = PowerState::kNotReady;
  std::uint16_t statusword = 0;
  std::uint16_t emergency_code = 0;  ///< the newest; 0: none, or cleared
  std::uint16_t warning_code = 0;    ///< the newest device-specific one (0xFFxx) that is no fault; 0: none
  std::int8_t mode = 0;              ///< as the drive displays it
  std::uint16_t sdo_index = 0;       ///< the setting concerned by a setup fault
  std::uint8_t sdo_sub = 0;
  std::uint32_t sdo_abort = 0;    ///< 0: the value that was read is wrong
  std::uint32_t sdo_value = 0;    ///< the value that was read
  std::uint16_t pdo_mapping = 0;  ///< of fault kPdoLength: the mapping's object, its bytes and those sent
  std::uint8_t mapped_bytes = 0, pdo_bytes = 0;
  std::int32_t position_counts = 0, velocity_counts = 0;
  std::int16_t torque_mille = 0;
  bool has_position = false;
  std::uint32_t digital_inputs = 0;  ///< object 0x60FD, if it was asked for
  core::Nanoseconds inputs_ns = 0;   ///< when they were received; 0: never
  bool unmoved = false;              ///< it has a brake and has not moved since it got power
  bool has_reference = true;         ///< false: its position means nothing, as it was not homed
  bool needs_homing = false;         ///< it says so itself
  ImplausibleMotion implausible;     ///< of fault kImplausible
  std::uint64_t missed = 0;          ///< total number of SYNCs without an answer
  std::uint64_t surplus = 0;         ///< messages that show more than one node with this id
};

/// Returns a sentence for the operator: the drive's problem, or its activity. `name` is the drive's name. Not
/// real-time safe.
std::string describe(const DriveReport& report, const std::string& name);

enum class DriveGoal : std::uint8_t { kOff, kEnabled, kQuickStop, kHome };

/// Frames to send in one cycle, in order of importance.
class Outbox {
 public:
  static constexpr std::size_t kFrames = 96;
  void add(const CanFrame& frame) noexcept {
    if (count_ < kFrames) frames_[count_++] = frame;
  }
  std::span<const CanFrame> frames() const noexcept { return {frames_.data(), count_}; }
  void clear() noexcept { count_ = 0; }

 private:
  std::array<CanFrame, kFrames> frames_{};
  std::size_t count_ = 0;
};

/// Targets in the drive's units. Each mode uses its own.
struct DriveTargets {
  std::int32_t position_counts = 0;
  std::int32_t velocity_counts = 0;
  std::int16_t torque_mille = 0;  ///< target in torque mode, else an offset, or the greatest
};

/// Master side of one CiA 402 drive: boots, configures, starts, monitors, enables and stops it. It uses no
/// bus and no clock. The configuration is constant after construction; nothing allocates memory after that.
/// Real-time safe: all but the constructor.
class Drive {
 public:
  Drive(const AxisConfig& axis, const DriveGroupConfig& config);

  int node() const noexcept { return node_; }
  /// Processes a frame that carries this node's id. `time_ns` is the time of its receipt.
  void on_frame(const CanFrame& frame, core::Nanoseconds time_ns) noexcept;
  /// Runs one cycle, after all frames were processed. `goal` applies once the drive is ready. `reset`
  /// requests to leave a fault.
  void step(DriveGoal goal, bool reset, BusState bus, core::Nanoseconds now_ns, Outbox& out) noexcept;
  /// Sends the targets of this cycle; call it after step(). Sends nothing before the drive was operational.
  /// If a drive leaves SYNCs unanswered but is not in fault yet, its torque target is frozen.
  void send_targets(const DriveTargets& targets, Outbox& out) noexcept;
  /// Notes that the cycle's SYNC was sent.
  void on_sync() noexcept;

  const DriveReport& report() const noexcept { return report_; }
  /// Returns whether position, velocity and torque are the newest that the drive has to give, once its
  /// answers to the last SYNC were processed. One answer may be missing, as it may come a little late.
  bool is_current() const noexcept {
    return missed_ + (answers_ == 0 ? 1 : 0) <= 1 && unmeasured_ <= timing_.measure_every;
  }
  /// Returns whether the drive has answered the last SYNC.
  bool answered_sync() const noexcept { return answers_ > 0; }
  /// Returns whether its feedback is to be checked: it has power, or gets it, or stops.
  bool is_powered_phase() const noexcept {
    return follows() || report_.phase == DrivePhase::kEnabling || report_.phase == DrivePhase::kQuickStop;
  }
  /// Returns whether a torque has to move the joint: it has followed for a while, and its brake is open.
  bool moves_freely(core::Nanoseconds now_ns) const noexcept {
    constexpr double kSettling_s = 0.1;  // the torque that holds the weight comes with the power
    return follows() && !report_.unmoved && phase_age_s(now_ns) > kSettling_s;
  }
  /// Puts the drive into fault, as its feedback cannot be true.
  void fail_implausible(const ImplausibleMotion& motion, core::Nanoseconds now_ns) noexcept;
  /// Returns whether the drive follows the targets. Otherwise its actual position, zero velocity and zero
  /// torque are sent.
  bool follows() const noexcept { return report_.phase == DrivePhase::kEnabled; }

 private:
  void on_state_pdo(const CanFrame& frame) noexcept;
  void on_measure_pdo(const CanFrame& frame) noexcept;
  void on_inputs_pdo(const CanFrame& frame, core::Nanoseconds time_ns) noexcept;
  bool holds_mapping(const CanFrame& frame, std::uint16_t mapping, std::uint8_t bytes) noexcept;
  void on_heartbeat(const CanFrame& frame, core::Nanoseconds time_ns) noexcept;
  void on_emergency(const CanFrame& frame) noexcept;
  void count_sdo_reply() noexcept;
  void forget_surplus() noexcept;
  void enter(DrivePhase phase, core::Nanoseconds now_ns) noexcept;
  void fail(DriveFault fault, core::Nanoseconds now_ns) noexcept;
  void watch(BusState bus, core::Nanoseconds now_ns) noexcept;
  DriveFault found_fault(core::Nanoseconds now_ns) const noexcept;
  void search(core::Nanoseconds now_ns, Outbox& out) noexcept;
  void configure(core::Nanoseconds now_ns, Outbox& out) noexcept;
  bool send_request(core::Nanoseconds now_ns, Outbox& out) noexcept;
  void begin_setup_step(core::Nanoseconds now_ns) noexcept;
  void finish_setup_step(core::Nanoseconds now_ns) noexcept;
  void start(core::Nanoseconds now_ns, Outbox& out) noexcept;
  void control(DriveGoal goal, core::Nanoseconds now_ns) noexcept;
  void reference(DriveGoal goal, core::Nanoseconds now_ns, Outbox& out) noexcept;
  void home(DriveGoal goal, core::Nanoseconds now_ns) noexcept;
  /// Returns whether the displayed mode (0x6061) permits to go on. Without power a drive may show none.
  bool may_show_mode() const noexcept {
    return shows_mode() || (report_.mode == 0 && report_.power != PowerState::kOperationEnabled);
  }
  bool shows_mode() const noexcept { return report_.mode == static_cast<std::int8_t>(mode_); }
  bool has_mode(std::int8_t mode, core::Nanoseconds now_ns, Outbox& out) noexcept;
  DrivePhase connected_phase() const noexcept {
    return homing_ ? DrivePhase::kReferencing : DrivePhase::kReady;
  }
  bool brake_is_open(core::Nanoseconds now_ns) noexcept;
  bool brake_seems_closed(core::Nanoseconds now_ns) noexcept;
  double enable_timeout_s() const noexcept;
  void leave_fault(core::Nanoseconds now_ns) noexcept;
  bool is_watched() const noexcept;
  double phase_age_s(core::Nanoseconds now_ns) const noexcept { return core::seconds(now_ns - phase_ns_); }

  DriveTiming timing_;
  DriveMode mode_;
  bool limits_force_;
  std::optional<BrakeConfig> brake_;
  std::optional<HomingConfig> homing_;
  bool digital_inputs_;
  int node_;
  std::uint16_t stop_word_;  // controlword that ends its motion: quick stop or voltage off
  double moved_counts_;      // farther than play and noise
  double full_mille_;        // nearly its greatest torque
  std::vector<SetupStep> setup_;
  SdoClient sdo_;
  DriveReport report_;
  core::Nanoseconds phase_ns_ = -1;     // start of the present phase; < 0: not stepped yet
  core::Nanoseconds asked_ns_ = -1;     // when the last NMT command was sent
  core::Nanoseconds powered_ns_ = -1;   // when it reported power; < 0: it has none
  core::Nanoseconds strained_ns_ = -1;  // since when it exerts its full torque
  std::int32_t powered_counts_ = 0;     // where it stood when its brake opened
  std::int8_t wanted_mode_ = 0;         // asked for while it is referenced; 0: none yet
  core::Nanoseconds wanted_ns_ = 0;     // since when
  bool homed_ = false, homes_ = false;  // it says that it knows its home; its search has begun
  std::size_t setup_next_ = 0;
  std::uint32_t kept_bits_ = 0;  // of the last SetupStep::Kind::kKeep
  int attempts_ = 0, searches_ = 0;
  std::uint16_t controlword_;  // initially that of setup_steps(): a drive that still holds from an earlier
                               // process goes on holding
  DriveFault pending_ = DriveFault::kNone;  // found in a frame; processed by step()
  bool booted_ = false;
  bool was_set_up_ = false;  // it was configured at some time, so it accepts our targets when operational
  NmtState nmt_ = NmtState::kBootUp;
  core::Nanoseconds heartbeat_ns_ = -1;
  core::Nanoseconds credited_ns_ = 0;  // time up to which heartbeat_credit_s_ is counted
  double heartbeat_credit_s_ = 0.0;    // time budget for heartbeats; < 0: more than one node sends them
  int answers_ = 0;                    // answers to the newest SYNC
  int missed_ = 0;                     // successive SYNCs without an answer, at most kCountedSyncs
  int unmeasured_ = 0;                 // SYNCs since the newest velocity and torque, at most kCountedSyncs
  std::int16_t torque_mille_ = 0;      // newest target that was computed from timely data of the drive
  int owed_ = 0;                       // late answers that may still arrive
  int most_owed_;
  bool sync_open_ = false, measured_ = false;
  std::uint32_t surplus_syncs_ = 0;     // SYNCs with more than one answer; bit 0 is the newest
  int owed_sdo_ = 0, surplus_sdo_ = 0;  // SDO replies that may still arrive; replies to no request
};

}  // namespace phantom::can
