#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/can/can_bus.hpp"
#include "common/can/drive_config.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/runtime/configuration/fields.hpp"
#include "common/runtime/servo/periodic_loop.hpp"
#include "common/teleop/coupling/link_state.hpp"
#include "common/teleop/gripper/gripper.hpp"
#include "common/teleop/guards/loop_guard.hpp"

namespace phantom::runtime {

/// Readers of what slave_io.yaml and master_io.yaml have in common besides the drives: the name of the cell's
/// arm (empty: its only arm), the sections `link` and `loop`, and the servo's rate and scheduling.
/// read_servo_loop() returns the period in s. All throw ConfigError.
std::string arm_name(const std::filesystem::path& file);
void read_link(const Fields& link, teleop::LinkTiming& timing);
void read_loop_guard(const Fields& loop, double period_s, teleop::LoopGuardParameters& guard);
double read_servo_loop(const Fields& file, LoopScheduling& scheduling, bool& measure_bare_loop);

/// Returns the joints' names as in the URDF, for Fields::named().
std::vector<std::string> joint_names(const robot::SerialArm& arm);

/// Drives of an arm and their CAN buses: section `can` of slave_io.yaml and master_io.yaml.
struct DrivesConfig {
  can::DriveGroupConfig group;             ///< axes in joint order; one bit rate per bus
  std::vector<std::string> addresses;      ///< one per bus: can0 (SocketCAN) or user:NAME
  std::optional<can::AxisConfig> gripper;  ///< on one of the same buses, but no axis of the group
  double bus_wait_s = 10.0;                ///< greatest time to wait for a missing bus at the start
};

/// Parameter table drives.yaml of section `can`; appended to the tables of slave_io and master_io.
extern const char* const kDriveParameters;

/// Reads the section for the joints of an arm or a master. Their drives exert at most `max_torque` (N·m or N
/// at the joint) and are served every `period_s`. Throws ConfigError naming file, line, drive, key, value and
/// what is allowed. Refuses also a node id that is used twice, and a bus load above the budget (with the
/// numbers). `gripper`: if not null, the drive `gripper` is read, too: the width of that gripper as a sliding
/// axis.
DrivesConfig read_drives(const Fields& section, const std::vector<robot::Joint>& joints,
                         const core::JointArray& max_torque, double period_s,
                         const teleop::GripperLimits* gripper = nullptr);

/// Returns the drive of `arm.gripper`, which must be there, as a group of its own that leaves SYNC and
/// heartbeat to the arm's. It holds in a fault.
DrivesConfig gripper_drive(const DrivesConfig& arm);

/// Opens the buses in the configuration's order and waits for a bus that nobody serves yet. The log reports
/// the wait once; `on_wait` is called every half second with what is missing. Returns no buses if a stop was
/// requested meanwhile. Throws MissingError after bus_wait_s.
std::vector<std::unique_ptr<can::CanBus>> open_buses(const DrivesConfig& config,
                                                     const std::function<void(const std::string&)>& on_wait);

}  // namespace phantom::runtime
