#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/can/axis_units.hpp"
#include "common/core/status.hpp"

namespace phantom::can {

/// Modes of operation (CiA 402, object 0x6060).
enum class DriveMode : std::int8_t { kPosition = 8, kVelocity = 9, kTorque = 10 };

/// Reaction of the drives to a fault: stop on their ramp and hold, or switch off power.
enum class FaultReaction : std::uint8_t { kHold, kCoast };

/// A holding brake that the drive itself opens and closes with its power, as CiA 402 drives do: it opens when
/// operation is enabled, and it closes at the end of a quick stop, before the torque ends.
struct BrakeConfig {
  double release_s = 0.2;  ///< from operation enabled until the joint is free: no target is followed before
  double engage_s = 0.2;   ///< for which power lasts at rest, until the brake holds
};

/// Search for the home of an axis whose encoder is not absolute (CiA 402, homing mode). Home is count 0:
/// AxisUnits::offset is the joint's position there.
struct HomingConfig {
  int method = 0;             ///< object 0x6098: 1…37
  double search_speed = 0.0;  ///< to the switch; joint units/s, > 0
  double zero_speed = 0.0;    ///< to its edge or to the index pulse
  double acceleration = 0.0;  ///< joint units/s²
  double timeout_s = 60.0;    ///< of one axis
};

/// One axis: a node on one of the buses.
struct AxisConfig {
  std::string name;
  std::size_t bus = 0;
  int node = 0;  ///< 1…127, unique on its bus
  DriveMode mode = DriveMode::kTorque;
  AxisUnits units;
  double lower = 0.0, upper = 0.0;  ///< range of the joint
  double max_speed = 0.0;           ///< joint units/s; > 0: limits the speed of position targets
  double max_torque = 0.0;          ///< at the joint; > 0
  /// In position mode: the drive's greatest torque (0x6072) comes with each target, in place of a torque
  /// offset.
  bool limits_force = false;
  std::optional<BrakeConfig> brake;
  std::optional<HomingConfig> homing;  ///< without: the encoder is absolute
  bool digital_inputs = false;         ///< its digital inputs (0x60FD) are sent on each SYNC
  // What the drive itself watches; without a value its own setting stays.
  std::optional<double>
      following_window;  ///< greatest following error (0x6065), rad or m; not in torque mode
  std::optional<double> following_time_s;  ///< for which the error may be greater (0x6066)
  std::optional<double> limits_margin;  ///< ≥ 0: targets farther beyond the range are cut (0x607D); rad or m
};

/// Timing of the connection, in seconds.
struct DriveTiming {
  double period_s = 0.002;            ///< period of the cycle, with one SYNC each
  int measure_every = 1;              ///< number of SYNCs (1…240) from one velocity and torque to the next
  double heartbeat_s = 0.02;          ///< heartbeat period of master and drives
  double heartbeat_timeout_s = 0.05;  ///< ≥ 2 heartbeats
  double target_timeout_s = 0.0;      ///< without targets for so long, drives stop by themselves; 0: never
  int most_missed = 3;                ///< successive SYNCs that a drive may leave unanswered
  double sdo_timeout_s = 0.1;         ///< for one answer
  double boot_timeout_s = 2.0;        ///< from the reset to the boot-up message
  double state_timeout_s = 1.0;       ///< for a commanded change of state
  double mode_timeout_s = 5.0;  ///< until the commanded mode is displayed, from its start or its power on
};

struct DriveGroupConfig {
  std::vector<AxisConfig> axes;  ///< in joint order, at most core::kMaxJoints
  DriveTiming timing;
  FaultReaction reaction = FaultReaction::kHold;
  /// Sends SYNC and the master's heartbeat. If not, another group on the same buses does: each cycle, this
  /// group is listened to before that one's step, and stepped after it.
  bool sends_sync = true;
  /// Greatest speed of an axis by its position ÷ its max_speed: beyond it the drive is put into fault; > 1.
  double overspeed_ratio = 2.0;
  int master_node = 127;                  ///< node id of the master, whose heartbeat the drives monitor
  std::vector<double> bit_rates = {1e6};  ///< per bus
  double load_budget = 0.85;              ///< greatest planned worst-case load of a bus, as a share
};

/// Worst-case load of a bus.
struct BusLoad {
  int frames_per_cycle = 0;   ///< SYNC and PDOs
  double bits_per_s = 0.0;    ///< total, with heartbeats
  double share = 0.0;         ///< of the bit rate
  double cycle_busy_s = 0.0;  ///< time that one cycle's SYNC and PDOs take
};

/// Returns the worst-case load of bus `bus` from the configuration alone: SYNC, PDOs and heartbeats, each
/// with the most stuff bits.
BusLoad bus_load(const DriveGroupConfig& config, std::size_t bus);

/// Checks units, node ids, limits, times, and that no bus exceeds its budget (with the numbers). The message
/// names the axis or bus, the value and what is allowed.
core::Status check(const DriveGroupConfig& config);

/// Lengths in bytes of the PDOs: sent by a drive on each SYNC, sent with the measurements, sent on each SYNC
/// by a drive with digital inputs, and received by it.
inline constexpr std::uint8_t kStatePdoBytes = 7;    ///< statusword, position, mode
inline constexpr std::uint8_t kMeasurePdoBytes = 6;  ///< velocity, torque
inline constexpr std::uint8_t kInputsPdoBytes = 4;   ///< digital inputs
std::uint8_t target_pdo_bytes(DriveMode mode) noexcept;

}  // namespace phantom::can
