#pragma once

#include <cstdint>
#include <filesystem>

#include "common/core/status.hpp"
#include "common/geometry/mesh.hpp"

namespace phantom::geometry {

/// How to read a mesh file, and what it may cost.
struct MeshImportOptions {
  double scale = 1.0;  ///< metres per unit of the file (0.001 for millimetres)
  bool y_up = false;   ///< the file has +y up: (x, y, z) → (x, −z, y), so that the result has +z up
  std::uint32_t max_triangles = 20'000'000;
  int max_cpu_s = 60;                           ///< of the importing process
  std::uint64_t max_memory_bytes = 4ULL << 30;  ///< that the import may take besides what the caller holds
  std::uint64_t max_file_bytes = 2ULL << 30;
};

/// Reads any mesh format that assimp knows (STL, OBJ, PLY, OFF, glTF, COLLADA, 3MF, X …) into one mesh in
/// metres: node transforms applied, polygons triangulated, equal vertices joined, triangles that name a
/// vertex twice dropped.
///
/// Some malformed files make the importer crash, hang or eat memory, so it runs in a child process under
/// limits: the caller always gets a mesh or a Status whose message names the file and what is wrong
/// (kNotFound: no such file; kInvalidArgument: not a usable mesh; kResourceExhausted: over a limit). Forks:
/// call it before real-time threads start. Thread-safe. Not real-time safe.
core::Expected<TriangleMesh> load_mesh(const std::filesystem::path& path,
                                       const MeshImportOptions& options = {});

}  // namespace phantom::geometry
