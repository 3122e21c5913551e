#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "common/geometry/implicit/implicit.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/geometry/pose.hpp"
#include "common/workspace/profile.hpp"

namespace phantom::runtime {

struct CellConfig;

/// How arms hold an object: a tool, or something with a handle.
struct HoldConfig {
  std::string arm;      ///< the arm that carries it from the start; empty: none does
  std::string frame;    ///< the arm's link that holds it; empty: the last one
  geometry::Pose X_FO;  ///< object in the frame of that link
};

/// What an object of the cell is.
enum class ObjectKind : std::uint8_t {
  kSolid,         ///< a body with layers of fluid around it
  kProtectedZone  ///< a region to keep out of: fluid throughout, which nothing touches
};

/// Configuration of an object in the cell. Its shape is a mesh file, a mesh in the cell's own text
/// (`polyhedron`), or a solid by formula (`primitive`, `csg`, `implicit`).
struct ObjectConfig {
  std::uint16_t id = 0;  ///< number in its cell, from 1 in the file's order; 0: not in a cell yet
  std::string name;
  ObjectKind kind = ObjectKind::kSolid;
  std::string place;                 ///< "cell.yaml:12: objects[3]", for messages about faults found later
  std::filesystem::path mesh;        ///< any format that assimp reads; empty for the other kinds
  std::optional<double> mesh_scale;  ///< metres per mesh unit (0.001 for millimetres); none: as the file
                                     ///< declares, or the only usual unit that fits
  std::optional<bool> y_up;  ///< the mesh's up-axis is +y, else +z; none: as the file declares, or guessed
  geometry::ImplicitPtr solid_O;  ///< the solid by formula, scaled; null for the other kinds
  geometry::TriangleMesh
      polyhedron_O;     ///< corners and triangles from the text, scaled; empty for the other kinds
  geometry::Pose X_WO;  ///< pose of the object in the workspace frame
  workspace::LayerProfile profile;  ///< the object's own profile, or else the cell's
  int priority = 0;  ///< with the merge law object_priority, the object of the greater priority prevails
  std::array<float, 3> colour{0.7F, 0.7F, 0.7F};  ///< linear RGB, 0…1
  double mass_kg = 0.0;                           ///< 0: unknown
  double max_contact_force_N = 0.0;               ///< that it bears; 0: any
  double pose_error_m = 0.0;       ///< no point of it is farther from where the model has it; 0: not stated
  bool loose = false;              ///< in the simulated world nothing holds it; has a mass
  std::optional<HoldConfig> hold;  ///< none: arms hold it as it stands when they take it
  /// Deviation of the real pose from the model's: real pose = X_WO · X_deviation. Only the simulated world
  /// knows it.
  geometry::Pose X_deviation;

  bool is_zone() const { return kind == ObjectKind::kProtectedZone; }
};

/// Returns the thickness of the guard, in voxels, that covers an error of a pose.
int guard_for(double pose_error_m, const workspace::VoxelSize& size);

/// Reads one object from YAML text with the keys of an entry of `objects` in the cell file. Paths are
/// relative to the cell's folder. The profile is the cell's unless the text has its own. Throws ConfigError.
/// Not real-time safe.
ObjectConfig read_object_text(const std::string& yaml, const CellConfig& cell);

}  // namespace phantom::runtime
