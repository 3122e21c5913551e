#include "common/can/drive_group.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/text.hpp"

namespace phantom::can {
namespace {

constexpr int kMaxFramesPerCycle = 512;  // of one bus: four milliseconds of the shortest frames at 1 Mbit/s

constexpr double kApproach_s = 0.2;  // an axis in velocity mode slows down this long before its range ends

bool is_ready(DrivePhase phase) noexcept {
  return phase == DrivePhase::kReady || phase == DrivePhase::kEnabling || phase == DrivePhase::kEnabled ||
         phase == DrivePhase::kQuickStop;
}

bool is_off(BusState state) noexcept { return state == BusState::kBusOff || state == BusState::kDown; }

PlausibilityParameters plausibility_of(const AxisConfig& axis, const DriveGroupConfig& config) {
  constexpr double kTurn_rad = 6.283185307179586;
  return {.max_speed = axis.max_speed,
          .max_torque = axis.max_torque,
          .count = 1.0 / std::abs(axis.units.counts_per_unit()),
          .period_s = config.timing.period_s,
          .measure_every = config.timing.measure_every,
          .overspeed_ratio = config.overspeed_ratio,
          .sliding = axis.units.travel_per_turn != kTurn_rad};
}

}  // namespace

const char* name_of(DriveGroupState state) noexcept {
  constexpr const char* kNames[] = {"starting", "ready", "enabling", "enabled", "quick stop", "fault"};
  return kNames[static_cast<std::size_t>(state)];
}

DriveGroup::DriveGroup(const DriveGroupConfig& config, std::vector<std::unique_ptr<CanBus>> buses)
    : config_(config), buses_(buses.size()) {
  for (std::size_t b = 0; b < buses.size(); ++b) {
    buses_[b].port = std::move(buses[b]);
    buses_[b].axis_of_node.fill(-1);
  }
  drives_.reserve(config_.axes.size());
  monitors_.reserve(config_.axes.size());
  targets_.resize(config_.axes.size());
  for (std::size_t a = 0; a < config_.axes.size(); ++a) {
    const AxisConfig& axis = config_.axes[a];
    drives_.emplace_back(axis, config_);
    monitors_.emplace_back(plausibility_of(axis, config_));
    buses_[axis.bus].axis_of_node[static_cast<std::size_t>(axis.node)] = static_cast<std::int8_t>(a);
  }
}

void DriveGroup::take_frames(Bus& bus) noexcept {
  Received received;
  for (int i = 0; i < kMaxFramesPerCycle && bus.port->receive(received); ++i) {
    if (!received.is_frame() || received.frame.extended) continue;
    const std::int8_t axis = bus.axis_of_node[received.frame.id & 0x7F];
    if (axis >= 0) drives_[static_cast<std::size_t>(axis)].on_frame(received.frame, received.time_ns);
  }
}

// Returns whether the drives have to leave their faults now: once per rising edge, as soon as all buses are
// back.
bool DriveGroup::take_reset(bool requested) noexcept {
  const bool edge = requested && !reset_before_;
  reset_before_ = requested;
  bool all_on = true;
  for (Bus& bus : buses_) {
    if (!is_off(bus.port->state())) continue;
    if (edge) static_cast<void>(bus.port->restart());  // a failure shows in the bus's state
    all_on = all_on && !is_off(bus.port->state());
  }
  reset_pending_ = reset_pending_ || edge;
  if (!reset_pending_ || !all_on) return false;
  reset_pending_ = false;
  fault_latched_ = false;
  return true;
}

// Homing begins with the command's edge and takes one drive after the other. A stop or a fault ends it.
void DriveGroup::choose_homing(const DriveCommand& command) noexcept {
  const bool edge = command.home && !home_before_;
  home_before_ = command.home;
  homing_begun_ = homing_begun_ && homing_;
  homing_ = (homing_ || (edge && report_.needs_homing)) && !fault_latched_ && !command.quick_stop;
  if (!homing_) return;
  const DrivePhase phase = drives_[homing_axis_].report().phase;
  const bool busy = phase == DrivePhase::kHoming || (phase == DrivePhase::kReferencing && homing_begun_);
  homing_begun_ = true;
  if (busy) return;
  const auto next =
      std::find_if(drives_.begin(), drives_.end(), [](const Drive& d) { return d.report().needs_homing; });
  homing_ = next != drives_.end();
  if (homing_) homing_axis_ = static_cast<std::size_t>(next - drives_.begin());
}

void DriveGroup::check_feedback(std::size_t a, const DriveCommand& command,
                                core::Nanoseconds now_ns) noexcept {
  constexpr std::uint16_t kInternalLimit = 1U << 11;  // of the statusword (CiA 402)
  constexpr double kNearlyFull = 0.9;
  Drive& drive = drives_[a];
  if (!drive.is_powered_phase()) return monitors_[a].reset();
  if (command.implausible_axis == static_cast<int>(a))
    return drive.fail_implausible(command.implausible, now_ns);
  if (!drive.answered_sync()) return;
  const DriveReport& r = drive.report();
  const AxisConfig& axis = config_.axes[a];
  const double torque = axis.units.torque(r.torque_mille);
  const bool limited = axis.limits_force || (r.statusword & kInternalLimit) != 0 ||
                       std::abs(torque) > kNearlyFull * axis.max_torque;
  const ImplausibleMotion motion = monitors_[a].step({.at_ns = buses_[axis.bus].sync_ns,
                                                      .position = axis.units.position(r.position_counts),
                                                      .velocity = axis.units.velocity(r.velocity_counts),
                                                      .torque = torque,
                                                      .moves_freely = drive.moves_freely(now_ns),
                                                      .target_kind = targets_[a].kind,
                                                      .target = targets_[a].value,
                                                      .limited = limited});
  if (motion.reason != Implausibility::kNone) drive.fail_implausible(motion, now_ns);
}

// A drive that is to press with a greatest force may stand still, or be pushed back, at any target.
void DriveGroup::note_target(std::size_t a, const DriveTargets& sent) noexcept {
  const AxisConfig& axis = config_.axes[a];
  if (!drives_[a].follows() || axis.limits_force) {
    targets_[a] = {};
  } else if (axis.mode == DriveMode::kPosition) {
    targets_[a] = {TargetKind::kPosition, axis.units.position(sent.position_counts)};
  } else if (axis.mode == DriveMode::kVelocity) {
    targets_[a] = {TargetKind::kVelocity, axis.units.velocity(sent.velocity_counts)};
  } else {
    targets_[a] = {TargetKind::kTorque, axis.units.torque(sent.torque_mille)};
  }
}

DriveGoal DriveGroup::goal_of(const DriveCommand& command, std::size_t axis) const noexcept {
  const Drive& drive = drives_[axis];
  if (fault_latched_)
    return config_.reaction == FaultReaction::kHold ? DriveGoal::kQuickStop : DriveGoal::kOff;
  if (command.quick_stop) return DriveGoal::kQuickStop;
  if (command.enable && all_ready_) return DriveGoal::kEnabled;
  if (homing_ && axis == homing_axis_) return DriveGoal::kHome;
  // No power yet, or no longer. A drive that holds goes on holding. With enable, the others are not all ready
  // to follow yet.
  const PowerState power = drive.report().power;
  const bool holds = power == PowerState::kQuickStopActive && (command.enable || command.hold);
  const bool stops = power == PowerState::kOperationEnabled && command.hold;
  return holds || stops ? DriveGoal::kQuickStop : DriveGoal::kOff;
}

const DriveGroupReport& DriveGroup::listen() noexcept {
  for (Bus& bus : buses_) take_frames(bus);
  update_motion();
  report_.current =
      std::all_of(drives_.begin(), drives_.end(), [](const Drive& drive) { return drive.is_current(); });
  return report_;
}

const DriveGroupReport& DriveGroup::step(const DriveCommand& command, core::Nanoseconds now_ns) noexcept {
  // An answer to the SYNC that another group has just sent must not count as one to the last.
  if (config_.sends_sync)
    for (Bus& bus : buses_) take_frames(bus);
  const bool reset = take_reset(command.reset);
  choose_homing(command);
  for (std::size_t a = 0; a < drives_.size(); ++a) {
    Bus& bus = buses_[config_.axes[a].bus];
    check_feedback(a, command, now_ns);
    drives_[a].step(goal_of(command, a), reset, bus.port->state(), now_ns, bus.others);
    fault_latched_ = fault_latched_ || drives_[a].report().phase == DrivePhase::kFault;
  }
  all_ready_ =
      std::all_of(drives_.begin(), drives_.end(), [](const Drive& d) { return is_ready(d.report().phase); });
  for (std::size_t a = 0; a < drives_.size(); ++a) {
    const DriveTargets targets = targets_of(command, a);
    note_target(a, targets);
    drives_[a].send_targets(targets, buses_[config_.axes[a].bus].targets);
  }
  for (std::size_t b = 0; b < buses_.size(); ++b) send(buses_[b], b, command.hasten, now_ns);
  update_report(command);
  return report_;
}

double DriveGroup::finite_or_zero(double value) noexcept {
  if (std::isfinite(value)) return value;
  ++report_.refused_values;
  return 0.0;
}

double DriveGroup::lead_position(double wanted, std::size_t a) noexcept {
  const AxisConfig& axis = config_.axes[a];
  double& reference = reference_[a];
  if (!drives_[a].follows()) return reference = axis.units.position(drives_[a].report().position_counts);
  if (!std::isfinite(wanted)) {
    ++report_.refused_values;
    return reference;
  }
  const double furthest = axis.max_speed * config_.timing.period_s;
  return reference += std::clamp(std::clamp(wanted, axis.lower, axis.upper) - reference, -furthest, furthest);
}

DriveTargets DriveGroup::targets_of(const DriveCommand& command, std::size_t a) noexcept {
  const AxisConfig& axis = config_.axes[a];
  DriveTargets targets;
  const double torque = finite_or_zero(command.torque[a]);
  targets.torque_mille = axis.units.torque_mille(std::clamp(torque, -axis.max_torque, axis.max_torque));
  if (axis.limits_force) targets.torque_mille = static_cast<std::int16_t>(std::abs(targets.torque_mille));
  if (axis.mode == DriveMode::kPosition)
    targets.position_counts = axis.units.position_counts(lead_position(command.position[a], a));
  if (axis.mode == DriveMode::kVelocity) {
    const double fastest_up =
        std::clamp((axis.upper - report_.position[a]) / kApproach_s, 0.0, axis.max_speed);
    const double fastest_down =
        std::clamp((axis.lower - report_.position[a]) / kApproach_s, -axis.max_speed, 0.0);
    const double velocity = std::clamp(finite_or_zero(command.velocity[a]), fastest_down, fastest_up);
    targets.velocity_counts = axis.units.velocity_counts(velocity);
  }
  return targets;
}

bool DriveGroup::put(Bus& bus, const CanFrame& frame) noexcept {
  const bool sent = bus.port->send(frame) == SendResult::kSent;
  report_.not_sent += sent ? 0 : 1;
  return sent;
}

void DriveGroup::send_sync(Bus& bus, std::size_t index) noexcept {
  if (config_.sends_sync && !put(bus, sync_frame())) return;
  for (std::size_t a = 0; a < drives_.size(); ++a) {
    if (config_.axes[a].bus == index) drives_[a].on_sync();
  }
}

void DriveGroup::send(Bus& bus, std::size_t index, bool hasten, core::Nanoseconds now_ns) noexcept {
  bus.sync_ns = now_ns;
  if (!hasten) send_sync(bus, index);
  for (const CanFrame& frame : bus.targets.frames()) put(bus, frame);
  if (hasten) send_sync(bus, index);
  const bool due =
      bus.heartbeat_ns < 0 || core::seconds(now_ns - bus.heartbeat_ns) >= config_.timing.heartbeat_s;
  if (config_.sends_sync && due) {
    put(bus, heartbeat_frame(static_cast<std::uint8_t>(config_.master_node), NmtState::kOperational));
    bus.heartbeat_ns = now_ns;
  }
  for (const CanFrame& frame : bus.others.frames()) put(bus, frame);
  bus.targets.clear();
  bus.others.clear();
}

void DriveGroup::update_motion() noexcept {
  report_.has_positions = true;
  for (std::size_t a = 0; a < drives_.size(); ++a) {
    const DriveReport& r = drives_[a].report();
    const AxisUnits& units = config_.axes[a].units;
    const bool known = r.has_position && r.has_reference;
    report_.has_positions = report_.has_positions && known;
    if (!known) continue;
    report_.position[a] = units.position(r.position_counts);
    report_.velocity[a] = units.velocity(r.velocity_counts);
    report_.torque[a] = units.torque(r.torque_mille);
  }
}

void DriveGroup::update_report(const DriveCommand& command) noexcept {
  update_motion();
  bool all_enabled = true, any_enabling = false, all_stopping = true;
  for (std::size_t a = 0; a < drives_.size(); ++a) {
    const DriveReport& r = report_.drives[a] = drives_[a].report();
    all_enabled = all_enabled && r.phase == DrivePhase::kEnabled;
    all_stopping = all_stopping && r.phase == DrivePhase::kQuickStop;
    any_enabling = any_enabling || r.phase == DrivePhase::kEnabling;
  }
  const auto needs = [](const Drive& d) { return d.report().needs_homing; };
  report_.homing = homing_;
  report_.needs_homing = !fault_latched_ && std::any_of(drives_.begin(), drives_.end(), needs) &&
                         std::all_of(drives_.begin(), drives_.end(),
                                     [&](const Drive& d) { return needs(d) || is_ready(d.report().phase); });
  for (std::size_t b = 0; b < std::min(buses_.size(), DriveGroupReport::kMaxBuses); ++b)
    report_.buses[b] = buses_[b].port->state();
  report_.state = fault_latched_                   ? DriveGroupState::kFault
                  : !all_ready_                    ? DriveGroupState::kStarting
                  : all_enabled                    ? DriveGroupState::kEnabled
                  : all_stopping                   ? DriveGroupState::kQuickStop
                  : command.enable || any_enabling ? DriveGroupState::kEnabling
                                                   : DriveGroupState::kReady;
}

std::string describe(const DriveGroupReport& report, const std::vector<AxisConfig>& axes) {
  for (const DrivePhase wanted : {DrivePhase::kFault, DrivePhase::kSearching, DrivePhase::kConfiguring,
                                  DrivePhase::kStarting, DrivePhase::kResetting, DrivePhase::kHoming}) {
    for (std::size_t a = 0; a < axes.size(); ++a) {
      if (report.drives[a].phase == wanted) return describe(report.drives[a], axes[a].name);
    }
  }
  std::string unhomed;
  for (std::size_t a = 0; a < axes.size(); ++a)
    if (report.drives[a].needs_homing) core::add_to_list(unhomed, axes[a].name);
  if (!unhomed.empty()) return "to be homed, as their encoders are not absolute: " + unhomed;
  return report.state == DriveGroupState::kFault ? "drives wait for a reset" : "";
}

std::string warnings_of(const DriveGroupReport& report, const std::vector<AxisConfig>& axes) {
  std::string warnings;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    if (report.drives[a].warning_code != 0)
      core::add_to_list(warnings, core::formatted("%s warns (0x%04X)", axes[a].name.c_str(),
                                                  report.drives[a].warning_code));
  }
  return warnings;
}

}  // namespace phantom::can
