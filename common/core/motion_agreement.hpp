#pragma once

#include <algorithm>
#include <cmath>

namespace phantom::core {

/// Decides whether a position and a velocity that are reported separately belong to one motion, for one
/// coordinate. Used for drives and for haptic devices.
///
/// The difference d is the leaky sum (kMemory_s) of the way by position less the way by velocity. They
/// disagree once |d| exceeds `constant` + kShareOfWay · w, where w is the lesser of the ways that each gives
/// in that time. So a negated velocity is found within about the constant part of way; one so slow that
/// kMemory_s of it stay below half of that is not. Any unit. Pure: it uses no clock. Real-time safe: yes.
class MotionAgreement {
 public:
  static constexpr double kMemory_s = 0.2, kShareOfWay = 0.25;

  /// Adds a step of `dt_s`, > 0, in which the position moved by `way` and the mean velocity was `velocity`.
  /// `constant`: what noise, filters and late samples may make of the difference, > 0.
  void step(double way, double velocity, double dt_s, double constant) noexcept {
    const double velocity_way = velocity * dt_s, kept = std::exp(-dt_s / kMemory_s);
    difference_ = kept * difference_ + way - velocity_way;
    position_way_ = kept * position_way_ + std::abs(way);
    velocity_way_ = kept * velocity_way_ + std::abs(velocity_way);
    allowed_ = constant + kShareOfWay * std::min(position_way_, velocity_way_);
  }
  /// Returns |d| after the last step.
  double difference() const noexcept { return std::abs(difference_); }
  /// Returns the greatest |d| that counts as agreement.
  double allowed() const noexcept { return allowed_; }
  /// Written so that a NaN disagrees.
  bool disagrees() const noexcept { return !(difference() <= allowed_); }

 private:
  double difference_ = 0.0, position_way_ = 0.0, velocity_way_ = 0.0, allowed_ = 0.0;
};

}  // namespace phantom::core
