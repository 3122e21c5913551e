#include "common/can/arm_drives.hpp"

#include <algorithm>

#include "common/core/text.hpp"

namespace phantom::can {

ArmDrives::ArmDrives(const DriveGroupConfig& config, const core::JointArray& tolerance,
                     std::vector<std::unique_ptr<CanBus>> buses)
    : config_(config), tolerance_(tolerance), group_(config, std::move(buses)) {
  const auto sends = std::find_if(config_.axes.begin(), config_.axes.end(),
                                  [](const AxisConfig& axis) { return axis.digital_inputs; });
  inputs_axis_ = static_cast<std::size_t>(sends - config_.axes.begin());
  for (std::size_t b = 0; b < config_.bit_rates.size(); ++b)
    worst_load_ = std::max(worst_load_, bus_load(config_, b).share);
}

const ArmDrivesSense& ArmDrives::sense() noexcept {
  const DriveGroupReport& r = group_.listen();
  // A drive that has lost its home says so; one that is only silent is where it was.
  const bool lost =
      std::any_of(r.drives.begin(), r.drives.end(), [](const DriveReport& d) { return d.needs_homing; });
  sense_.known = (sense_.known && !lost) || r.has_positions;
  sense_.needs_homing = r.needs_homing;
  sense_.homing = r.homing;
  sense_.position = r.position;
  sense_.velocity = r.velocity;
  sense_.torque = r.torque;
  sense_.current = r.current;
  sense_.follows = r.state == DriveGroupState::kEnabled;
  were_ready_ = were_ready_ || (r.state != DriveGroupState::kStarting && r.state != DriveGroupState::kFault);
  published_.refused = merely_refused();
  sense_.fault = r.state == DriveGroupState::kFault && !published_.refused;
  if (inputs_axis_ < config_.axes.size()) {
    const DriveReport& drive = group_.drive(inputs_axis_);
    sense_.inputs = {drive.digital_inputs, drive.inputs_ns};
  }
  return sense_;
}

// Returns whether the drives' only fault is that they refuse settings, and none has been ready since the
// start: nothing had power, and a reset would change nothing.
bool ArmDrives::merely_refused() const noexcept {
  const DriveGroupReport& r = group_.report();
  return !were_ready_ && r.state == DriveGroupState::kFault &&
         std::all_of(r.drives.begin(), r.drives.end(), [](const DriveReport& d) {
           return d.phase != DrivePhase::kFault || d.fault == DriveFault::kSetupRefused;
         });
}

// Returns a joint outside its range: with power it would be driven back into the range at once.
std::int32_t ArmDrives::joint_outside() const noexcept {
  for (std::size_t j = 0; j < config_.axes.size(); ++j) {
    const double q = sense_.position[j];
    const AxisConfig& axis = config_.axes[j];
    // Nor beyond the drive's own limits: there it would pull the joint back at its own speed.
    const double beyond = std::min(tolerance_[j], axis.limits_margin.value_or(tolerance_[j]));
    if (!(q >= axis.lower - beyond && q <= axis.upper + beyond)) return static_cast<std::int32_t>(j);
  }
  return -1;
}

void ArmDrives::step(DriveCommand command, core::Nanoseconds now_ns) noexcept {
  published_.outside = sense_.known && !sense_.follows ? joint_outside() : -1;
  published_.permitted = command.enable;
  command.enable = command.enable && sense_.known && published_.outside < 0;
  command.hold = config_.reaction == FaultReaction::kHold;
  published_.report = group_.step(command, now_ns);
  for_health_.write(published_);
}

void ArmDrives::end(core::Nanoseconds now_ns) noexcept {
  // Two steps: frames sent after one SYNC take effect with the next.
  for (int i = 0; i < 2; ++i) group_.step({.quick_stop = config_.reaction == FaultReaction::kHold}, now_ns);
}

std::string ArmDrives::why_not_following() const {
  if (std::string drive = describe(read_.report, config_.axes); !drive.empty()) return drive;
  if (read_.outside < 0) {
    const std::string state = std::string("the drives are in state ") + name_of(read_.report.state);
    return read_.permitted ? state : state + ", power is withheld";
  }
  const auto j = static_cast<std::size_t>(read_.outside);
  const AxisConfig& axis = config_.axes[j];
  return axis.name + core::formatted(" stands at %.4g, outside its range of %.4g to %.4g: power stays off",
                                     read_.report.position[j], axis.lower, axis.upper);
}

core::ActuatorHealth ArmDrives::health(const char* reset) {
  for_health_.read(read_);
  core::ActuatorHealth health;
  health.fault = read_.report.state == DriveGroupState::kFault;
  health.follows = read_.report.state == DriveGroupState::kEnabled;
  if (!health.follows) health.message = why_not_following();
  if (read_.refused) {
    health.message += "; power stays off: correct that, then restart this process";
  } else if (health.fault) {
    health.message +=
        config_.reaction == FaultReaction::kHold ? "; the drives hold until " : "; the drives coast until ";
    health.message += reset;
  }
  double missed = 0.0;
  for (const DriveReport& drive : read_.report.drives) missed += static_cast<double>(drive.missed);
  const std::string warnings = warnings_of(read_.report, config_.axes);
  health.message += (health.message.empty() || warnings.empty() ? "" : "; ") + warnings;
  health.figures = {{"bus_load_planned", worst_load_, ""},
                    {"sync_unanswered", missed, ""},
                    {"frames_not_sent", static_cast<double>(read_.report.not_sent), ""}};
  return health;
}

}  // namespace phantom::can
