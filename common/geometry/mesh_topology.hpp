#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace phantom::geometry {

using Triangle = std::array<std::uint32_t, 3>;  ///< indices of vertices

/// Whether the triangles' edges cancel out: each edge is run through as often one way as the other. Then, and
/// only then, the winding number is a whole number everywhere off the surface. Linear, without a table:
/// random weights per edge are summed, so that a wrong "yes" has probability 2⁻⁶⁴. Not real-time safe.
bool is_oriented_surface(std::span<const Triangle> triangles);

/// How triangles hang together. Triangles that share an edge which no third one has are neighbours; what
/// neighbours reach is a shell.
struct MeshTopology {
  struct Shell {
    std::size_t triangles = 0;
    std::size_t turned = 0;  ///< of these, see MeshTopology::turned
    bool closed = true;      ///< every edge has two triangles
    bool orientable = true;  ///< false for a Möbius strip and the like
  };
  std::size_t open_edges = 0;           ///< edges of one triangle
  std::size_t non_manifold_edges = 0;   ///< edges of three or more
  std::vector<std::uint32_t> shell_of;  ///< per triangle
  /// Per triangle: 1 if it must be turned over so that its shell faces one way, the way of most of it.
  std::vector<std::uint8_t> turned;
  std::vector<Shell> shells;
};

/// Time O(n log n), about 40 bytes a triangle. Triangles that name a vertex twice must not be among them.
/// Pure.
MeshTopology topology_of(std::span<const Triangle> triangles);

/// Triangles without repetitions: of those with the same three corners one is kept for each way round, and
/// where both ways occur, both only if the rest is closed without them (a plate drawn from both sides, say).
/// Triangles that name a vertex twice are dropped.
struct UniqueTriangles {
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> source;  ///< index of each in the input
  std::size_t degenerate = 0;
  std::size_t duplicates = 0;
};
UniqueTriangles unique_triangles(std::span<const Triangle> triangles);

}  // namespace phantom::geometry
