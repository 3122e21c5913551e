#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "common/geometry/pose.hpp"

// The samples of the topics of idl/workspace.idl as components use them.

namespace phantom::messages {

/// Topic workspace_object: an object in the workspace, and its pose.
struct WorkspaceObject {
  std::uint16_t id = 0;  ///< as in the voxels
  std::string name;
  std::uint64_t mesh_hash = 0;    ///< mesh_chunk's key; 0: the object was removed, and only `id` is valid
  geometry::Pose X_WO;            ///< object frame in W
  std::array<float, 3> colour{};  ///< linear RGB, 0…1

  bool removed() const { return mesh_hash == 0; }
};

}  // namespace phantom::messages
