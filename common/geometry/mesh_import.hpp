#pragma once

// Private to this library: the part of load_mesh that runs in the child process.

#include <filesystem>
#include <string>

#include "common/geometry/mesh_io.hpp"

namespace phantom::geometry::detail {

/// Reads the file with assimp in this very process. On failure returns false and says why in `problem`
/// (without the file's name). May crash or hang on malformed files.
bool import_mesh_unguarded(const std::filesystem::path& path, const MeshImportOptions& options,
                           LoadedMesh& mesh, std::string& problem);

}  // namespace phantom::geometry::detail
