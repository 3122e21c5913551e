#pragma once

// Private to the importer: in which coordinates the importer delivers a scene, and what the file declares.

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "common/geometry/mesh_units.hpp"

struct aiScene;

namespace phantom::geometry::detail {

/// The importer's scene against the file: p_file = to_file · p_scene, a turn and a scale.
struct SceneFrame {
  std::string format;  ///< the importer's name of the format
  DeclaredFrame declared;
  Eigen::Matrix3d to_file = Eigen::Matrix3d::Identity();
};

SceneFrame scene_frame(const aiScene& scene, const std::filesystem::path& path);

}  // namespace phantom::geometry::detail
