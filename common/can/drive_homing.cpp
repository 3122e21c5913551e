// A drive whose encoder is not absolute: it is asked whether it knows its home, and homed when a person asks
// for it.
#include "common/can/drive.hpp"

namespace phantom::can {

// Asks for a mode of operation; returns whether the drive shows it.
bool Drive::has_mode(std::int8_t mode, core::Nanoseconds now_ns, Outbox& out) noexcept {
  if (wanted_mode_ != mode) {
    wanted_mode_ = mode;
    wanted_ns_ = now_ns;
    asked_ns_ = -1;
  }
  // Whatever it shows: it is asked once at least.
  const bool own = mode == static_cast<std::int8_t>(mode_);
  if (asked_ns_ >= 0 && (own ? may_show_mode() : report_.mode == mode) &&
      sdo_.state() == SdoClient::State::kDone)
    return true;
  if (asked_ns_ < 0 || core::seconds(now_ns - asked_ns_) > timing_.sdo_timeout_s) {
    const std::array bytes{static_cast<std::uint8_t>(mode)};
    sdo_.start_write(0x6060, 0, bytes, now_ns);
    asked_ns_ = now_ns;
  }
  if (const auto frame = sdo_.poll(now_ns)) out.add(*frame);
  if (core::seconds(now_ns - wanted_ns_) > timing_.mode_timeout_s) fail(DriveFault::kModeMismatch, now_ns);
  return false;
}

// In homing mode bit 12 says whether the drive knows where home is. It has its own mode again before it is
// ready.
void Drive::reference(DriveGoal goal, core::Nanoseconds now_ns, Outbox& out) noexcept {
  const bool powered =
      report_.power == PowerState::kOperationEnabled || report_.power == PowerState::kQuickStopActive;
  controlword_ = powered && (goal != DriveGoal::kOff || brake_) ? kCommandQuickStop : kCommandDisableVoltage;
  if (!homed_) {
    if (!has_mode(kHomingMode, now_ns, out)) return;
    homed_ = (report_.statusword & kHomingAttained) != 0 && (report_.statusword & kHomingErrorBit) == 0;
    report_.needs_homing = !homed_;
    report_.has_reference = report_.has_reference && homed_;
    if (!homed_ && goal == DriveGoal::kHome) return enter(DrivePhase::kHoming, now_ns);
    if (!homed_) return;
  }
  if (!has_mode(static_cast<std::int8_t>(mode_), now_ns, out)) return;
  report_.has_reference = true;
  enter(DrivePhase::kReady, now_ns);
}

void Drive::home(DriveGoal goal, core::Nanoseconds now_ns) noexcept {
  if (goal != DriveGoal::kHome) {
    controlword_ = goal == DriveGoal::kOff && !brake_ ? kCommandDisableVoltage : kCommandQuickStop;
    return enter(DrivePhase::kReferencing, now_ns);
  }
  const PowerState power = report_.power;
  if (power != PowerState::kOperationEnabled) {
    if (homes_) return fail(DriveFault::kLeftEnabled, now_ns);
    controlword_ =
        brake_ && power == PowerState::kQuickStopActive ? kCommandQuickStop : towards_enabled(power);
    if (phase_age_s(now_ns) > enable_timeout_s()) fail(DriveFault::kEnableTimeout, now_ns);
    return;
  }
  controlword_ = kCommandEnableOperation;
  if (!brake_is_open(now_ns)) return;
  controlword_ |= kStartHoming;
  if (!homes_) {
    homes_ = true;
    return;
  }
  constexpr std::uint16_t kDone = kHomingAttained | kTargetReached;
  if ((report_.statusword & kDone) == kDone) return enter(DrivePhase::kReferencing, now_ns);
  if ((report_.statusword & kHomingErrorBit) != 0) return fail(DriveFault::kHomingError, now_ns);
  if (phase_age_s(now_ns) > homing_->timeout_s) fail(DriveFault::kHomingTimeout, now_ns);
}

}  // namespace phantom::can
