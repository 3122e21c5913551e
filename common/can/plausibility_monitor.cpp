#include "common/can/plausibility_monitor.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::can {
namespace {

constexpr double kJumpRatio = 4.0;       // of the greatest speed, between two answers
constexpr double kMemory_s = 0.2;        // of the sums of position and velocity
constexpr double kVelocityLag_s = 0.01;  // that a drive's velocity filter may have
constexpr double kShareOfWay = 0.25;
constexpr double kStuck_s = 0.01;    // besides two periods: a torque needs time to move an inertia
constexpr double kStuckShare = 0.2;  // of the greatest torque
constexpr double kYielding = 1e-4;   // joint units by which joint and gear yield to that torque at least
constexpr double kNoiseCounts = 4.0;
constexpr double kMaxGap = 10.0;  // periods

}  // namespace

PlausibilityMonitor::PlausibilityMonitor(const PlausibilityParameters& parameters) noexcept
    : parameters_(parameters),
      speed_filter_s_(std::max(0.01, 5.0 * parameters.period_s)),
      velocity_tolerance_(parameters.max_speed *
                              (kVelocityLag_s + 2.0 * parameters.period_s * (1 + parameters.measure_every)) +
                          kNoiseCounts * parameters.count),
      sees_yielding_(kYielding >= kNoiseCounts * parameters.count) {}

void PlausibilityMonitor::start(const MotionSample& sample) noexcept {
  started_ = true;
  last_ = sample;
  speed_ = difference_ = position_way_ = velocity_way_ = 0.0;
  still_at_ = sample.position;
  least_torque_ = greatest_torque_ = sample.torque;
  strained_s_ = 0.0;
}

ImplausibleMotion PlausibilityMonitor::found(Implausibility reason, double seen,
                                             double allowed) const noexcept {
  return {reason, seen, allowed, parameters_.sliding};
}

ImplausibleMotion PlausibilityMonitor::check_motion(const MotionSample& sample, double dt_s) noexcept {
  const double way = sample.position - last_.position;
  const double noise = kNoiseCounts * parameters_.count;
  const double greatest_way =
      kJumpRatio * parameters_.max_speed * (dt_s + 2.0 * parameters_.period_s) + noise;
  if (std::abs(way) > greatest_way) return found(Implausibility::kJump, std::abs(way), greatest_way);
  if (dt_s > kMaxGap * parameters_.period_s) {
    start(sample);
    return {};
  }
  const double greatest_speed = parameters_.overspeed_ratio * parameters_.max_speed + noise / speed_filter_s_;
  speed_ += dt_s / (dt_s + speed_filter_s_) * (way / dt_s - speed_);
  if (std::abs(speed_) > greatest_speed)
    return found(Implausibility::kOverspeed, std::abs(speed_), greatest_speed);

  const double velocity_way = 0.5 * dt_s * (last_.velocity + sample.velocity);
  const double kept = std::exp(-dt_s / kMemory_s);
  difference_ = kept * difference_ + way - velocity_way;
  position_way_ = kept * position_way_ + std::abs(way);
  velocity_way_ = kept * velocity_way_ + std::abs(velocity_way);
  const double allowed = velocity_tolerance_ + kShareOfWay * std::min(position_way_, velocity_way_);
  if (std::abs(difference_) > allowed)
    return found(Implausibility::kVelocity, std::abs(difference_), allowed);
  return {};
}

ImplausibleMotion PlausibilityMonitor::check_torque(const MotionSample& sample, double dt_s) noexcept {
  const bool moved = std::abs(sample.position - still_at_) > 1.5 * parameters_.count;
  if (moved || !sample.moves_freely) {
    still_at_ = sample.position;
    least_torque_ = greatest_torque_ = sample.torque;
    strained_s_ = 0.0;
    return {};
  }
  least_torque_ = std::min(least_torque_, sample.torque);
  greatest_torque_ = std::max(greatest_torque_, sample.torque);
  const double share = (greatest_torque_ - least_torque_) / parameters_.max_torque;
  if (share > kStuckShare) strained_s_ += dt_s;
  if (sees_yielding_ && strained_s_ > kStuck_s + 2.0 * parameters_.period_s)
    return found(Implausibility::kStuck, share, kStuckShare);
  return {};
}

ImplausibleMotion PlausibilityMonitor::step(const MotionSample& sample) noexcept {
  const double dt_s = core::seconds(sample.at_ns - last_.at_ns);
  if (started_ && !(dt_s > 0.0)) return {};  // seen already
  if (!started_) {
    start(sample);
    return {};
  }
  const ImplausibleMotion motion = check_motion(sample, dt_s);
  const bool sound = motion.reason == Implausibility::kNone;
  const ImplausibleMotion result = sound ? check_torque(sample, dt_s) : motion;
  last_ = sample;
  return result;
}

}  // namespace phantom::can
