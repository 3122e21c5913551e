// Motion of the drive: how its targets move the motor.
#include <algorithm>
#include <cmath>

#include "components/simulated_drive/simulated_drive.hpp"

namespace phantom::simulated_drive {
namespace {

constexpr int kHoming = 6, kCyclicPosition = 8, kCyclicVelocity = 9, kCyclicTorque = 10;

}  // namespace

// Interpolates linearly to a new target within one interpolation period.
void SimulatedDrive::begin_interpolation() {
  const double period_s =
      static_cast<double>(od_.value(0x60C2, 1)) * std::pow(10.0, static_cast<double>(od_.value(0x60C2, 2)));
  if (state_ != Power::kEnabled || od_.value(0x6060) != kCyclicPosition) return;
  to_go_s_ = std::max(period_s, 1e-4);
  demand_speed_ = (within_limits(static_cast<double>(od_.value(0x607A))) - demand_counts_) / to_go_s_;
}

// Cuts a target position at the software limits (0x607D), which shows in the statusword.
double SimulatedDrive::within_limits(double counts) {
  const auto least = static_cast<double>(od_.value(0x607D, 1)),
             most = static_cast<double>(od_.value(0x607D, 2));
  limited_ = counts < least || counts > most;
  return std::clamp(counts, std::min(least, most), most);
}

// The target velocity, which ends at the software limits.
double SimulatedDrive::velocity_within_limits() {
  const auto target = static_cast<double>(od_.value(0x60FF)), at = static_cast<double>(counts());
  limited_ = target * (at - within_limits(at)) > 0.0;
  return limited_ ? 0.0 : target;
}

// At power-up: an absolute encoder knows where it is.
void SimulatedDrive::forget_position() {
  homed_ = !options_.incremental;
  zero_counts_ = options_.incremental ? motor().counts() : 0;
  homing_.stop();
}

MotionDemand SimulatedDrive::home(double dt_s) {
  using Kind = MotionDemand::Kind;
  if (!homing_.runs()) return {Kind::kPosition, demand_counts_, 0.0, static_cast<double>(od_.value(0x60B2))};
  const double speed = homing_.step(static_cast<double>(motor().counts()), dt_s);
  if (homing_.state() == Homing::State::kFound) {
    zero_counts_ = std::llround(homing_.home_counts()) - od_.value(0x607C);
    homed_ = true;
  }
  demand_counts_ = static_cast<double>(counts());
  return {Kind::kVelocity, 0.0, speed, static_cast<double>(od_.value(0x60B2))};
}

void SimulatedDrive::run_quick_stop(double dt_s) {
  const double slower = options_.motor.counts_per_rad() * options_.quick_stop_rad_s2 * dt_s;
  demand_speed_ =
      std::abs(demand_speed_) <= slower ? 0.0 : demand_speed_ - std::copysign(slower, demand_speed_);
  demand_counts_ += demand_speed_ * dt_s;
  const bool ends = state_ == Power::kFaultReaction || od_.value(0x605A) == 2;
  if (!ends || demand_speed_ != 0.0) return;
  closing_s_ += dt_s;  // the torque ends when the brake holds
  const BrakeParameters& brake = options_.motor.brake;
  if (brake.holds_Nm > 0.0 && closing_s_ < brake.engage_s) return;
  state_ = state_ == Power::kFaultReaction ? Power::kFault : Power::kSwitchOnDisabled;
}

MotionDemand SimulatedDrive::demand(double dt_s) {
  using Kind = MotionDemand::Kind;
  if (state_ == Power::kQuickStop || state_ == Power::kFaultReaction) {
    run_quick_stop(dt_s);
    return {Kind::kPosition, demand_counts_, demand_speed_, 0.0};
  }
  if (state_ != Power::kEnabled) return {};
  switch (od_.value(0x6060)) {
    case kHoming:
      return home(dt_s);
    case kCyclicPosition:
      if (to_go_s_ > 0.0) demand_counts_ += demand_speed_ * std::min(dt_s, to_go_s_);
      to_go_s_ = std::max(0.0, to_go_s_ - dt_s);
      if (to_go_s_ == 0.0) demand_speed_ = 0.0;
      return {Kind::kPosition, demand_counts_, demand_speed_, static_cast<double>(od_.value(0x60B2))};
    case kCyclicVelocity: {
      const double velocity = velocity_within_limits();
      demand_counts_ += velocity * dt_s;
      return {Kind::kVelocity, 0.0, velocity, static_cast<double>(od_.value(0x60B2))};
    }
    case kCyclicTorque: {
      const auto target = static_cast<double>(od_.value(0x6071));
      const double most_counts_s =
          static_cast<double>(od_.value(0x6080)) / 60.0 * options_.motor.counts_per_turn;
      const bool too_fast = motor().counts_per_s() * (target < 0.0 ? -1.0 : 1.0) > most_counts_s;
      return {Kind::kTorque, 0.0, 0.0, too_fast && !misbehaviour.ignore_max_speed ? 0.0 : target};
    }
    default:
      return {};
  }
}

// Watches the following error as object 0x6065 asks; its greatest value switches that off. In velocity mode,
// of which CiA 402 says nothing, the position is due that the target velocities lead to.
void SimulatedDrive::watch_following() {
  const std::int64_t mode = od_.value(0x6060), window = od_.value(0x6065);
  const bool watched = state_ == Power::kEnabled && (mode == kCyclicPosition || mode == kCyclicVelocity) &&
                       window != 0xFFFFFFFF;
  const double error = demand_counts_ - static_cast<double>(counts());
  const bool off_track = watched && std::abs(error) > static_cast<double>(window);
  if (!off_track) off_track_ns_ = -1;
  if (off_track && off_track_ns_ < 0) off_track_ns_ = now_ns_;
  following_error_ = off_track && now_ns_ - off_track_ns_ >= od_.value(0x6066) * core::kNsPerMillisecond;
  if (following_error_ && !misbehaviour.only_show_following_error) trip(0x8611);
}

void SimulatedDrive::move(double dt_s) {
  if (nmt_ == Nmt::kOperational) obey_controlword();
  const double limit = std::min(static_cast<double>(od_.value(0x6072)), 1e3 * options_.motor.peak_share);
  const bool stops = state_ == Power::kQuickStop || state_ == Power::kFaultReaction;
  if (!stops) closing_s_ = 0.0;
  loops_.set_brake_coil((state_ == Power::kEnabled || (stops && closing_s_ == 0.0)) &&
                        !misbehaviour.keep_brake);
  if (homing_.runs() && (state_ != Power::kEnabled || od_.value(0x6060) != kHoming)) homing_.stop();
  MotionDemand due = demand(dt_s);
  due.position += static_cast<double>(zero_counts_);
  torque_mille_ = loops_.step(due, limit, dt_s);
  torque_sum_mille_s_ += torque_mille_ * dt_s;
  torque_sum_s_ += dt_s;
  watch_following();
}

}  // namespace phantom::simulated_drive
