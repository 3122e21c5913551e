#pragma once

// Private to this library and to its importer: what load_mesh() decides of a file in its own process, and
// what both decide alike.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "common/geometry/mesh_io.hpp"

namespace phantom::geometry::detail {

/// "glb" of a file name's ending ".GLB".
std::string ending_of(const std::filesystem::path& path);

/// The turn that takes `up` to +z: identity for z, (x, y, z) → (x, −z, y) for y, (−z, y, x) for x.
Eigen::Matrix3d to_z_up(UpAxis up);

/// Decides scale and up-axis: the caller's word, else the file's, else a guess with a note. `format`: the
/// importer's name of it. `extents`: gives those of the mesh along x, y, z in the file's units.
void settle_frame(const MeshImportOptions& options, std::string_view format, const DeclaredFrame& declared,
                  const std::function<std::array<double, 3>()>& extents, LoadedMesh& mesh);

/// What is said of every outcome; false, and why in `problem`, if there is none. `collapsed`: triangles that
/// were left out as two of their corners are in one place.
bool settle(bool finite, std::size_t collapsed, LoadedMesh& mesh, std::string& problem);

/// "has more than 100 triangles"
std::string too_many_triangles(const MeshImportOptions& options);

/// Reads a binary STL of up to `most_triangles` by our own reader, which whatever the file holds takes
/// neither long nor much memory (256 bytes a triangle), so that no process of its own is needed for a
/// moderate number. Nothing if the file is something else or larger; false, and why in `problem`, if it holds
/// no usable mesh.
std::optional<bool> import_binary_stl(const std::filesystem::path& path, const MeshImportOptions& options,
                                      std::uint64_t most_triangles, LoadedMesh& mesh, std::string& problem);

}  // namespace phantom::geometry::detail
