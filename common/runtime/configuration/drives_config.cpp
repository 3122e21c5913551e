#include "common/runtime/configuration/drives_config.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "common/core/clock.hpp"
#include "common/robot/kinematics/joint_values.hpp"
#include "common/runtime/process/process.hpp"

namespace phantom::runtime {
namespace {

constexpr double kAskAgain_s = 0.5;

// λ: the motor's torque per ampere, or per volt of an amplifier that takes its torque as a voltage.
void read_sensitivity(const Fields& drive, can::AxisUnits& units) {
  if (!drive.has("torque_sensitivity_Nm_per_V") && !drive.has("rated_voltage_V")) {
    drive.number("torque_constant_Nm_per_A", units.torque_constant_Nm_per_A);
    drive.number("rated_current_A", units.rated_current_A);
    return;
  }
  drive.check(!drive.has("torque_constant_Nm_per_A") && !drive.has("rated_current_A"),
              "torque_sensitivity_Nm_per_V",
              "stands beside those of a current; allowed: torque_constant_Nm_per_A and rated_current_A, or "
              "torque_sensitivity_Nm_per_V and rated_voltage_V");
  drive.number("torque_sensitivity_Nm_per_V", units.torque_sensitivity_Nm_per_V);
  drive.number("rated_voltage_V", units.rated_voltage_V);
}

void read_units(const Fields& drive, bool slides, can::AxisUnits& units) {
  drive.number("counts_per_turn", units.counts_per_turn);
  drive.number("gear_ratio", units.gear_ratio);
  if (slides) drive.number("travel_per_turn_m", units.travel_per_turn);
  read_sensitivity(drive, units);
  drive.number("sign", units.sign);
  drive.check(units.sign != 0, "sign", "gives no direction; allowed: 1 or -1");
  drive.number(slides ? "offset_m" : "offset_rad", units.offset);
  drive.number("velocity_counts_per_turn", units.velocity_counts_per_turn);
}

void read_optional(const Fields& drive, const std::string& key, std::optional<double>& value) {
  if (drive.has(key)) drive.number(key, value.emplace());
}

void read_homing(const Fields& section, bool slides, can::HomingConfig& homing) {
  section.number("method", homing.method);
  section.number(slides ? "search_speed_m_s" : "search_speed_rad_s", homing.search_speed);
  section.number(slides ? "zero_speed_m_s" : "zero_speed_rad_s", homing.zero_speed);
  section.number(slides ? "acceleration_m_s2" : "acceleration_rad_s2", homing.acceleration);
  section.number("timeout_s", homing.timeout_s);
}

can::AxisConfig read_axis(const Fields& drive, const robot::Joint& joint, double max_torque,
                          const DrivesConfig& config) {
  can::AxisConfig axis{.name = joint.name,
                       .lower = joint.lower,
                       .upper = joint.upper,
                       .max_speed = joint.max_speed,
                       .max_torque = max_torque};
  drive.number("bus", axis.bus);
  drive.check(
      axis.bus < config.addresses.size(), "bus",
      "is no place in the list of buses; allowed: 0 to " + std::to_string(config.addresses.size() - 1));
  drive.number("node", axis.node);
  using enum can::DriveMode;
  drive.choice("mode", axis.mode, {{"torque", kTorque}, {"velocity", kVelocity}, {"position", kPosition}});
  const bool slides = robot::is_prismatic(joint);
  read_units(drive, slides, axis.units);
  read_optional(drive, slides ? "following_window_m" : "following_window_rad", axis.following_window);
  read_optional(drive, "following_time_s", axis.following_time_s);
  read_optional(drive, slides ? "limits_margin_m" : "limits_margin_rad", axis.limits_margin);
  if (drive.has("homing")) read_homing(drive.section("homing"), slides, axis.homing.emplace());
  bool brake = false;
  drive.choice("brake", brake, {{"none", false}, {"drive", true}});
  can::BrakeConfig delays;
  drive.number("brake_release_s", delays.release_s);
  drive.number("brake_engage_s", delays.engage_s);
  if (brake) axis.brake = delays;
  drive.check(axis.node != config.group.master_node, "node",
              "is the master's (can.master_node); allowed: another node id");
  for (const can::AxisConfig& other : config.group.axes)
    drive.check(other.bus != axis.bus || other.node != axis.node, "node",
                "is that of " + other.name +
                    " on the same bus; allowed: a node id that no other node on its bus has");
  return axis;
}

// The width of a gripper as a sliding axis.
can::AxisConfig read_gripper(const Fields& drives, const teleop::GripperLimits& limits,
                             const DrivesConfig& config) {
  drives.check(drives.has("gripper"), "gripper",
               "is missing; allowed: a mapping, as there is a section gripper");
  robot::Joint width;
  width.name = "gripper";
  width.type = robot::JointType::kPrismatic;
  width.upper = limits.widest_m;
  width.max_speed = limits.max_speed_m_s;
  const Fields drive = drives.section("gripper", "NAME");
  can::AxisConfig axis = read_axis(drive, width, limits.greatest_force_N, config);
  drive.check(axis.mode == can::DriveMode::kPosition, "mode", "is not that of a gripper; allowed: position");
  // Fingers that press on something stay behind their target for good.
  drive.check(axis.following_window.value_or(1.0) > teleop::GripperControl::kLead_m, "following_window_m",
              "is what fingers that grip are behind their target; allowed: more than " +
                  std::to_string(teleop::GripperControl::kLead_m) + " m");
  if (!axis.following_window) axis.following_window = 2.0 * limits.widest_m;
  axis.limits_force = true;
  return axis;
}

void read_timing(const Fields& section, can::DriveTiming& t) {
  section.number("measure_every", t.measure_every);
  section.number("heartbeat_s", t.heartbeat_s);
  section.number("heartbeat_timeout_s", t.heartbeat_timeout_s);
  section.check(t.heartbeat_timeout_s >= 2 * t.heartbeat_s, "heartbeat_timeout_s",
                "is less than two heartbeats; allowed: at least " + std::to_string(2 * t.heartbeat_s) + " s");
  t.target_timeout_s = t.heartbeat_timeout_s;
  section.number("target_timeout_s", t.target_timeout_s);
  section.number("most_missed", t.most_missed);
  section.number("sdo_timeout_s", t.sdo_timeout_s);
  section.number("boot_timeout_s", t.boot_timeout_s);
  section.number("state_timeout_s", t.state_timeout_s);
  section.number("mode_timeout_s", t.mode_timeout_s);
}

}  // namespace

std::string arm_name(const std::filesystem::path& file) { return Fields(file, {"arm:"}).text("arm"); }

void read_link(const Fields& link, teleop::LinkTiming& timing) {
  link.number("staleness_s", timing.staleness_s);
  link.number("round_trip_limit_s", timing.round_trip_limit_s);
  link.number("align_hold_s", timing.align_hold_s);
  link.number("recovery_s", timing.recovery_s);
}

void read_loop_guard(const Fields& loop, double period_s, teleop::LoopGuardParameters& guard) {
  guard.period_s = period_s;
  loop.number("late_limit_s", guard.late_limit_s);
  guard.late_limit_s = std::max(guard.late_limit_s, 2.0 * period_s);
  loop.number("window_s", guard.window_s);
  loop.number("most_late_s", guard.most_late_s);
  loop.check(guard.most_late_s < guard.window_s, "most_late_s",
             "is not less than the window; allowed: less than " + std::to_string(guard.window_s) + " s");
}

double read_servo_loop(const Fields& file, LoopScheduling& scheduling, bool& measure_bare_loop) {
  file.has("arm");  // read by arm_name()
  file.number("fifo_priority", scheduling.servo_priority);
  file.flag("lock_memory", scheduling.lock_memory);
  file.flag("measure_bare_loop", measure_bare_loop);
  return 1.0 / file.value("rate_Hz", 1000);
}

std::vector<std::string> joint_names(const robot::SerialArm& arm) {
  std::vector<std::string> names;
  for (const auto& joint : arm.joints()) names.push_back(joint.name);
  return names;
}

DrivesConfig read_drives(const Fields& section, const std::vector<robot::Joint>& joints,
                         const core::JointArray& max_torque, double period_s,
                         const teleop::GripperLimits* gripper) {
  DrivesConfig config;
  can::DriveGroupConfig& group = config.group;
  group.bit_rates.clear();
  group.timing.period_s = period_s;
  for (const Fields& bus : section.sections("buses")) {
    std::string address = bus.text("address");
    bus.check(std::ranges::find(config.addresses, address) == config.addresses.end(), "address",
              "is there already; allowed: each bus once");
    config.addresses.push_back(std::move(address));
    bus.number("bit_rate", group.bit_rates.emplace_back(1e6));
  }
  section.check(!config.addresses.empty() && config.addresses.size() <= 8, "buses",
                "names " + std::to_string(config.addresses.size()) +
                    " buses; allowed: 1 to 8, each with address (can0 or user:NAME) and bit_rate");
  section.number("bus_wait_s", config.bus_wait_s);
  section.choice("on_fault", group.reaction,
                 {{"hold", can::FaultReaction::kHold}, {"coast", can::FaultReaction::kCoast}});
  section.number("master_node", group.master_node);
  section.number("load_budget", group.load_budget);
  section.number("overspeed_ratio", group.overspeed_ratio);
  read_timing(section, group.timing);
  const Fields drives = section.section("drives");
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const std::string& name = joints[j].name;
    drives.check(drives.has(name), name, "is missing; allowed: a mapping");
    group.axes.push_back(read_axis(drives.section(name, "NAME"), joints[j], max_torque[j], config));
  }
  can::DriveGroupConfig together = group;
  if (gripper != nullptr)
    together.axes.push_back(config.gripper.emplace(read_gripper(drives, *gripper, config)));
  const core::Status status = can::check(together);
  section.check(static_cast<bool>(status), "drives", status ? "" : status.message());
  return config;
}

