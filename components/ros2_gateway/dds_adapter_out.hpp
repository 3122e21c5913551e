#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/core/network.hpp"
#include "common/messages/percept.hpp"
#include "common/messages/status.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/ros2/from_phantom.hpp"

namespace phantom::dds {
class Participant;
}

namespace phantom::ros2_gateway {

/// What is said in the ROS 2 domain of Phantom's.
struct OutputRules : ros2::Names {
  double rate_Hz = 50.0;  ///< of the states at most; 0: nothing is published
  bool views = false;     ///< the viewer's pictures, too
};

/// Hears Phantom's topics and says them in ROS 2's words: joint_states and transforms of the arm,
/// robot_description, torques of the percept as efforts and as wrenches at the tool, closeness and speed, the
/// worst place as a marker, diagnostics of the components and hit alerts, the viewer's pictures. Right-handed
/// frames, z up, SI units (REP 103); times are this host's. publish() is called by one thread, so that a ROS
/// 2 side that holds it up holds up nothing else.
class Outputs {
 public:
  /// `urdf`: text of the arm's description; empty: none is published. Throws dds::DdsError.
  Outputs(dds::Participant& phantom, ros2::Node& node, const robot::SerialArm& arm, const OutputRules& rules,
          const std::string& urdf);
  ~Outputs();

  /// Publishes what is new. `diagnostics`: those, too.
  void publish(bool diagnostics);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::ros2_gateway
