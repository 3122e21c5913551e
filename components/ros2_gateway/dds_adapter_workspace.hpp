#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"
#include "common/ros2/node.hpp"
#include "components/ros2_gateway/dds_adapter_out.hpp"

namespace phantom::dds {
class Participant;
}

namespace phantom::ros2_gateway {

/// What of the workspace is said in the ROS 2 domain.
struct WorkspaceRules {
  std::string arm;                  ///< its name in the cell file
  std::set<std::uint16_t> zones;    ///< ids of its protected zones
  bool meshes = true;               ///< the objects, as markers
  std::vector<std::int8_t> clouds;  ///< orders of the voxels that are published as clouds
};

/// Publishes the workspace, latched, in a thread of its own. Objects are markers of triangles; each change is
/// sent by itself, and all of them again, beginning with DELETEALL, once nothing has changed for kSettle_s,
/// at the latest kMax_s after the first change, and when a reader has come. A cloud is sent whole at the
/// first version and likewise after changes; each change is sent at once on TOPIC_updates, by changed bricks
/// (LayerCloud).
class WorkspaceOutputs {
 public:
  static constexpr double kSettle_s = 1.0, kMax_s = 10.0;

  /// `out`: how topics and frames are called. Throws dds::DdsError.
  WorkspaceOutputs(dds::Participant& phantom, ros2::Node& node, const robot::SerialArm& arm,
                   const OutputRules& out, const WorkspaceRules& rules);
  ~WorkspaceOutputs();

  /// Returns the name of the topic of an order's cloud, without prefix: "workspace/layer_2".
  static std::string topic_of(std::int8_t order);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::ros2_gateway
