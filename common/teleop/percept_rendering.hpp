#pragma once

#include <cstddef>

#include "common/core/joints.hpp"
#include "common/robot/drag.hpp"
#include "common/teleop/ramp.hpp"

namespace phantom::teleop {

using robot::DragMode;

/// Drag of the present pose as the phantom sends it, without gain; `sigma` is not used here.
struct DragCoefficients : robot::DragCoefficients {
  bool valid = false;  ///< false: the phantom itself says that workspace or pose is stale

  friend bool operator==(const DragCoefficients&, const DragCoefficients&) = default;
};

struct PerceptParameters {
  std::size_t joint_count = 0;
  DragMode mode = DragMode::kSeparable;
  core::JointArray torque_cap_Nm{};              ///< per joint, as the thesis clamps the percept (5.3)
  core::JointArray damping_limit_Nms_per_rad{};  ///< what the device renders stably (stability_guard.hpp)
  double smoothing_s = 0.005;  ///< time constant over which changed coefficients and gains come into force
  double ramp_up_s = 0.3;      ///< from nothing to the full percept
  double ramp_down_s = 0.1;    ///< and back, when stale or switched off
};

struct RenderedPercept {
  core::JointArray torque_Nm{};  ///< on the master's joints
  double gain =
      0.0;  ///< least share of the true drag that any joint lets through: the least G if nothing limits
  double authority = 0.0;        ///< 0 off … 1 fully on
  bool damping_limited = false;  ///< the device's stability holds the gain back
  bool torque_limited = false;   ///< a joint's torque is at its cap
};

/// Renders the percept on the master: the law of drag (robot::drag_torque) with coefficients that came over
/// the network and the master's own velocity of this very tick. Gains are per joint: B± of joint j becomes
/// G_j·B±, D becomes √G·D·√G, so that it stays positive semi-definite. Whatever the inputs, the rendered
/// power τ·v is ≤ 0, the torque is zero at rest, within the cap, and follows changed coefficients
/// continuously; when the coefficients stop coming it fades out within ramp_down_s. Source: thesis
/// eq. 5.15–5.20; delay then ages a slowly varying coefficient only.
class PerceptRenderer {
 public:
  explicit PerceptRenderer(const PerceptParameters& parameters);

  /// `fresh`: the coefficients are young enough. `gain`: G ≥ 0 of each joint as asked for. `v`: the master's
  /// velocity, rad/s or m/s. Real-time safe: yes.
  RenderedPercept step(const DragCoefficients& drag, bool fresh, bool enabled, const core::JointArray& gain,
                       const core::JointArray& v, double dt_s) noexcept;

 private:
  void aim_separable(const DragCoefficients& drag, const core::JointArray& gain) noexcept;
  void aim_coupled(const DragCoefficients& drag, const core::JointArray& gain) noexcept;
  double greatest_row(const DragCoefficients& drag) const noexcept;
  void smooth(double dt_s) noexcept;
  void cap_each(RenderedPercept& out) const noexcept;
  void cap_as_one(const core::JointArray& v, RenderedPercept& out) const noexcept;

  PerceptParameters parameters_;
  Ramp authority_;
  // Damping to reach and in force, after gain and limits. Kept while stale, so that the fade-out starts where
  // it was.
  DragCoefficients aim_, force_;
  double aimed_gain_ = 0.0;
  bool aim_limited_ = false;
};

}  // namespace phantom::teleop
