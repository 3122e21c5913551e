#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "common/geometry/implicit.hpp"
#include "common/geometry/mesh.hpp"
#include "common/geometry/pose.hpp"
#include "common/workspace/profile.hpp"

namespace phantom::runtime {

struct CellConfig;

/// A body that stands in the cell: a mesh file, a mesh in the cell's own text (`polyhedron`), or a solid by
/// formula
/// (`primitive`, `csg`, `implicit`).
struct ObjectConfig {
  std::uint16_t id = 0;  ///< in its cell, from 1 in the file's order; 0: in none yet
  std::string name;
  std::string place;           ///< "cell.yaml:12: objects[3]", for messages about what is found later
  std::filesystem::path mesh;  ///< any format that assimp reads; empty for the other kinds
  std::optional<double>
      mesh_scale;                 ///< metres per mesh unit (0.001 for millimetres); none: declared or guessed
  std::optional<bool> y_up;       ///< mesh has +y up, or +z; none: declared or guessed
  geometry::ImplicitPtr solid_O;  ///< the solid by formula, scaled; null for the other kinds
  geometry::TriangleMesh
      polyhedron_O;     ///< corners and triangles from the text, scaled; empty for the other kinds
  geometry::Pose X_WO;  ///< object frame in the workspace frame
  workspace::LayerProfile profile;  ///< the cell's, unless the object has its own
  int priority = 0;                 ///< where the cell merges by object_priority: the greater prevails
  std::array<float, 3> colour{0.7F, 0.7F, 0.7F};  ///< linear RGB, 0…1
  /// Real pose = X_WO · X_deviation: what the simulated world does not tell the model.
  geometry::Pose X_deviation;
};

/// Reads one object from YAML text, with the keys that an entry of `objects` has in the cell file. Paths are
/// relative to the cell's folder, the profile is the cell's unless the text has its own. Throws ConfigError.
/// Not real-time safe.
ObjectConfig read_object_text(const std::string& yaml, const CellConfig& cell);

}  // namespace phantom::runtime
