#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/mesh.hpp"
#include "common/geometry/mesh_units.hpp"

namespace phantom::geometry {

/// How to read a mesh file, and what it may cost.
struct MeshImportOptions {
  /// Metres per unit of the file (0.001 for millimetres). None: what the file declares, else a guess.
  std::optional<double> scale;
  /// The file has +y up: (x, y, z) → (x, −z, y), so that the result has +z up; false: +z up, nothing is
  /// turned. None: what the file declares, else a guess.
  std::optional<bool> y_up;
  std::uint32_t max_triangles = 20'000'000;
  int max_cpu_s = 60;                           ///< of the importing process; by the clock four times that
  std::uint64_t max_memory_bytes = 4ULL << 30;  ///< that the import may take
  std::uint64_t max_file_bytes = 2ULL << 30;
};

/// A mesh in metres with +z up, and how it came to that.
struct LoadedMesh : TriangleMesh {
  std::string format;  ///< the importer's name of the file's format
  double scale = 1.0;  ///< metres per unit of the file, as applied
  KnownFrom scale_from = KnownFrom::kCaller;
  UpAxis up = UpAxis::kZ;  ///< of the file, as applied
  KnownFrom up_from = KnownFrom::kCaller;
  /// What had to be guessed or left out, each a sentence to warn with; without the file's name.
  std::vector<std::string> notes;
};

/// Reads any mesh format that assimp knows (STL, OBJ, PLY, OFF, glTF, COLLADA, 3MF, X …) into one mesh in
/// metres with +z up: node transforms applied (triangles of mirrored nodes turned over, so that outward stays
/// outward), polygons triangulated, equal vertices joined, triangles that name a vertex twice dropped.
///
/// Unit and up-axis: as in `options`, else as the file or its format's standard declares them (glTF, COLLADA,
/// FBX, 3MF, AMF, X3D, OpenGEX, IFC, DXF with $INSUNITS, 3DS and ASE the axis), else guessed with a note.
///
/// Some malformed files make assimp crash, hang or eat memory, so it works in a process of its own under
/// limits, phantom_mesh_import (but for binary STLs of up to a million triangles, which our own reader reads
/// here): the caller always gets a mesh or a Status whose message names the file and what is wrong
/// (kNotFound: no such file; kInvalidArgument: not a usable mesh; kResourceExhausted: over a limit;
/// kUnavailable: the importer cannot be started; kInternal: its answer is none). The importer is
/// <prefix>/libexec/phantom/ phantom_mesh_import, where <prefix> is the folder above the running
/// executable's; the environment variable PHANTOM_MESH_IMPORT names another. Thread-safe, whatever other
/// threads do. Not real-time safe.
core::Expected<LoadedMesh> load_mesh(const std::filesystem::path& path,
                                     const MeshImportOptions& options = {});

}  // namespace phantom::geometry
