#include "common/ros2/message_types.hpp"

#include <algorithm>

#include "ros2_idl/message_types.hpp"

namespace phantom::ros2 {

const MessageType* find_message_type(std::string_view dds_name) noexcept {
  const auto* const found = std::find_if(kMessageTypes.begin(), kMessageTypes.end(),
                                         [&](const MessageType& type) { return dds_name == type.dds_name; });
  return found == kMessageTypes.end() ? nullptr : found;
}

}  // namespace phantom::ros2
