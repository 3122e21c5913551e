#pragma once

#include <memory>
#include <string>

#include "common/ros2/node.hpp"

namespace phantom::dds {
class Participant;
}

namespace phantom::ros2_gateway {

/// Hands collision objects of the ROS 2 domain on to wva_server, in the order of their arrival, in a thread
/// of its own. What is refused, here or there, is logged with its reason. At most kMaxWaiting wait; more are
/// refused.
class CollisionObjects {
 public:
  static constexpr std::size_t kMaxWaiting = 64;

  /// Throws dds::DdsError. `world`: the frame in which objects are given. `timeout_s`: for wva_server's
  /// answer.
  CollisionObjects(dds::Participant& phantom, ros2::Node& node, const std::string& topic,
                   const std::string& world, double timeout_s = 30.0);
  ~CollisionObjects();

  std::uint64_t done() const;     ///< objects that wva_server has taken over
  std::uint64_t refused() const;  ///< here or there, or not answered

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::ros2_gateway
