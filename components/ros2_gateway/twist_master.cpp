#include "components/ros2_gateway/twist_master.hpp"

namespace phantom::ros2_gateway {

TwistMaster::TwistMaster(const TwistMasterRules& rules)
    : rules_(rules), check_(rules.staleness_s, rules.largest_stamp_age_s), handle_(rules) {}

core::Status TwistMaster::take_twist(const StreamMessage& from, const std::array<double, 3>& linear_m_s,
                                     const std::array<double, 3>& angular_rad_s, core::Nanoseconds now_ns,
                                     core::Nanoseconds utc_now_ns) {
  robot::Spatial twist;
  twist << Eigen::Vector3d(linear_m_s.data()), Eigen::Vector3d(angular_rad_s.data());
  return take(from, twist, true, now_ns, utc_now_ns);
}

core::Status TwistMaster::take_joy(const StreamMessage& from, std::span<const float> axes,
                                   std::span<const std::int32_t> buttons, core::Nanoseconds now_ns,
                                   core::Nanoseconds utc_now_ns) {
  if (rules_.joy_enable >= static_cast<int>(buttons.size()))
    return core::Status::invalid_argument("no button " + std::to_string(rules_.joy_enable) + " among " +
                                          std::to_string(buttons.size()));
  robot::Spatial twist = robot::Spatial::Zero();
  for (int i = 0; i < 6; ++i) {
    const int axis = rules_.joy_axes[static_cast<std::size_t>(i)];
    if (axis < 0) continue;
    if (axis >= static_cast<int>(axes.size()))
      return core::Status::invalid_argument("no axis " + std::to_string(axis) + " among " +
                                            std::to_string(axes.size()));
    twist[i] = static_cast<double>(axes[static_cast<std::size_t>(axis)]) *
               (i < 3 ? rules_.largest_speed_m_s : rules_.largest_turn_rad_s);
  }
  return take(from, twist, buttons[static_cast<std::size_t>(rules_.joy_enable)] != 0, now_ns, utc_now_ns);
}

core::Status TwistMaster::take(const StreamMessage& from, const robot::Spatial& twist, bool enabled,
                               core::Nanoseconds now_ns, core::Nanoseconds utc_now_ns) {
  if (!twist.allFinite()) return core::Status::invalid_argument("a number that is none");
  const bool heard = check_.fresh(now_ns);
  const core::Status status = check_.accept(from, now_ns, utc_now_ns);
  if (!status) return status;
  if (!heard) seen_at_rest_ = false;
  command_ = twist;
  teleop::shorten(command_.head<3>(), rules_.largest_speed_m_s);
  teleop::shorten(command_.tail<3>(), rules_.largest_turn_rad_s);
  enabled_ = enabled;
  if (!handle_.spent() && (!enabled || command_.isZero(0.0))) seen_at_rest_ = true;
  return core::Status::ok();
}

const teleop::HandState& TwistMaster::step(const robot::Spatial& wrench, bool taken, double dt_s,
                                           core::Nanoseconds now_ns) noexcept {
  const bool heard = check_.fresh(now_ns);
  if (taken) taken_ns_ = now_ns;
  const bool served = taken_ns_ != 0 && core::seconds(now_ns - taken_ns_) <= rules_.staleness_s;
  if (!heard || !served || handle_.spent()) seen_at_rest_ = false;
  hand_.clutch = heard && enabled_ && seen_at_rest_;
  if (hand_.clutch) {
    handle_.lead(command_, wrench, dt_s);
  } else {
    handle_.rest(dt_s);
  }
  hand_.pose = handle_.pose();
  hand_.twist = handle_.twist();
  hand_.valid = true;
  return hand_;
}

}  // namespace phantom::ros2_gateway
