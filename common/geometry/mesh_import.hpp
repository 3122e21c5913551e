#pragma once

// Private to this library: the parts of load_mesh that read the file.

#include <filesystem>
#include <optional>
#include <string>

#include "common/geometry/mesh_io.hpp"

namespace phantom::geometry::detail {

/// Reads the file with assimp in this very process. On failure returns false and says why in `problem`
/// (without the file's name). May crash or hang on malformed files.
bool import_mesh_unguarded(const std::filesystem::path& path, const MeshImportOptions& options,
                           LoadedMesh& mesh, std::string& problem);

/// Reads a binary STL of moderate size: by our own reader, which whatever the file holds takes neither long
/// nor much memory, so that no child process is needed. Nothing if the file is something else; otherwise as
/// above.
std::optional<bool> import_small_binary_stl(const std::filesystem::path& path,
                                            const MeshImportOptions& options, LoadedMesh& mesh,
                                            std::string& problem);

}  // namespace phantom::geometry::detail
