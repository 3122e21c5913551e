#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/can/can_bus.hpp"
#include "common/can/drive_config.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/runtime/config_reader.hpp"

namespace phantom::runtime {

/// The drives of an arm and the CAN buses they are on: section `can` of slave_io.yaml and master_io.yaml.
struct DrivesConfig {
  can::DriveGroupConfig group;         ///< axes in joint order; one bit rate per bus
  std::vector<std::string> addresses;  ///< of the buses: can0 (SocketCAN) or user:NAME
  double bus_wait_s = 10.0;            ///< how long a bus may be missing at the start
};

/// Reads the section for `arm`, whose drives give at most `max_torque` (N·m or N at the joint) and are served
/// every `period_s`. Throws ConfigError naming file, line, drive, key, value and what is allowed; also for a
/// node id that is used twice and for a bus that would carry more than its budget (with the numbers).
DrivesConfig read_drives(const ConfigReader& section, const robot::SerialArm& arm,
                         const core::JointArray& max_torque, double period_s);

/// Opens the buses, in the configuration's order. A bus that nobody serves yet is waited for: the log says so
/// once, and `on_wait` is told what is missing every half second. None are returned if a stop was requested
/// meanwhile. Throws MissingError after bus_wait_s.
std::vector<std::unique_ptr<can::CanBus>> open_buses(const DrivesConfig& config,
                                                     const std::function<void(const std::string&)>& on_wait);

}  // namespace phantom::runtime
