#pragma once

#include <array>
#include <optional>
#include <span>

#include "common/teleop/coupling/cartesian_hand.hpp"
#include "common/teleop/coupling/free_handle.hpp"
#include "components/ros2_gateway/stream_check.hpp"

namespace phantom::ros2_gateway {

/// How commands of ROS 2 lead the tool, and the handle that they push.
struct TwistMasterRules : teleop::FreeHandleParameters {
  double staleness_s = 0.2;          ///< what was not heard for so long commands nothing
  double largest_stamp_age_s = 0.5;  ///< late or early, by this host's clock; 0: not judged
  double largest_speed_m_s = 0.1;    ///< of the handle: faster commands are slowed down in their direction
  double largest_turn_rad_s = 0.5;
  std::array<int, 6> joy_axes{1, 0, -1, -1, -1, 2};  ///< of x, y, z, then about them; −1: none
  int joy_enable = 4;                                ///< button that is held to command
};

/// A master that commands speeds: a simulated handle of a haptic device (docs/haptic_device.md), which the
/// command pushes (teleop::FreeHandle), so that drag and feedback slow it down. Its clutch is in while
/// commands come and master_io takes the device. What falls silent, or is let go, commands nothing from then
/// on; a command moves nothing until it was seen at rest: at the start, after a silence, after master_io did
/// not take the device, and after the handle was brought back to the middle, since it came to the end of its
/// way. Not thread-safe.
class TwistMaster {
 public:
  explicit TwistMaster(const TwistMasterRules& rules);

  /// Take a command. Errors, with the reason: of StreamCheck, a number that is none, an axis or a button that
  /// the Joy does not have.
  core::Status take_twist(const StreamMessage& from, const std::array<double, 3>& linear_m_s,
                          const std::array<double, 3>& angular_rad_s, core::Nanoseconds now_ns,
                          core::Nanoseconds utc_now_ns);
  core::Status take_joy(const StreamMessage& from, std::span<const float> axes,
                        std::span<const std::int32_t> buttons, core::Nanoseconds now_ns,
                        core::Nanoseconds utc_now_ns);

  /// Advances by dt_s under what Phantom exerts on the handle (N, N·m). `taken`: whether it takes the device;
  /// what is not heard for staleness_s counts as no. Real-time safe: yes.
  const teleop::HandState& step(const robot::Spatial& wrench, bool taken, double dt_s,
                                core::Nanoseconds now_ns) noexcept;

 private:
  core::Status take(const StreamMessage& from, const robot::Spatial& twist, bool enabled,
                    core::Nanoseconds now_ns, core::Nanoseconds utc_now_ns);

  TwistMasterRules rules_;
  StreamCheck check_;
  robot::Spatial command_ = robot::Spatial::Zero();
  bool enabled_ = false;            // by the newest command
  bool seen_at_rest_ = false;       // since the last loss
  core::Nanoseconds taken_ns_ = 0;  // when the device was taken last
  teleop::FreeHandle handle_;
  teleop::HandState hand_;
};

}  // namespace phantom::ros2_gateway