DrivesConfig gripper_drive(const DrivesConfig& arm) {
  DrivesConfig config = arm;
  can::AxisConfig axis = arm.gripper.value();
  config.addresses = {arm.addresses[axis.bus]};
  config.group.bit_rates = {arm.group.bit_rates[axis.bus]};
  config.group.sends_sync = false;
  config.group.reaction = can::FaultReaction::kHold;  // one that coasts would drop what it holds
  axis.bus = 0;
  config.group.axes = {axis};
  return config;
}

std::vector<std::unique_ptr<can::CanBus>> open_buses(const DrivesConfig& config,
                                                     const std::function<void(const std::string&)>& on_wait) {
  std::vector<std::unique_ptr<can::CanBus>> buses;
  const core::Nanoseconds limit_ns = core::monotonic_ns() + core::from_seconds(config.bus_wait_s);
  std::string reason;
  while (buses.size() < config.addresses.size()) {
    auto bus = can::open_bus(config.addresses[buses.size()]);
    if (bus) {
      buses.push_back(std::move(bus).value());
      continue;
    }
    if (bus.status().code() != core::ErrorCode::kNotFound) throw core::ConfigError(bus.status().message());
    if (core::monotonic_ns() >= limit_ns) throw core::MissingError(bus.status().message());
    if (reason != bus.status().message()) {
      reason = bus.status().message();
      spdlog::info("waiting: {}", reason);
    }
    on_wait(reason);
    if (!sleep_unless_stopped(kAskAgain_s)) return {};
  }
  return buses;
}

}  // namespace phantom::runtime
