#pragma once

#include <vector>

#include "common/geometry/mesh.hpp"
#include "common/robot/serial_arm.hpp"

namespace phantom::synthetic_viewer {

/// A visual mesh of a link, loaded.
struct LinkMeshData {
  std::size_t link = 0;
  geometry::Pose X_link_mesh;
  std::array<float, 3> colour{};
  geometry::TriangleMesh mesh;
};

/// All visual meshes of the arm. Throws core::MissingError for a file that is not there, core::ConfigError
/// for one that is no usable mesh. Forks: call it before threads start.
std::vector<LinkMeshData> load_arm_meshes(const robot::SerialArm& arm);

}  // namespace phantom::synthetic_viewer
