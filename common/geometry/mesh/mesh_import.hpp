#pragma once

// Private to this library and to its importer: reading binary STLs in load_mesh()'s own process, and the
// steps that both processes share.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "common/geometry/mesh/mesh_io.hpp"
#include "common/geometry/mesh/stl.hpp"

namespace phantom::geometry::detail {

/// Returns the file name's extension in lower case without the dot: "glb" for ".GLB".
std::string extension_of(const std::filesystem::path& path);

/// Returns the rotation that turns `up` into +z: identity for z, (x, y, z) → (x, −z, y) for y, (−z, y, x) for
/// x.
Eigen::Matrix3d to_z_up(UpAxis up);

/// Sets scale and up-axis: from the caller's options, otherwise from the file, otherwise guessed with a note.
/// `format`: the importer's name for it. `extents`: returns the mesh's extents along x, y, z in the file's
/// units.
void resolve_frame(const MeshImportOptions& options, std::string_view format, const DeclaredFrame& declared,
                   const std::function<std::array<double, 3>()>& extents, LoadedMesh& mesh);

/// Completes every import: adds the notes. Returns false, with the reason in `problem`, if there is no usable
/// mesh. `collapsed`: triangles left out because two of their corners have the same position.
bool finish_import(bool finite, std::size_t collapsed, LoadedMesh& mesh, std::string& problem);

/// Returns for example "has more than 100 triangles".
std::string too_many_triangles(const MeshImportOptions& options);

/// Completes the import of either kind of STL.
bool finish_stl(StlMesh stl, const MeshImportOptions& options, LoadedMesh& mesh, std::string& problem);

/// Reads a binary STL of up to `most_triangles` with our own reader. Whatever the file holds, it takes
/// neither long nor much memory (256 bytes per triangle), so that a moderate number of triangles needs no
/// separate process. Returns none if the file is something else or larger; false, with the reason in
/// `problem`, if it holds no usable mesh.
std::optional<bool> import_binary_stl(const std::filesystem::path& path, const MeshImportOptions& options,
                                      std::uint64_t most_triangles, LoadedMesh& mesh, std::string& problem);

}  // namespace phantom::geometry::detail
