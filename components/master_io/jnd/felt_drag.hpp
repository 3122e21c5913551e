#pragma once

#include <cstddef>

#include "common/core/clock.hpp"
#include "common/messages/teleoperation.hpp"

namespace phantom::master_io {

struct FeltDragRules {
  std::size_t joint = 0;
  double least_speed = 0.02;  ///< rad/s or m/s; slower is no motion
  double moving_s = 2.0;      ///< the hand must have moved for so long
  double settle_s = 0.1;      ///< left out at the beginning, while a changed gain comes into force
};

/// What a hand feels of drag on one joint while it moves: the damping coefficient b that fits τ = −b·v best
/// over an interval. Samples in which the master is not coupled, or drag is off, do not count.
class FeltDrag {
 public:
  explicit FeltDrag(const FeltDragRules& rules) noexcept : rules_(rules) {}

  void take(const messages::Received<messages::MasterState>& state) noexcept;
  /// Returns whether the hand has moved for long enough.
  bool complete() const noexcept { return moved_s_ >= rules_.moving_s; }
  double moved_s() const noexcept { return moved_s_; }
  double since_begin_s() const noexcept { return core::seconds(newest_ns_ - begin_ns_); }
  /// Returns b in N·m·s/rad or N·s/m; 0 before any motion.
  double damping() const noexcept { return speed2_ > 0.0 ? -power_ / speed2_ : 0.0; }
  /// Returns the share of the motion in which the drag was less than G asks for (percept_limited).
  double limited_share() const noexcept { return moved_s_ > 0.0 ? limited_s_ / moved_s_ : 0.0; }

 private:
  FeltDragRules rules_;
  core::Nanoseconds begin_ns_ = 0, newest_ns_ = 0;  // 0: nothing taken yet
  double moved_s_ = 0.0, limited_s_ = 0.0;
  double power_ = 0.0, speed2_ = 0.0;  // Σ τv, Σ v², weighted by time
};

}  // namespace phantom::master_io
