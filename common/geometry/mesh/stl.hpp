#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "common/geometry/mesh/mesh.hpp"

namespace phantom::geometry {

/// A binary STL as read, in the file's own units and axes.
struct StlMesh : TriangleMesh {
  std::size_t collapsed = 0;  ///< triangles left out because two of their corners have the same position
  bool finite = true;         ///< whether no coordinate is NaN or infinite
};

/// Number of bytes at a binary STL's beginning that contain its number of triangles: an 80-byte header and
/// the number. 50 bytes per triangle follow.
inline constexpr std::size_t kStlHeadBytes = 84;

/// Returns the number of triangles of a binary STL of `size` bytes that begins with `head`. Returns none if
/// the number does not account for every byte: the file is not a binary STL then. (A text STL may match by
/// chance, with probability 2⁻³².)
std::optional<std::uint32_t> binary_stl_triangles(std::span<const std::uint8_t> head, std::uint64_t size);

/// Returns the number of triangles that such a head declares, if they fit into `size` bytes; none if they do
/// not, or there are none. What may follow them is not of the STL's standard; some programs leave bytes
/// there.
std::optional<std::uint32_t> binary_stl_triangles_within(std::span<const std::uint8_t> head,
                                                         std::uint64_t size);

/// Returns the number of bytes of a binary STL with so many triangles.
std::uint64_t binary_stl_bytes(std::uint32_t triangles);

/// Reads the triangles of a binary STL and joins equal corners. Ignores its normals and attributes. `bytes`:
/// accepted by binary_stl_triangles(); otherwise the mesh is empty. Not real-time safe.
StlMesh read_binary_stl(std::span<const std::uint8_t> bytes);

/// Encodes a mesh as a binary STL (normals are 0: readers compute them from the corners).
std::vector<std::uint8_t> binary_stl(const TriangleMesh& mesh);

}  // namespace phantom::geometry
