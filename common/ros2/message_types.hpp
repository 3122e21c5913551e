#pragma once

#include <string_view>

namespace phantom::ros2 {

/// A message type as ROS 2 names it ("std_msgs/msg/Header"), as DDS does ("std_msgs::msg::dds_::Header_"),
/// its hash (RIHS01, REP 2016), and its definition in the words of .msg files, with those of all types in it.
struct MessageType {
  const char *name, *dds_name, *hash, *definition;
};

/// Returns the type of that DDS name, or null if it is none that this program knows.
const MessageType* find_message_type(std::string_view dds_name) noexcept;

}  // namespace phantom::ros2
