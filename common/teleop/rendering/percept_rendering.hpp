#pragma once

#include <cstddef>

#include "common/core/joints.hpp"
#include "common/robot/drag/drag.hpp"
#include "common/teleop/coupling/ramp.hpp"

namespace phantom::teleop {

using robot::DragMode;

/// Damping coefficients of the present pose as phantom_sensing publishes them, without gain. `sigma` is not
/// used here.
struct DragCoefficients : robot::DragCoefficients {
  bool valid = false;  ///< false: the phantom reports that its workspace or pose is stale

  friend bool operator==(const DragCoefficients&, const DragCoefficients&) = default;
};

struct PerceptParameters {
  std::size_t joint_count = 0;
  DragMode mode = DragMode::kSeparable;
  core::JointArray torque_cap_Nm{};  ///< per joint; the thesis clamps the percept in the same way (5.3)
  core::JointArray
      damping_limit_Nms_per_rad{};  ///< greatest damping that the device renders stably (stability_guard.hpp)
  double smoothing_s = 0.005;  ///< time constant with which changes of coefficients and gains take effect
  double ramp_up_s = 0.3;      ///< time from no percept to the full percept
  double ramp_down_s = 0.1;    ///< time back to none, when stale or switched off
};

struct RenderedPercept {
  core::JointArray torque_Nm{};  ///< on the master's joints
  double gain = 0.0;  ///< least ratio of rendered to true drag over the joints; the least G if nothing limits
  double authority = 0.0;        ///< 0 off … 1 fully on
  bool damping_limited = false;  ///< the device's stability limit reduces the gain
  bool torque_limited = false;   ///< a joint's torque is at its cap
};

/// Renders the percept on the master: the drag law (robot::drag_torque) with coefficients from the network
/// and the master's velocity of the present tick. Gains are per joint: B± of joint j becomes G_j·B±, and D
/// becomes √G·D·√G, so that it stays positive semi-definite. In a current the drag is that of the velocity
/// relative to it, as far as that takes energy from the hand; the damping limits are halved there.
///
/// For any input the rendered power τ·v is ≤ 0, and the torque is zero at rest, stays within the cap and
/// follows changed coefficients continuously. When no more coefficients arrive, the percept fades out within
/// ramp_down_s. Source: thesis eq. 5.15–5.20. The network delays only the slowly varying coefficients, never
/// the velocity.
class PerceptRenderer {
 public:
  explicit PerceptRenderer(const PerceptParameters& parameters);

  /// Computes the torques of one tick. `fresh`: the coefficients are recent enough. `gain`: the requested G ≥
  /// 0 of each joint. `v`: the master's velocity, rad/s or m/s. `limit_share`, 0…1: of the damping limits,
  /// what the loop's present length leaves. Real-time safe: yes.
  RenderedPercept step(const DragCoefficients& drag, bool fresh, bool enabled, const core::JointArray& gain,
                       const core::JointArray& v, double dt_s, double limit_share = 1.0) noexcept;

 private:
  void set_limits(const DragCoefficients& drag, double limit_share) noexcept;
  void aim_separable(const DragCoefficients& drag, const core::JointArray& gain) noexcept;
  void aim_coupled(const DragCoefficients& drag, const core::JointArray& gain) noexcept;
  double greatest_row(const DragCoefficients& drag) const noexcept;
  void smooth(double dt_s) noexcept;
  void cap_each(RenderedPercept& out) const noexcept;
  void cap_as_one(const core::JointArray& v, RenderedPercept& out) const noexcept;

  PerceptParameters parameters_;
  Ramp authority_;
  // Target damping and damping in force, after gain and limits. Both are kept while the input is stale, so
  // that the fade-out starts at the present value.
  DragCoefficients aim_, force_;
  core::JointArray limit_{};  // damping limits of this tick
  double aimed_gain_ = 0.0;
  bool aim_limited_ = false;
};

}  // namespace phantom::teleop
