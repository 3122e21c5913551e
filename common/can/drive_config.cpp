#include "common/can/drive_config.hpp"

#include <cmath>
#include <set>
#include <utility>

#include "common/can/bus_load.hpp"
#include "common/core/joints.hpp"
#include "common/core/text.hpp"

namespace phantom::can {
namespace {

using core::Status;

std::string number(double value) { return core::formatted("%.4g", value); }

Status out_of_range(const std::string& what, double value, const std::string& allowed) {
  return Status::invalid_argument(what + ": " + number(value) + "; allowed: " + allowed);
}

Status check_homing(const AxisConfig& axis) {
  if (!axis.homing) return Status::ok();
  const HomingConfig& h = *axis.homing;
  if (h.method < 1 || h.method > 37) return out_of_range(axis.name + ".homing.method", h.method, "1 to 37");
  for (const double value : {h.search_speed, h.zero_speed, h.acceleration, h.timeout_s})
    if (!(value > 0.0 && value * std::abs(axis.units.counts_per_unit()) < 4294967295.0))
      return out_of_range(axis.name + ".homing", value, "greater than 0 and within 32 bits of counts");
  if (!(axis.units.offset >= axis.lower && axis.units.offset <= axis.upper))
    return out_of_range(
        axis.name + ".offset", axis.units.offset,
        "where its home is, within its range of " + number(axis.lower) + " to " + number(axis.upper));
  return Status::ok();
}

Status check_watched(const AxisConfig& axis) {
  const double window = axis.following_window.value_or(1.0), time_s = axis.following_time_s.value_or(0.0);
  if (!(window > 0.0 && window * std::abs(axis.units.counts_per_unit()) < 4294967295.0))
    return out_of_range(axis.name + ".following_window", window,
                        "greater than 0 and within 32 bits of counts");
  if (!(time_s >= 0.0 && time_s <= 65.535))
    return out_of_range(axis.name + ".following_time_s", time_s, "0 to 65.535");
  const double margin = axis.limits_margin.value_or(0.0);
  if (!(margin >= 0.0 && std::isfinite(margin)))
    return out_of_range(axis.name + ".limits_margin", margin, "0 or more");
  for (const double delay_s :
       {axis.brake.value_or(BrakeConfig()).release_s, axis.brake.value_or(BrakeConfig()).engage_s})
    if (!(delay_s >= 0.0 && delay_s <= 10.0)) return out_of_range(axis.name + ".brake", delay_s, "0 to 10 s");
  if (axis.mode == DriveMode::kTorque && (axis.following_window || axis.following_time_s))
    return Status::invalid_argument(axis.name +
                                    ".following_window: a drive in torque mode has no target to follow; "
                                    "allowed: with mode position or velocity");
  return Status::ok();
}

Status check_axis(const AxisConfig& axis, std::size_t buses) {
  if (axis.bus >= buses)
    return out_of_range(axis.name + ".bus", static_cast<double>(axis.bus),
                        "less than " + std::to_string(buses));
  if (axis.node < 1 || axis.node > 127) return out_of_range(axis.name + ".node", axis.node, "1 to 127");
  if (!(std::isfinite(axis.lower) && std::isfinite(axis.upper) && axis.lower < axis.upper))
    return out_of_range(axis.name + ".lower", axis.lower, "less than upper, which is " + number(axis.upper));
  if (!(axis.max_speed > 0.0 && std::isfinite(axis.max_speed)))
    return out_of_range(axis.name + ".max_speed", axis.max_speed, "greater than 0");
  if (Status units = check_units(axis.units, axis.name, axis.lower, axis.upper); !units) return units;
  const double mille = axis.max_torque / std::abs(axis.units.torque_per_mille());
  if (!(mille >= 1.0 && mille <= 32767.0))
    return Status::invalid_argument(axis.name + ".max_torque: " + number(axis.max_torque) + " is " +
                                    number(mille) +
                                    " per mille of the drive's rated torque; allowed: 1 to 32767");
  if (Status homing = check_homing(axis); !homing) return homing;
  return check_watched(axis);
}

Status check_timing(const DriveTiming& t) {
  const struct {
    const char* name;
    double value, least, most;
  } times[] = {{"period_s", t.period_s, 0.00025, 0.1},
               {"heartbeat_s", t.heartbeat_s, 0.002, 10},
               {"heartbeat_timeout_s", t.heartbeat_timeout_s, 2 * t.heartbeat_s, 30},
               {"target_timeout_s", t.target_timeout_s, t.target_timeout_s > 0.0 ? 2 * t.period_s : 0.0, 60},
               {"sdo_timeout_s", t.sdo_timeout_s, 0.005, 10},
               {"boot_timeout_s", t.boot_timeout_s, 0.05, 60},
               {"state_timeout_s", t.state_timeout_s, 0.01, 60},
               {"mode_timeout_s", t.mode_timeout_s, 0.01, 60},
               {"measure_every", static_cast<double>(t.measure_every), 1, 240},
               {"most_missed", static_cast<double>(t.most_missed), 1, 1000}};
  for (const auto& time : times) {
    if (!(time.value >= time.least && time.value <= time.most))
      return out_of_range(time.name, time.value, number(time.least) + " to " + number(time.most));
  }
  return Status::ok();
}

Status check_load(const DriveGroupConfig& config, std::size_t bus) {
  const double rate = config.bit_rates[bus];
  if (!(rate >= 10e3 && rate <= 1e6))
    return out_of_range("bit_rates[" + std::to_string(bus) + "]", rate, "10000 to 1000000 bit/s");
  const BusLoad load = bus_load(config, bus);
  if (load.share <= config.load_budget) return Status::ok();
  std::size_t drives = 0;
  for (const AxisConfig& axis : config.axes) drives += axis.bus == bus ? 1 : 0;
  return Status::invalid_argument(
      "bus " + std::to_string(bus) + ": " + std::to_string(drives) + " drives need " +
      std::to_string(load.frames_per_cycle) + " frames, " + number(load.cycle_busy_s * 1e3) +
      " ms, in each cycle of " + number(config.timing.period_s * 1e3) +
      " ms: " + number(load.bits_per_s * 1e-3) + " kbit/s with heartbeats, " + number(load.share * 100) +
      " % of " + number(rate * 1e-3) + " kbit/s; allowed: at most " + number(config.load_budget * 100) +
      " %. Use a longer period, measure_every, or more buses");
}

}  // namespace

std::uint8_t target_pdo_bytes(DriveMode mode) noexcept {
  switch (mode) {
    case DriveMode::kPosition:
    case DriveMode::kVelocity:
      return 8;  // controlword, position or velocity, torque offset
    case DriveMode::kTorque:
      return 4;  // controlword, torque
  }
  return 8;
}

BusLoad bus_load(const DriveGroupConfig& config, std::size_t bus) {
  const DriveTiming& t = config.timing;
  double cycle_bits = worst_case_bits(0, false);
  double heartbeat_bits = worst_case_bits(1, false);  // the master's
  BusLoad load;
  load.frames_per_cycle = 1;
  for (const AxisConfig& axis : config.axes) {
    if (axis.bus != bus) continue;
    cycle_bits +=
        worst_case_bits(kStatePdoBytes, false) + worst_case_bits(target_pdo_bytes(axis.mode), false);
    cycle_bits += static_cast<double>(worst_case_bits(kMeasurePdoBytes, false)) / t.measure_every;
    cycle_bits += axis.digital_inputs ? worst_case_bits(kInputsPdoBytes, false) : 0;
    heartbeat_bits += worst_case_bits(1, false);
    load.frames_per_cycle += t.measure_every == 1 ? 3 : 2;
  }
  load.bits_per_s = cycle_bits / t.period_s + heartbeat_bits / t.heartbeat_s;
  load.share = load.bits_per_s / config.bit_rates[bus];
  load.cycle_busy_s = cycle_bits / config.bit_rates[bus];
  return load;
}

Status check(const DriveGroupConfig& config) {
  if (config.axes.empty() || config.axes.size() > core::kMaxJoints)
    return out_of_range("axes", static_cast<double>(config.axes.size()),
                        "1 to " + std::to_string(core::kMaxJoints));
  if (config.master_node < 1 || config.master_node > 127)
    return out_of_range("master_node", config.master_node, "1 to 127");
  if (!(config.load_budget > 0.0 && config.load_budget <= 1.0))
    return out_of_range("load_budget", config.load_budget, "greater than 0, at most 1");
  if (!(config.overspeed_ratio >= 1.05 && config.overspeed_ratio <= 100.0))
    return out_of_range("overspeed_ratio", config.overspeed_ratio, "1.05 to 100");
  if (Status timing = check_timing(config.timing); !timing) return timing;
  std::set<std::pair<std::size_t, int>> taken;
  for (const AxisConfig& axis : config.axes) {
    if (Status status = check_axis(axis, config.bit_rates.size()); !status) return status;
    if (axis.node == config.master_node || !taken.insert({axis.bus, axis.node}).second)
      return out_of_range(axis.name + ".node", axis.node, "a node id that no other node on its bus has");
  }
  for (std::size_t bus = 0; bus < config.bit_rates.size(); ++bus) {
    if (Status status = check_load(config, bus); !status) return status;
  }
  return Status::ok();
}

}  // namespace phantom::can
