#pragma once

#include <algorithm>

namespace phantom::teleop {

/// Fades a factor between 0 and 1 at a bounded rate, so that switching causes no jolt. From 1 it reaches
/// exactly 0 within `down_s` plus one step; from 0 it reaches exactly 1 within `up_s` plus one step.
class Ramp {
 public:
  /// Both durations > 0. `start`: the factor at first, 0 or 1.
  Ramp(double up_s, double down_s, double start = 0.0) : up_s_(up_s), down_s_(down_s), value_(start) {}

  /// Moves the factor towards 1 if `on`, else towards 0, and returns it. Real-time safe: yes.
  double step(bool on, double dt_s) noexcept {
    value_ = on ? std::min(1.0, value_ + dt_s / up_s_) : std::max(0.0, value_ - dt_s / down_s_);
    return value_;
  }
  double value() const noexcept { return value_; }

 private:
  double up_s_, down_s_, value_;
};

}  // namespace phantom::teleop
