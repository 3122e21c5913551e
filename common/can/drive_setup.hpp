#pragma once

#include <cstdint>
#include <vector>

#include "common/can/drive_config.hpp"

namespace phantom::can {

/// One step of a drive's configuration by SDO.
struct SetupStep {
  enum class Kind : std::uint8_t {
    kExpect,  ///< read; (value read & mask) must equal value
    kNear,    ///< read; the value read must be within 1 % of value
    kKeep,    ///< read; (value read & mask) is kept for the writes that have keep set; never refused
    kWrite,
  };
  Kind kind = Kind::kWrite;
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::uint8_t size = 4;  ///< bytes of a write
  std::uint32_t value = 0;
  std::uint32_t mask = 0xFFFFFFFF;
  bool optional = false;  ///< the drive may lack this object
  bool keep = false;      ///< a write: the bits of the last kKeep are set in the value
};

/// Returns the SDO accesses that configure a drive in pre-operational state, in order. They check profile,
/// supported mode and torque scale, and set reactions, limits of torque, speed and position, following error,
/// interpolation time, PDO mapping, mode, and how long a drive waits for heartbeats and targets. CiA 301,
/// 402.
std::vector<SetupStep> setup_steps(const AxisConfig& axis, const DriveGroupConfig& config);

}  // namespace phantom::can
