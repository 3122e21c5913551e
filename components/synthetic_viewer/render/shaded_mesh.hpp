#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"

namespace phantom::synthetic_viewer {

/// A mesh in the form that the graphics card uses: indexed vertices with normals.
struct ShadedMesh {
  struct Vertex {
    std::array<float, 3> position_m;
    std::array<float, 3> normal;
  };
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;  ///< three per triangle, counter-clockwise seen from outside
};

/// Adds normals to a mesh, smooth over bends of less than `crease_rad` and sharp elsewhere. Vertices at the
/// same position are merged, whether the source shares them or not; triangles without area are left out.
/// Pure.
ShadedMesh shade(const geometry::TriangleMesh& mesh, double crease_rad = 0.6);

/// Returns a coarse version of a mesh: vertices within a cube of `pitch_m` are merged, and triangles that
/// collapse are left out. Good enough where only the outline counts, as in shadows. Pure.
geometry::TriangleMesh coarsen(const geometry::TriangleMesh& mesh, double pitch_m);

}  // namespace phantom::synthetic_viewer
