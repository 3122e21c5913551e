#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/pose.hpp"
#include "common/messages/workspace.hpp"

namespace phantom::ros2_gateway {

/// A moveit_msgs/msg/CollisionObject as it came: shapes stand at their poses in the object's frame.
struct CollisionObject {
  enum Operation { kAdd, kRemove, kAppend, kMove };
  struct Solid {
    int type = 0;  ///< shape_msgs/msg/SolidPrimitive: 1 box, 2 sphere, 3 cylinder, 4 cone, 5 prism
    std::vector<double> dimensions;  ///< m
    geometry::Pose X_OS;
  };
  struct Mesh {
    std::vector<std::array<double, 3>> vertices_m;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    geometry::Pose X_OS;
  };
  std::string id, frame;
  int operation = kAdd;
  geometry::Pose X_FO;  ///< in `frame`
  std::vector<Solid> solids;
  std::vector<Mesh> meshes;
  bool planes = false;  ///< it has some
};

/// Greatest number of shapes of one object that is accepted.
inline constexpr std::size_t kMaxShapes = 32;

/// Returns the pose of a geometry_msgs/msg/Pose. Errors: a number that is none, a quaternion that is not of
/// unit length within 1e-3. One of four zeros, which programs leave unset, is no rotation.
core::Expected<geometry::Pose> pose_of(const std::array<double, 3>& position_m,
                                       const std::array<double, 4>& orientation_xyzw);

/// Returns what wva_server is asked for, in this order. `world`: the workspace's frame, in which objects have
/// to be given. An object that is added anew replaces the one of its name. Errors say what is not possible
/// and what is: another frame, planes, several shapes of which one is a mesh, APPEND, a dimension that is not
/// positive, a mesh whose description exceeds workspace_command's 16,384 bytes.
core::Expected<std::vector<messages::WorkspaceCommand>> commands_of(const CollisionObject& object,
                                                                    const std::string& world);

}  // namespace phantom::ros2_gateway
