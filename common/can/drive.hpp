#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/can/cia402.hpp"
#include "common/can/drive_config.hpp"
#include "common/can/drive_setup.hpp"
#include "common/can/sdo_client.hpp"

namespace phantom::can {

enum class DrivePhase : std::uint8_t {
  kSearching,    ///< asked to boot, not heard of
  kConfiguring,  ///< by SDO
  kStarting,     ///< told to go operational; waiting for all of its messages
  kReady,        ///< power off
  kEnabling,
  kEnabled,    ///< follows its targets
  kQuickStop,  ///< stops on its ramp, then holds
  kResetting,  ///< a fault of the drive is being reset
  kFault,      ///< see fault; latched until a reset
};

enum class DriveFault : std::uint8_t {
  kNone,
  kSetupRefused,        ///< the drive refused a setting, or is not what the configuration says
  kSetupTimeout,        ///< no answer to an SDO
  kNotOperational,      ///< does not go operational, or has left it
  kModeMismatch,        ///< reports another mode than commanded
  kDuplicateNode,       ///< its node id is on the bus twice
  kPdoLength,           ///< sent a PDO of another length than mapped
  kFeedbackMissing,     ///< leaves SYNCs without an answer
  kMeasurementMissing,  ///< answers them, but its velocity and torque do not come
  kHeartbeatLost,
  kRebooted,       ///< started anew by itself
  kBusOff,         ///< our controller has left the bus
  kBusDown,        ///< our interface is down or gone
  kEmergency,      ///< the drive sent an emergency message
  kDriveFault,     ///< its statusword says fault
  kEnableTimeout,  ///< does not reach the commanded power state
  kLeftEnabled,    ///< switched its power off by itself
};

const char* name_of(DrivePhase phase) noexcept;
const char* name_of(DriveFault fault) noexcept;

/// What is known of one drive.
struct DriveReport {
  DrivePhase phase = DrivePhase::kSearching;
  DriveFault fault = DriveFault::kNone;
  core::Nanoseconds fault_ns = 0;  ///< when the fault was found
  bool answered = false;           ///< false: nothing was heard of it since it was asked to boot
  PowerState power = PowerState::kNotReady;
  std::uint16_t statusword = 0;
  std::uint16_t emergency_code = 0;  ///< newest; 0: none, or taken back
  std::int8_t mode = 0;              ///< as displayed
  std::uint16_t sdo_index = 0;       ///< which setting, for the faults of the setup
  std::uint8_t sdo_sub = 0;
  std::uint32_t sdo_abort = 0;  ///< 0: the value that was read is not what it must be
  std::uint32_t sdo_value = 0;  ///< that value
  std::int32_t position_counts = 0, velocity_counts = 0;
  std::int16_t torque_mille = 0;
  bool has_position = false;
  std::uint64_t missed = 0;   ///< SYNCs without an answer, in all
  std::uint64_t surplus = 0;  ///< messages more than one node sends
};

/// A sentence for the operator: what is wrong with the drive `name`, or what it does. Not real-time safe.
std::string describe(const DriveReport& report, const std::string& name);

enum class DriveGoal : std::uint8_t { kOff, kEnabled, kQuickStop };

/// Frames that go out in one cycle, in order of importance.
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

/// Targets in the drive's units; of them the mode uses its own.
struct DriveTargets {
  std::int32_t position_counts = 0;
  std::int32_t velocity_counts = 0;
  std::int16_t torque_mille = 0;  ///< target in torque mode, else offset
};

/// Master side of one CiA 402 drive: boots, configures, starts, watches, enables and stops it. Knows no bus
/// and no clock. Constant after construction but for its state; nothing allocates. Real-time safe: all but
/// the constructor.
class Drive {
 public:
  Drive(const AxisConfig& axis, const DriveGroupConfig& config);

  int node() const noexcept { return node_; }
  /// A frame that names this node. `time_ns` is when it was received.
  void on_frame(const CanFrame& frame, core::Nanoseconds time_ns) noexcept;
  /// One cycle, after all frames were taken. `goal` counts once the drive is ready. `reset` asks to leave a
  /// fault.
  void step(DriveGoal goal, bool reset, BusState bus, core::Nanoseconds now_ns, Outbox& out) noexcept;
  /// Targets for this cycle; call after step(). Sends nothing before the drive was operational. Of a drive
  /// that leaves SYNCs without an answer, but is not in fault yet, the torque stays what it was.
  void send_targets(const DriveTargets& targets, Outbox& out) noexcept;
  /// Tells that the cycle's SYNC went out.
  void on_sync() noexcept;

  const DriveReport& report() const noexcept { return report_; }
  /// Whether the targets are followed by the drive: until then they are its actual position, no speed, no
  /// torque.
  bool follows() const noexcept { return report_.phase == DrivePhase::kEnabled; }

 private:
  void on_state_pdo(const CanFrame& frame) noexcept;
  void on_measure_pdo(const CanFrame& frame) noexcept;
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
  void leave_fault(core::Nanoseconds now_ns) noexcept;
  bool is_watched() const noexcept;
  double phase_age_s(core::Nanoseconds now_ns) const noexcept { return core::seconds(now_ns - phase_ns_); }

  DriveTiming timing_;
  DriveMode mode_;
  FaultReaction reaction_;
  int node_;
  std::vector<SetupStep> setup_;
  SdoClient sdo_;
  DriveReport report_;
  core::Nanoseconds phase_ns_ = -1;  // since when in this phase; < 0: not stepped yet
  core::Nanoseconds asked_ns_ = -1;  // when the last NMT command went out
  std::size_t setup_next_ = 0;
  int attempts_ = 0;
  std::uint16_t controlword_;  // at first as setup_steps() has it: who holds since an earlier process, holds
  DriveFault pending_ = DriveFault::kNone;  // found in a frame; taken by step()
  bool booted_ = false;
  bool was_set_up_ = false;  // at some time: it takes our targets when it is operational
  NmtState nmt_ = NmtState::kBootUp;
  core::Nanoseconds heartbeat_ns_ = -1;
  core::Nanoseconds credited_ns_ = 0;  // up to when time is in heartbeat_credit_s_
  double heartbeat_credit_s_ =
      0.0;              // time that heartbeats may still take up; < 0: more than one node sends them
  int answers_ = 0;     // to the newest SYNC
  int missed_ = 0;      // SYNCs in a row, at most kCountedSyncs
  int unmeasured_ = 0;  // SYNCs since the newest velocity and torque, at most kCountedSyncs
  std::int16_t torque_mille_ = 0;  // newest target from what the drive told of itself in time
  int owed_ = 0;                   // answers that did not come in time and may still come
  int most_owed_;
  bool sync_open_ = false, measured_ = false;
  std::uint32_t surplus_syncs_ = 0;     // SYNCs with more than one answer, newest in bit 0
  int owed_sdo_ = 0, surplus_sdo_ = 0;  // replies that may still come; that nobody asked for
};

}  // namespace phantom::can
