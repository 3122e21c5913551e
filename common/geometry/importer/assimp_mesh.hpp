#pragma once

// Private to the importer: reads a mesh file of any format as one mesh.

#include <filesystem>
#include <string>

#include "common/geometry/mesh_io.hpp"

namespace phantom::geometry::detail {

/// Reads the file as load_mesh() describes, but in this process. On failure returns false with the reason in
/// `problem` (without the file's name). May crash or hang on malformed files, and throw std::bad_alloc.
bool import_mesh(const std::filesystem::path& path, const MeshImportOptions& options, LoadedMesh& mesh,
                 std::string& problem);

}  // namespace phantom::geometry::detail
