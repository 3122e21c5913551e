#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tests/ros2/foreign_node.hpp"

namespace phantom::ros2::test {

/// Hears topics in another vendor's DDS and keeps the bytes of each message, with the encapsulation header.
/// Its types are those of the hand-written definitions. It listens as a part of `node`, which outlives it.
class WireListener {
 public:
  explicit WireListener(const ForeignNode& node) : participant_(node.participant()) {}

  /// Returns what came on the topic up to now, at most 64 messages; nothing before its publisher was
  /// discovered. Both names are those of DDS. Throws std::runtime_error if there is no such type here.
  std::vector<std::vector<std::uint8_t>> heard(const std::string& topic, const std::string& type);

 private:
  const std::int32_t participant_;
  std::map<std::string, std::int32_t> readers_;
};

}  // namespace phantom::ros2::test
