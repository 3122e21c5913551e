#pragma once

#include <string>

#include "common/can/wrench_frames.hpp"
#include "common/runtime/configuration/drives_config.hpp"
#include "common/runtime/configuration/fields.hpp"
#include "common/teleop/guards/wrist_sensor.hpp"

namespace phantom::slave_io {

/// A force/torque sensor at the arm's wrist: section force_torque_sensor of slave_io.yaml.
struct WristSensorConfig {
  teleop::WristSensorParameters sensor;
  double rate_Hz = 0.0;
  double sensor_lag_s = 0.0;  ///< of the sensor's own filter
  std::string address;        ///< its CAN bus; empty: topic wrist_wrench
  can::WrenchFrames frames;   ///< on that bus
};

/// Returns by how much F_e lags, in s: the sensor's filter and ours, and the greatest age of a sample when a
/// servo of `period_s` uses it.
double force_lag_s(const WristSensorConfig& config, double period_s);

/// Reads the section for `arm`. `drives`: those whose buses the sensor may share; null: none. Throws
/// ConfigError naming file, line, key, value and what is allowed.
WristSensorConfig read_wrist_sensor(const runtime::Fields& section, const robot::SerialArm& arm,
                                    const runtime::DrivesConfig* drives);

/// Opens the sensor's bus, if it has one, and waits a second for a whole measurement. Returns what was found,
/// in words. Throws MissingError if the bus is missing or nothing comes; a userspace bus may be missing.
std::string check_wrist_bus(const WristSensorConfig& config);

}  // namespace phantom::slave_io
