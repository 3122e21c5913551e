#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>

#include "common/core/status.hpp"
#include "common/geometry/mesh.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::robot {

/// What a link looks like: a mesh file, or the closed mesh of a box, a cylinder or a sphere.
struct LinkMesh {
  std::filesystem::path file;   ///< empty: `body`
  geometry::TriangleMesh body;  ///< in the frame of the mesh, outward
  /// By which the file's coordinates are multiplied along their x, y and z; none is 0. A negative one
  /// mirrors.
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  geometry::Pose X_link_mesh;  ///< in the moving link's frame
  std::array<float, 3> colour{0.8F, 0.8F, 0.8F};
};

/// Returns the mesh in its own frame, in metres. The axes of a file are used unchanged, and its unit is the
/// metre unless it is COLLADA, which declares one, as ROS does. Errors as geometry::load_mesh().
core::Expected<geometry::TriangleMesh> load_mesh(const LinkMesh& mesh);

}  // namespace phantom::robot
