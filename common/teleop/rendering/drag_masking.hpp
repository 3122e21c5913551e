#pragma once

#include <cstddef>

#include "common/core/joints.hpp"

namespace phantom::teleop {

struct MaskingParameters {
  std::size_t joint_count = 0;
  /// Weber fraction of force: a change below this share of the torque that is felt already goes unnoticed.
  /// 0.07 to 0.1 (Jones 1989; Pang, Tan and Durlach 1991).
  double weber_fraction = 0.08;
  double adaptation_s = 1.0;         ///< over which the hand takes a torque for the constant background
  double judging_s = 1.0;            ///< of drag: time constant of masked_share()
  core::JointArray drag_floor_Nm{};  ///< weaker drag is not meant to be noticed, and is not judged
};

/// Judges whether the slave's feedback masks the drag outside contact. Case b2 of thesis table 6.1: the
/// weight of an unbalanced arm is felt all the time (5.4.7(3)); cases d and e: so is the lag of a slave
/// behind its master.
///
/// Drag τ_d stands apart on joint j if |τ_d| ≥ w·|τ̄| + |τ − τ̄|: τ is the feedback, τ̄ its mean of late, w the
/// Weber fraction. A background masks by its level, and by its changes, which the hand cannot tell from drag.
/// Drag on several joints is masked where it stands apart on none. Real-time safe: yes.
class MaskingMonitor {
 public:
  explicit MaskingMonitor(const MaskingParameters& parameters) noexcept : parameters_(parameters) {}

  /// Takes the torques on the master's joints, N·m or N, of one tick in which the arm is coupled, drag is on
  /// and nothing is touched. In contact the feedback is what shall be felt: such ticks are left out.
  void step(const core::JointArray& drag_Nm, const core::JointArray& feedback_Nm, double dt_s) noexcept;
  /// Returns whether most of the drag of late went unnoticed. Hysteresis: from a share of kMasked on, until
  /// kHeard. A second or two without drag change nothing.
  bool masked() const noexcept { return masked_; }
  /// Returns the share of the time with drag in which it was masked, 0…1, smoothed over `judging_s`.
  double masked_share() const noexcept { return share_; }
  void reset() noexcept;

  static constexpr double kMasked = 0.6, kHeard = 0.3;

 private:
  MaskingParameters parameters_;
  core::JointArray background_Nm_{};
  bool started_ = false, masked_ = false;
  double share_ = 0.0;
};

}  // namespace phantom::teleop
