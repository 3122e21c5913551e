#pragma once

#include <cstddef>

#include "common/core/joints.hpp"
#include "common/robot/drag/reaction.hpp"
#include "common/teleop/coupling/ramp.hpp"

namespace phantom::teleop {

struct ReactionParameters {
  std::size_t joint_count = 0;
  double gain = 1.0;                   ///< of torque and stiffness, ≥ 0
  core::JointArray stiffness_limit{};  ///< that the device renders, N·m/rad or N/m, gain included
  double smoothing_s = 0.005;          ///< time constant with which what comes takes effect
  double ramp_up_s = 0.3, ramp_down_s = 0.1;
};

/// Renders what soft bodies answer (palpation, thesis 7.3(4)) at the master's own position: the torque at the
/// pose from the network, less stiffness times the way from there. So the spring is closed in the master's
/// own loop, and the network delays only its torque and stiffness. A body pushes out and never pulls in: the
/// torque does not change its sign. Stale reactions fade out. What keeps the spring passive comes after it:
/// it is part of the feedback, with its passivity guard, caps and slew.
class ReactionRenderer {
 public:
  explicit ReactionRenderer(const ReactionParameters& parameters);

  /// Returns the torques of one tick at the master's position `q`. `fresh`: the reaction is recent enough,
  /// and valid. What is not finite, or has a stiffness below 0, counts as stale. Real-time safe: yes.
  core::JointArray step(const robot::JointReaction& reaction, bool fresh, const core::JointArray& q,
                        double dt_s) noexcept;

 private:
  void follow(double share) noexcept;

  ReactionParameters parameters_;
  Ramp authority_;
  robot::JointReaction aim_, now_;
};

}  // namespace phantom::teleop
