#pragma once

// Private to the importer: 3MF packages. assimp leaves out, in silence, what stands in other model parts.

#include <filesystem>
#include <string>

#include "common/geometry/mesh/mesh_io.hpp"

namespace phantom::geometry::detail {

/// Reads what a 3MF package builds as load_mesh() describes: all items of its root model, with their
/// components and transforms, from all model parts (3MF core specification 1.3, production extension 1.1).
/// Refuses what it would have to leave out: extensions that change the shape, objects that are missing. On
/// failure returns false with the reason in `problem`. May throw std::bad_alloc.
bool import_3mf(const std::filesystem::path& path, const MeshImportOptions& options, LoadedMesh& mesh,
                std::string& problem);

}  // namespace phantom::geometry::detail
