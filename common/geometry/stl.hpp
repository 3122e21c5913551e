#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "common/geometry/mesh.hpp"

namespace phantom::geometry {

/// A binary STL as it stands: in the file's own units and axes.
struct StlMesh : TriangleMesh {
  std::size_t collapsed = 0;  ///< triangles left out because two of their corners are in one place
  bool finite = true;         ///< whether no coordinate is NaN or infinite
};

/// Bytes at a binary STL's beginning that hold its number of triangles: an 80-byte header and the number; 50
/// a triangle follow.
inline constexpr std::size_t kStlHeadBytes = 84;

/// Number of triangles of a binary STL of `size` bytes, the first of which are `head`; none if it is not one,
/// that is if the number does not account for every byte. (A text STL might by chance; the odds are 2⁻³².)
std::optional<std::uint32_t> binary_stl_triangles(std::span<const std::uint8_t> head, std::uint64_t size);

/// Triangles of a binary STL, equal corners joined; its normals and attributes are not looked at. `bytes`:
/// what binary_stl_triangles() takes for one; else the mesh is empty. Not real-time safe.
StlMesh read_binary_stl(std::span<const std::uint8_t> bytes);

/// The mesh as a binary STL (normals 0: readers take them from the corners).
std::vector<std::uint8_t> binary_stl(const TriangleMesh& mesh);

}  // namespace phantom::geometry
