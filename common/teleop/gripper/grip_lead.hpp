#pragma once

#include <array>
#include <optional>

#include "common/core/clock.hpp"
#include "common/teleop/gripper/gripper.hpp"

namespace phantom::teleop {

/// Leads the slave's gripper by the grip of the hand: how far the grip is open, as a share of the gripper's
/// greatest width.
///
/// Nothing but the hand's own motion may open fingers that hold something. So the grip takes the gripper only
/// where both agree: as soon as the grip comes to the width that is in force, or passes it. It loses the
/// gripper, and has to come there again,
/// - when master and slave uncouple, a stop comes, or the device is lost;
/// - when the gripper's drive is in fault or does not follow;
/// - when a width is in force that the grip has not requested: somebody else has, or a motion was ended.
///
/// It requests a width at most every kEvery_ns, and only one that differs by kStep of the greatest width from
/// the last; within kStep of either end, the end itself.
class GripLead {
 public:
  static constexpr double kStep = 0.02;  ///< share of the greatest width
  static constexpr core::Nanoseconds kEvery_ns = 50 * core::kNsPerMillisecond;
  /// So long after a request an earlier one may still be in force.
  static constexpr core::Nanoseconds kOnItsWay_ns = core::kNsPerSecond;

  /// The gripper's newest state.
  struct Gripper {
    GripperStatus status;
    double widest_m = 0.0;  ///< > 0; else there is no gripper
  };

  /// Returns the width to request now, in m; none most of the time. `opening`: of the grip, 0 closed to 1
  /// open; outside that or not finite: it has none. `may`: the hand may lead the slave. Real-time safe: yes.
  std::optional<double> step(double opening, bool may, const Gripper& gripper,
                             core::Nanoseconds now_ns) noexcept;
  /// Whether the grip has the gripper.
  bool leads() const noexcept { return leads_; }

 private:
  bool is_own(double width_m, core::Nanoseconds now_ns) const noexcept;
  void note(double width_m) noexcept { requested_m_[count_++ % requested_m_.size()] = width_m; }
  double last_m() const noexcept { return requested_m_[(count_ - 1) % requested_m_.size()]; }

  bool leads_ = false;
  std::optional<double> before_m_;        // where the grip was while it had not the gripper
  std::array<double, 32> requested_m_{};  // the newest, all of kOnItsWay_ns; before them what was in force
  std::size_t count_ = 0;
  core::Nanoseconds requested_ns_ = 0;  // when the newest was
};

}  // namespace phantom::teleop
