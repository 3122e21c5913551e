#include "common/runtime/drives_config.hpp"

#include <spdlog/spdlog.h>

#include "common/core/clock.hpp"
#include "common/robot/joint_values.hpp"
#include "common/runtime/process.hpp"

namespace phantom::runtime {
namespace {

constexpr double kLeast = 1e-9;  // of what must be greater than 0
constexpr double kAskAgain_s = 0.5;

can::DriveMode mode_of(const ConfigReader& drive) {
  const std::string mode = drive.choice("mode", "torque", {"torque", "velocity", "position"});
  return mode == "torque"     ? can::DriveMode::kTorque
         : mode == "velocity" ? can::DriveMode::kVelocity
                              : can::DriveMode::kPosition;
}

can::AxisConfig read_axis(const ConfigReader& drive, const robot::Joint& joint, double max_torque,
                          int buses) {
  const bool slides = robot::is_prismatic(joint);
  can::AxisConfig axis;
  axis.name = joint.name;
  axis.bus =
      static_cast<std::size_t>(drive.integer("bus", 0, {0, buses - 1.0, "(places in the list of buses)"}));
  axis.node = drive.integer("node", {1, 127, ""});
  axis.mode = mode_of(drive);
  can::AxisUnits& units = axis.units;
  units.counts_per_turn = drive.number("counts_per_turn", {kLeast, 1e9, "counts per turn of the motor"});
  units.gear_ratio =
      drive.number("gear_ratio", 1.0, {kLeast, 1e5, "turns of the motor per turn of the output"});
  if (slides)
    units.travel_per_turn = drive.number("travel_per_turn_m", {kLeast, 1e3, "m per turn of the output"});
  units.torque_constant_Nm_per_A = drive.number("torque_constant_Nm_per_A", {kLeast, 1e3, "N·m/A"});
  units.rated_current_A = drive.number("rated_current_A", {kLeast, 1e4, "A"});
  units.sign = drive.integer("sign", 1, {-1, 1, ""});
  if (units.sign == 0) throw drive.error("sign", "gives no direction; allowed: 1 or -1");
  units.offset = slides ? drive.number("offset_m", 0.0, {-1e3, 1e3, "m"})
                        : drive.number("offset_rad", 0.0, {-1e3, 1e3, "rad"});
  units.velocity_counts_per_turn = drive.number(
      "velocity_counts_per_turn", 0.0, {0, 1e9, "velocity counts per turn/s; 0: as counts_per_turn"});
  axis.lower = joint.lower;
  axis.upper = joint.upper;
  axis.max_speed = joint.max_speed;
  axis.max_torque = max_torque;
  return axis;
}

can::DriveTiming read_timing(const ConfigReader& section, double period_s) {
  can::DriveTiming t;
  t.period_s = period_s;
  t.measure_every = section.integer("measure_every", t.measure_every, {1, 240, "cycles"});
  t.heartbeat_s = section.number("heartbeat_s", t.heartbeat_s, {0.002, 10, "s"});
  t.heartbeat_timeout_s = section.number("heartbeat_timeout_s", t.heartbeat_timeout_s, {0.004, 30, "s"});
  if (t.heartbeat_timeout_s < 2 * t.heartbeat_s) {
    throw section.error("heartbeat_timeout_s", "is less than two heartbeats; allowed: at least " +
                                                   std::to_string(2 * t.heartbeat_s) + " s");
  }
  t.most_missed = section.integer("most_missed", t.most_missed, {1, 1000, "cycles"});
  t.sdo_timeout_s = section.number("sdo_timeout_s", t.sdo_timeout_s, {0.005, 10, "s"});
  t.boot_timeout_s = section.number("boot_timeout_s", t.boot_timeout_s, {0.05, 60, "s"});
  t.state_timeout_s = section.number("state_timeout_s", t.state_timeout_s, {0.01, 60, "s"});
  return t;
}

void read_axes(const ConfigReader& drives, const robot::SerialArm& arm, const core::JointArray& max_torque,
               DrivesConfig& config) {
  const int buses = static_cast<int>(config.addresses.size());
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const robot::Joint& joint = arm.joints()[j];
    const ConfigReader drive = drives.section(joint.name);
    can::AxisConfig axis = read_axis(drive, joint, max_torque[j], buses);
    if (axis.node == config.group.master_node)
      throw drive.error("node", "is the master's (can.master_node); allowed: another node id");
    for (const can::AxisConfig& other : config.group.axes) {
      if (other.bus == axis.bus && other.node == axis.node)
        throw drive.error("node", "is that of " + other.name +
                                      " on the same bus; allowed: a node id that nobody else on its bus has");
    }
    config.group.axes.push_back(std::move(axis));
  }
}

}  // namespace

DrivesConfig read_drives(const ConfigReader& section, const robot::SerialArm& arm,
                         const core::JointArray& max_torque, double period_s) {
  DrivesConfig config;
  config.group.bit_rates.clear();
  for (const ConfigReader& bus : section.sections("buses")) {
    config.addresses.push_back(bus.text("address"));
    config.group.bit_rates.push_back(bus.number("bit_rate", 1e6, {1e4, 1e6, "bit/s"}));
  }
  if (config.addresses.empty() || config.addresses.size() > 8)
    throw section.error("buses",
                        "names " + std::to_string(config.addresses.size()) +
                            " buses; allowed: 1 to 8, each with address (can0 or user:NAME) and bit_rate");
  config.bus_wait_s = section.number("bus_wait_s", config.bus_wait_s, {0, 3600, "s"});
  config.group.reaction = section.choice("on_fault", "hold", {"hold", "coast"}) == "hold"
                              ? can::FaultReaction::kHold
                              : can::FaultReaction::kCoast;
  config.group.master_node = section.integer("master_node", config.group.master_node, {1, 127, ""});
  config.group.load_budget = section.number("load_budget", config.group.load_budget, {0.01, 1, ""});
  config.group.timing = read_timing(section, period_s);
  read_axes(section.section("drives"), arm, max_torque, config);
  if (const core::Status status = can::check(config.group); !status)
    throw section.error("drives", status.message());
  return config;
}

std::vector<std::unique_ptr<can::CanBus>> open_buses(const DrivesConfig& config,
                                                     const std::function<void(const std::string&)>& on_wait) {
  std::vector<std::unique_ptr<can::CanBus>> buses;
  const core::Nanoseconds limit_ns = core::monotonic_ns() + core::from_seconds(config.bus_wait_s);
  std::string said;
  while (buses.size() < config.addresses.size()) {
    auto bus = can::open_bus(config.addresses[buses.size()]);
    if (bus) {
      buses.push_back(std::move(bus).value());
      continue;
    }
    if (bus.status().code() != core::ErrorCode::kNotFound) throw core::ConfigError(bus.status().message());
    if (core::monotonic_ns() >= limit_ns) throw core::MissingError(bus.status().message());
    if (said != bus.status().message()) {
      said = bus.status().message();
      spdlog::info("waiting: {}", said);
    }
    on_wait(said);
    if (!sleep_unless_stopped(kAskAgain_s)) return {};
  }
  return buses;
}

}  // namespace phantom::runtime
