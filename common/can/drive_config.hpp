#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/can/axis_units.hpp"
#include "common/core/status.hpp"

namespace phantom::can {

/// Modes of operation (CiA 402, object 0x6060).
enum class DriveMode : std::int8_t { kPosition = 8, kVelocity = 9, kTorque = 10 };

/// What the drives do when something is wrong: stop on their ramp and hold, or let go.
enum class FaultReaction : std::uint8_t { kHold, kCoast };

/// One axis: a node on one of the buses.
struct AxisConfig {
  std::string name;
  std::size_t bus = 0;
  int node = 0;  ///< 1…127, once per bus
  DriveMode mode = DriveMode::kTorque;
  AxisUnits units;
  double lower = 0.0, upper = 0.0;  ///< joint range
  double max_speed = 0.0;           ///< joint units/s; > 0: position targets never move faster
  double max_torque = 0.0;          ///< at the joint; > 0
};

/// Times of the connection; all in seconds.
struct DriveTiming {
  double period_s = 0.002;            ///< of the cycle, with one SYNC each
  int measure_every = 1;              ///< velocity and torque come every so many SYNCs (1…240)
  double heartbeat_s = 0.02;          ///< of master and drives
  double heartbeat_timeout_s = 0.05;  ///< ≥ 2 heartbeats
  int most_missed = 3;                ///< SYNCs that a drive may leave without an answer
  double sdo_timeout_s = 0.1;         ///< of one answer
  double boot_timeout_s = 2.0;        ///< from the reset to the boot-up message
  double state_timeout_s = 1.0;       ///< for a change of state that was commanded
};

struct DriveGroupConfig {
  std::vector<AxisConfig> axes;  ///< in joint order, at most core::kMaxJoints
  DriveTiming timing;
  FaultReaction reaction = FaultReaction::kHold;
  int master_node = 127;                  ///< whose heartbeat the drives watch
  std::vector<double> bit_rates = {1e6};  ///< per bus
  double load_budget = 0.85;              ///< share of a bus that may be planned at worst
};

/// What a bus has to carry at worst.
struct BusLoad {
  int frames_per_cycle = 0;   ///< SYNC and PDOs
  double bits_per_s = 0.0;    ///< all of it, with heartbeats
  double share = 0.0;         ///< of the bit rate
  double cycle_busy_s = 0.0;  ///< time that one cycle's SYNC and PDOs take
};

/// Worst case of bus `bus`, from the configuration alone: SYNC, PDOs, heartbeats, each with the most stuff
/// bits.
BusLoad bus_load(const DriveGroupConfig& config, std::size_t bus);

/// Refuses what cannot work: units, node ids, limits, times, and buses over their budget (with the numbers).
/// The message names the axis or bus, the value and what is allowed.
core::Status check(const DriveGroupConfig& config);

/// Bytes of the PDOs: what a drive sends on each SYNC, what it sends with the measurements, what it gets.
inline constexpr std::uint8_t kStatePdoBytes = 7;    ///< statusword, position, mode
inline constexpr std::uint8_t kMeasurePdoBytes = 6;  ///< velocity, torque
std::uint8_t target_pdo_bytes(DriveMode mode) noexcept;

}  // namespace phantom::can
