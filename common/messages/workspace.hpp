#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "common/geometry/pose.hpp"

// What the topics of idl/workspace.idl tell, as components work with it.

namespace phantom::messages {

/// Topic workspace_object: what stands where.
struct WorkspaceObject {
  std::uint16_t id = 0;  ///< as in the voxels
  std::string name;
  std::uint64_t mesh_hash = 0;    ///< mesh_chunk's key; 0: the object was removed, and the rest says nothing
  geometry::Pose X_WO;            ///< object frame in W
  std::array<float, 3> colour{};  ///< linear RGB, 0…1

  bool removed() const { return mesh_hash == 0; }
};

}  // namespace phantom::messages
