#include "common/can/drive_setup.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "common/can/canopen.hpp"
#include "common/can/cia402.hpp"

namespace phantom::can {
namespace {

using Kind = SetupStep::Kind;
using Steps = std::vector<SetupStep>;

void add_write(Steps& steps, std::uint16_t index, std::uint8_t sub, std::uint8_t size, std::uint32_t value) {
  steps.push_back({.index = index, .sub = sub, .size = size, .value = value});
}

constexpr std::uint32_t kPdoOff = 0x80000000;
constexpr std::uint32_t kNoRemoteRequest = 0x40000000;  // no remote frame may ask for a TPDO (CiA 301)

bool is_sent_by_drive(std::uint16_t communication) { return communication >= 0x1800; }

// Many drives answer no remote request and refuse a TPDO's COB-ID without bit 30: it stays as the drive has
// it.
void read_remote_bit(Steps& steps, std::uint16_t communication) {
  if (!is_sent_by_drive(communication)) return;
  steps.push_back({.kind = Kind::kKeep, .index = communication, .sub = 1, .mask = kNoRemoteRequest});
}

void write_cob(Steps& steps, std::uint16_t communication, std::uint32_t value) {
  add_write(steps, communication, 1, 4, value);
  steps.back().keep = is_sent_by_drive(communication);
}

// The order is that of CiA 301: off, no mapping, the mapping, its count, the transmission type, on.
void map_pdo(Steps& steps, std::uint16_t communication, std::uint32_t cob, std::uint32_t every_syncs,
             std::initializer_list<std::uint32_t> objects) {
  const auto mapping = static_cast<std::uint16_t>(communication + 0x200);
  read_remote_bit(steps, communication);
  write_cob(steps, communication, cob | kPdoOff);
  add_write(steps, mapping, 0, 1, 0);
  std::uint8_t count = 0;
  for (const std::uint32_t object : objects) add_write(steps, mapping, ++count, 4, object);
  add_write(steps, mapping, 0, 1, count);
  add_write(steps, communication, 2, 1, every_syncs);
  write_cob(steps, communication, cob);
}

void switch_pdo_off(Steps& steps, std::uint16_t communication, std::uint32_t cob) {
  read_remote_bit(steps, communication);
  write_cob(steps, communication, cob | kPdoOff);
  steps.back().optional = true;
}

// Sets the interpolation time period: value · 10^exponent seconds, exact where possible.
void set_interpolation(Steps& steps, double period_s) {
  for (int exponent = -3; exponent >= -6; --exponent) {
    const double value = period_s * std::pow(10.0, -exponent);
    if (value < 0.999 || std::abs(value - std::round(value)) > 1e-6) continue;
    add_write(steps, 0x60C2, 1, 1, static_cast<std::uint32_t>(std::lround(value)));
    steps.back().optional = true;
    add_write(steps, 0x60C2, 2, 1, static_cast<std::uint8_t>(exponent));
    steps.back().optional = true;
    return;
  }
}

// Revolutions per minute of the motor at the joint's greatest speed and a tenth more, so that only what no
// controller here commands is cut.
std::uint32_t greatest_motor_rpm(const AxisConfig& axis) {
  const double rpm = 66.0 * axis.max_speed * axis.units.gear_ratio / axis.units.travel_per_turn;
  return static_cast<std::uint32_t>(std::min(std::ceil(rpm), 4294967295.0));
}

std::uint32_t milliseconds(double s) { return static_cast<std::uint32_t>(std::lround(s * 1e3)); }

void set_following(Steps& steps, const AxisConfig& axis) {
  if (axis.following_window) {
    const double counts = std::ceil(*axis.following_window * std::abs(axis.units.counts_per_unit()));
    add_write(steps, 0x6065, 0, 4,
              static_cast<std::uint32_t>(std::min(counts, 4294967294.0)));  // the last: off
  }
  if (axis.following_time_s) add_write(steps, 0x6066, 0, 2, milliseconds(*axis.following_time_s));
}

// The drive's limits of targets. A motor that turns opposite to the joint has its least count at the upper
// one.
void set_limits(Steps& steps, const AxisConfig& axis) {
  if (!axis.limits_margin || !std::isfinite(axis.lower) || !std::isfinite(axis.upper)) return;
  const std::int32_t lower = axis.units.position_counts(axis.lower - *axis.limits_margin);
  const std::int32_t upper = axis.units.position_counts(axis.upper + *axis.limits_margin);
  add_write(steps, 0x607D, 1, 4, static_cast<std::uint32_t>(std::min(lower, upper)));
  add_write(steps, 0x607D, 2, 4, static_cast<std::uint32_t>(std::max(lower, upper)));
}

void set_homing(Steps& steps, const AxisConfig& axis) {
  if (!axis.homing) return;
  const auto counts = [&axis](double value) {
    return static_cast<std::uint32_t>(
        std::max(1.0, std::round(value * std::abs(axis.units.counts_per_unit()))));
  };
  constexpr std::uint32_t kHomingBit = 1U << 5;
  steps.push_back({.kind = Kind::kExpect, .index = 0x6502, .value = kHomingBit, .mask = kHomingBit});
  add_write(steps, 0x6098, 0, 1, static_cast<std::uint32_t>(axis.homing->method));
  add_write(steps, 0x6099, 1, 4, counts(axis.homing->search_speed));
  add_write(steps, 0x6099, 2, 4, counts(axis.homing->zero_speed));
  add_write(steps, 0x609A, 0, 4, counts(axis.homing->acceleration));
  add_write(steps, 0x607C, 0, 4, 0);  // home is count 0
}

void map_targets(Steps& steps, const AxisConfig& axis, std::uint32_t cob) {
  constexpr std::uint32_t kControlword = 0x60400010, kTorqueOffset = 0x60B20010, kMaxTorque = 0x60720010;
  switch (axis.mode) {
    case DriveMode::kPosition:
      return map_pdo(steps, 0x1400, cob, 1,
                     {kControlword, 0x607A0020, axis.limits_force ? kMaxTorque : kTorqueOffset});
    case DriveMode::kVelocity:
      return map_pdo(steps, 0x1400, cob, 1, {kControlword, 0x60FF0020, kTorqueOffset});
    case DriveMode::kTorque:
      return map_pdo(steps, 0x1400, cob, 1, {kControlword, 0x60710010});
  }
}

}  // namespace

std::vector<SetupStep> setup_steps(const AxisConfig& axis, const DriveGroupConfig& config) {
  Steps steps;
  steps.reserve(64);
  const auto node = static_cast<std::uint32_t>(axis.node);
  const DriveTiming& t = config.timing;
  const auto mode_bit = 1U << (static_cast<int>(axis.mode) - 1);
  steps.push_back({.kind = Kind::kExpect, .index = 0x1000, .value = 402, .mask = 0xFFFF});
  // First stops a drive that an earlier process left enabled.
  const bool stop = config.reaction == FaultReaction::kHold || axis.brake;
  add_write(steps, 0x6007, 0, 2, stop ? 3 : 2);  // if the master is lost: quick stop, or voltage off
  add_write(steps, 0x605A, 0, 2,
            axis.brake ? 2 : 6);  // quick stop: on its ramp, then off by the brake, or hold
  add_write(steps, 0x6040, 0, 2, stop ? kCommandQuickStop : kCommandDisableVoltage);
  // Optional in CiA 402: a drive without it shows in 0x6061 what it does.
  steps.push_back({.kind = Kind::kExpect, .index = 0x6502, .value = mode_bit, .mask = mode_bit});
  steps.back().optional = true;
  steps.push_back(
      {.kind = Kind::kNear,
       .index = 0x6076,
       .value = static_cast<std::uint32_t>(std::lround(axis.units.rated_motor_torque_Nm() * 1e3))});
  add_write(steps, 0x6072, 0, 2,
            static_cast<std::uint32_t>(axis.max_torque / std::abs(axis.units.torque_per_mille())));
  add_write(steps, 0x6080, 0, 4, greatest_motor_rpm(axis));  // in torque mode, who else would limit the speed
  steps.back().optional = true;
  set_following(steps, axis);
  set_limits(steps, axis);
  set_homing(steps, axis);
  set_interpolation(steps, t.period_s);
  map_pdo(steps, 0x1800, kCobTpdo1 + node, 1, {0x60410010, 0x60640020, 0x60610008});
  map_pdo(steps, 0x1801, kCobTpdo2 + node, static_cast<std::uint32_t>(t.measure_every),
          {0x606C0020, 0x60770010});
  map_targets(steps, axis, kCobRpdo1 + node);
  // Where a drive has it: without targets it stops as without the master's heartbeat.
  add_write(steps, 0x1400, 5, 2, milliseconds(t.target_timeout_s));
  steps.back().optional = true;
  for (std::uint16_t i = 1; i < 4; ++i) {
    switch_pdo_off(steps, static_cast<std::uint16_t>(0x1400 + i), kCobRpdo1 + 0x100U * i + node);
    if (i == 2 && axis.digital_inputs) {
      map_pdo(steps, 0x1802, kCobTpdo3 + node, 1, {0x60FD0020});
      continue;
    }
    if (i > 1) switch_pdo_off(steps, static_cast<std::uint16_t>(0x1800 + i), kCobTpdo1 + 0x100U * i + node);
  }
  add_write(steps, 0x6060, 0, 1, static_cast<std::uint8_t>(axis.mode));
  add_write(steps, 0x1016, 1, 4,
            static_cast<std::uint32_t>(config.master_node) << 16 | milliseconds(t.heartbeat_timeout_s));
  add_write(steps, 0x1017, 0, 2, milliseconds(t.heartbeat_s));
  return steps;
}

}  // namespace phantom::can
