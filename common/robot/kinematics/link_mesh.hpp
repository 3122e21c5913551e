#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>

#include "common/core/status.hpp"
#include "common/geometry/mesh/mesh.hpp"
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

/// Returns the file that a URDF in `folder` calls `name`: "package://PACKAGE/REST", "file://…", relative or
/// absolute. Of a package, PACKAGE/REST is looked for in the folder and every one that it lies in, then REST
/// likewise, as the package's folder may have another name. Returns the name in `folder` if there is none.
std::filesystem::path find_mesh(const std::filesystem::path& folder, const std::string& name);
/// Returns whether a name begins with "package://".
bool is_of_package(const std::string& name);
/// Returns whether a file lies in a folder that is called like the package in `name`.
bool lies_in_package(const std::filesystem::path& file, const std::string& name);

}  // namespace phantom::robot
