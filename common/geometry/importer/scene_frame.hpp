#pragma once

// Private to the importer: the coordinates of an imported scene, and what the file declares about its own.

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "common/geometry/mesh_units.hpp"

struct aiScene;

namespace phantom::geometry::detail {

/// Relates the scene's coordinates to the file's: p_file = to_file · p_scene, a rotation and a scale.
struct SceneFrame {
  std::string format;  ///< the importer's name for the format
  DeclaredFrame declared;
  Eigen::Matrix3d to_file = Eigen::Matrix3d::Identity();
};

SceneFrame scene_frame(const aiScene& scene, const std::filesystem::path& path);

}  // namespace phantom::geometry::detail
