#include "common/can/plausibility_monitor.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::can {
namespace {

constexpr double kJumpRatio = 4.0;       // of the greatest speed, between two answers
constexpr double kVelocityLag_s = 0.01;  // that a drive's velocity filter may have
constexpr double kStuck_s = 0.01;        // besides two periods: a torque needs time to move an inertia
constexpr double kStuckShare = 0.2;      // of the greatest torque
constexpr double kYielding = 1e-4;       // joint units by which joint and gear yield to that torque at least
constexpr double kFrozenShare = 0.002;   // of the greatest torque: a drive's steps of torque
constexpr double kFrozenWay_s = 0.1;     // of the greatest speed
constexpr double kContrary_s = 0.25;     // of the greatest speed: longer than a joint takes to turn back
constexpr double kLeading_s = 0.02;      // of the greatest speed: a nearer target leads nowhere
constexpr double kLeadingShare = 0.02;   // of the greatest speed, likewise
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
  speed_ = contrary_way_ = 0.0;
  agreement_ = {};
  same_position_ = sample.position;
  same_torque_ = sample.torque;
  least_target_ = greatest_target_ = sample.target;
  asked_way_ = same_s_ = ignored_s_ = 0.0;
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
  if (dt_s > kMaxGap * parameters_.period_s) {  // nothing is known of the motion in it
    start(sample);
    return {};
  }
  const double greatest_speed = parameters_.overspeed_ratio * parameters_.max_speed + noise / speed_filter_s_;
  speed_ += dt_s / (dt_s + speed_filter_s_) * (way / dt_s - speed_);
  if (std::abs(speed_) > greatest_speed)
    return found(Implausibility::kOverspeed, std::abs(speed_), greatest_speed);

  agreement_.step(way, 0.5 * (last_.velocity + sample.velocity), dt_s, velocity_tolerance_);
  if (agreement_.disagrees())
    return found(Implausibility::kVelocity, agreement_.difference(), agreement_.allowed());
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

// A target that is a velocity ranges over the way that it asks for.
ImplausibleMotion PlausibilityMonitor::check_frozen(const MotionSample& sample, double dt_s) noexcept {
  const bool answers = std::abs(sample.position - same_position_) > 1.5 * parameters_.count ||
                       std::abs(sample.torque - same_torque_) > kFrozenShare * parameters_.max_torque;
  const bool must_show = sample.moves_freely && !sample.limited && sample.target_kind != TargetKind::kNone &&
                         sample.target_kind == last_.target_kind;
  if (answers || !must_show) {
    same_position_ = sample.position;
    same_torque_ = sample.torque;
    const double begin = sample.target_kind == TargetKind::kVelocity ? 0.0 : sample.target;
    least_target_ = greatest_target_ = asked_way_ = begin;
    same_s_ = ignored_s_ = 0.0;
    return {};
  }
  const bool by_velocity = sample.target_kind == TargetKind::kVelocity;
  asked_way_ = by_velocity ? asked_way_ + sample.target * dt_s : sample.target;
  least_target_ = std::min(least_target_, asked_way_);
  greatest_target_ = std::max(greatest_target_, asked_way_);
  const double allowed = sample.target_kind == TargetKind::kTorque
                             ? kStuckShare * parameters_.max_torque
                             : kFrozenWay_s * parameters_.max_speed + kNoiseCounts * parameters_.count;
  same_s_ += dt_s;
  if (greatest_target_ - least_target_ > allowed)
    ignored_s_ += std::min(dt_s, parameters_.period_s);  // late answers prove no more than timely ones
  const double longest_s = kStuck_s + 2.0 * parameters_.period_s;
  if (sees_yielding_ && ignored_s_ > longest_s) return found(Implausibility::kFrozen, same_s_, longest_s);
  return {};
}

ImplausibleMotion PlausibilityMonitor::check_contrary(const MotionSample& sample) noexcept {
  const double v = parameters_.max_speed;
  double ahead = 0.0;  // where the target leads, by its sign
  if (sample.moves_freely && sample.target_kind == TargetKind::kVelocity &&
      std::abs(sample.target) > kLeadingShare * v)
    ahead = sample.target;
  if (sample.moves_freely && sample.target_kind == TargetKind::kPosition &&
      std::abs(sample.target - sample.position) > kLeading_s * v)
    ahead = sample.target - sample.position;
  if (ahead == 0.0) {
    contrary_way_ = 0.0;
    return {};
  }
  const double way = sample.position - last_.position;
  contrary_way_ = std::max(0.0, contrary_way_ + (ahead > 0.0 ? -way : way));
  const double allowed = v * (kContrary_s + 2.0 * parameters_.period_s) + kNoiseCounts * parameters_.count;
  if (contrary_way_ > allowed) return found(Implausibility::kContrary, contrary_way_, allowed);
  return {};
}

ImplausibleMotion PlausibilityMonitor::step(const MotionSample& sample) noexcept {
  const double dt_s = core::seconds(sample.at_ns - last_.at_ns);
  if (started_ && !(dt_s > 0.0)) return {};  // seen already
  if (!started_) {
    start(sample);
    return {};
  }
  ImplausibleMotion result = check_motion(sample, dt_s);
  const bool gap = dt_s > kMaxGap * parameters_.period_s;
  const auto sound = [&] { return result.reason == Implausibility::kNone && !gap; };
  if (sound()) result = check_torque(sample, dt_s);
  if (sound()) result = check_frozen(sample, dt_s);
  if (sound()) result = check_contrary(sample);
  last_ = sample;
  return result;
}

}  // namespace phantom::can
