#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/can/can_bus.hpp"
#include "common/can/drive_config.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/runtime/fields.hpp"
#include "common/runtime/periodic_loop.hpp"
#include "common/teleop/link_state.hpp"

namespace phantom::runtime {

/// What slave_io.yaml and master_io.yaml have in common, beside the drives: the name of the cell's arm
/// (empty: its only one), section `link`, and the servo's rate and scheduling, of which the period in s is
/// returned. Each throws ConfigError.
std::string arm_name(const std::filesystem::path& file);
void read_link(const Fields& link, teleop::LinkTiming& timing);
double read_servo_loop(const Fields& file, LoopScheduling& scheduling, bool& measure_bare_loop);

/// The joints' names, as the URDF has them: for Fields::named().
std::vector<std::string> joint_names(const robot::SerialArm& arm);

/// The drives of an arm and the CAN buses they are on: section `can` of slave_io.yaml and master_io.yaml.
struct DrivesConfig {
  can::DriveGroupConfig group;         ///< axes in joint order; one bit rate per bus
  std::vector<std::string> addresses;  ///< of the buses: can0 (SocketCAN) or user:NAME
  double bus_wait_s = 10.0;            ///< how long a bus may be missing at the start
};

/// drives.yaml: the table of section `can`, which stands behind those of slave_io and master_io.
extern const char* const kDriveParameters;

/// Reads the section for `arm`, whose drives give at most `max_torque` (N·m or N at the joint) and are served
/// every `period_s`. Throws ConfigError naming file, line, drive, key, value and what is allowed; also for a
/// node id that is used twice and for a bus that would carry more than its budget (with the numbers).
DrivesConfig read_drives(const Fields& section, const robot::SerialArm& arm,
                         const core::JointArray& max_torque, double period_s);

/// Opens the buses, in the configuration's order. A bus that nobody serves yet is waited for: the log says so
/// once, and `on_wait` is told what is missing every half second. None are returned if a stop was requested
/// meanwhile. Throws MissingError after bus_wait_s.
std::vector<std::unique_ptr<can::CanBus>> open_buses(const DrivesConfig& config,
                                                     const std::function<void(const std::string&)>& on_wait);

}  // namespace phantom::runtime
