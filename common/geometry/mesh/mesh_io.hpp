#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/geometry/mesh/mesh_units.hpp"

namespace phantom::geometry {

/// Sets how a mesh file is read, and its limits.
struct MeshImportOptions {
  /// Metres per unit of the file (0.001 for millimetres). None: as the file declares, otherwise guessed.
  std::optional<double> scale;
  /// true: the file has +y up, and (x, y, z) becomes (x, −z, y), so that the result has +z up; false: the
  /// file has +z up, and nothing is turned. None: as the file declares, otherwise guessed.
  std::optional<bool> y_up;
  std::uint32_t max_triangles = 20'000'000;
  int max_cpu_s = 60;  ///< of the importing process; its wall-clock limit is four times that
  std::uint64_t max_memory_bytes = 4ULL << 30;  ///< that the import may use
  std::uint64_t max_file_bytes = 2ULL << 30;
  /// If not empty, asked ten times a second while the importing process runs; once it returns false, that is
  /// ended, and the import fails with kUnavailable.
  std::function<bool()> keep_going = {};
};

/// Holds a mesh in metres with +z up, and how its file was interpreted.
struct LoadedMesh : TriangleMesh {
  std::string format;  ///< the importer's name for the file's format
  double scale = 1.0;  ///< applied metres per unit of the file
  KnownFrom scale_from = KnownFrom::kCaller;
  UpAxis up = UpAxis::kZ;  ///< applied up-axis of the file
  KnownFrom up_from = KnownFrom::kCaller;
  /// What was guessed or left out, one sentence each for a warning, without the file's name.
  std::vector<std::string> notes;
};

/// Puts a mesh whose unit was guessed into another one, `scale` metres; its notes then give `why` for it.
/// Not real-time safe.
void replace_guessed_unit(LoadedMesh& mesh, double scale, const std::string& why);

/// Reads a mesh file of any format that assimp supports (STL, OBJ, PLY, OFF, glTF, COLLADA, 3MF, X …) into
/// one mesh in metres with +z up. Node transforms are applied (triangles of mirrored nodes are turned over,
/// so that outward stays outward), polygons are triangulated, equal vertices are joined, and triangles that
/// name a vertex twice are dropped.
///
/// Unit and up-axis are those in `options`, otherwise those that the file or its format's standard declares
/// (glTF, COLLADA, FBX, 3MF, AMF, X3D, OpenGEX, IFC, DXF with $INSUNITS; 3DS and ASE declare the axis only),
/// otherwise guessed with a note.
///
/// Some malformed files make assimp crash, hang or exhaust memory. Therefore assimp runs in a separate
/// process with limits, phantom_mesh_import. Only binary STLs of up to a million triangles are read in this
/// process, by our own reader. The caller always gets a mesh or a Status whose message names the file and
/// what is wrong:
///   - kNotFound: no such file;
///   - kInvalidArgument: not a usable mesh;
///   - kResourceExhausted: over a limit;
///   - kUnavailable: the importer cannot be started;
///   - kInternal: the importer's answer is invalid.
///
/// The importer is <prefix>/libexec/phantom/phantom_mesh_import, where <prefix> is the parent of the folder
/// that holds the running executable. The environment variable PHANTOM_MESH_IMPORT overrides this path.
/// Thread-safe, whatever other threads do. Not real-time safe.
core::Expected<LoadedMesh> load_mesh(const std::filesystem::path& path,
                                     const MeshImportOptions& options = {});

}  // namespace phantom::geometry
