#pragma once

#include <string>

#include "common/core/clock.hpp"
#include "common/geometry/pose.hpp"
#include "ros2_idl/geometry_msgs.hpp"
#include "ros2_idl/std_msgs.hpp"

namespace phantom::ros2 {

/// Returns the header of a message of that time (since 1970) and frame.
inline std_msgs::msg::dds_::Header_ header(const std::string& frame, core::Nanoseconds stamp_ns) {
  std_msgs::msg::dds_::Header_ made;
  made.stamp().sec(static_cast<std::int32_t>(stamp_ns / core::kNsPerSecond));
  made.stamp().nanosec(static_cast<std::uint32_t>(stamp_ns % core::kNsPerSecond));
  made.frame_id(frame);
  return made;
}

/// Returns the time of a stamp, since 1970.
inline core::Nanoseconds nanoseconds_of(const builtin_interfaces::msg::dds_::Time_& time) {
  return time.sec() * core::kNsPerSecond + time.nanosec();
}

inline geometry_msgs::msg::dds_::Pose_ pose_message(const geometry::Pose& X) {
  const Eigen::Vector4d q = geometry::quaternion_xyzw(X.rotation);
  geometry_msgs::msg::dds_::Pose_ made;
  made.position().x(X.translation_m.x()), made.position().y(X.translation_m.y());
  made.position().z(X.translation_m.z());
  made.orientation().x(q[0]), made.orientation().y(q[1]), made.orientation().z(q[2]);
  made.orientation().w(q[3]);
  return made;
}

}  // namespace phantom::ros2
