#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"

namespace phantom::geometry {

/// Counts the defects of a mesh, for its triangles as they are. Vertices at the same position must be one
/// vertex, as load_mesh() leaves them. Edges, shells and flipped triangles are counted, and the volume is
/// taken, without degenerate and duplicate triangles.
struct MeshReport {
  std::size_t triangles = 0;
  std::size_t degenerate_triangles = 0;  ///< without area: corners at one position or on a line
  std::size_t duplicate_triangles = 0;  ///< with the same three corners as another one, in either orientation
  std::size_t open_edges = 0;           ///< of one triangle only: rims of holes, T-junctions
  std::size_t non_manifold_edges = 0;   ///< of three or more triangles
  std::size_t flipped_triangles = 0;    ///< that face the other way than most of their shell
  std::size_t shells = 0;               ///< parts connected by edges of two triangles
  std::size_t closed_shells = 0;
  std::size_t unorientable_shells = 0;  ///< like a Möbius strip: no orientation makes all triangles agree
  std::size_t inward_shells = 0;        ///< closed, and mostly facing inwards: a cavity, or inside out
  std::size_t intersecting_pairs = 0;   ///< triangles that pass through each other; touching does not count
  bool intersections_complete = true;   ///< false: the search stopped at its limit, and there may be more
  double area_m2 = 0.0;
  /// What is solid: repeated triangles count once, each shell faces one way, and where the winding number is
  /// not 0 then is inside, as voxelisation has it. Valid only if has_volume().
  double volume_m3 = 0.0;

  bool closed() const { return triangles > 0 && open_edges == 0 && non_manifold_edges == 0; }
  /// Whether inside and outside are certain: of an open mesh, or where surfaces pass through one another, the
  /// sum over the shells is no volume.
  bool has_volume() const {
    return closed() && unorientable_shells == 0 && intersecting_pairs == 0 && intersections_complete;
  }
  bool flawless() const {
    return closed() && degenerate_triangles == 0 && duplicate_triangles == 0 && flipped_triangles == 0 &&
           unorientable_shells == 0 && intersecting_pairs == 0 && intersections_complete;
  }
};

struct MeshReportLimits {
  std::size_t max_pairs = 20'000'000;  ///< pairs tested for intersection; about 50 ns each
};

/// Checks a mesh for defects. Coordinates must be finite. Time O(n log n) plus that for the pairs. Pure; not
/// real-time safe.
MeshReport inspect_mesh(const TriangleMesh& mesh, const MeshReportLimits& limits = {});

/// Returns one clause per kind of defect ("has 12 open edges"); empty for a flawless mesh.
std::vector<std::string> describe(const MeshReport& report);

/// How finely a mesh's coordinates, numbers of 32 bits, can state its shape.
struct CoordinatePrecision {
  double farthest_m = 0.0;  ///< greatest coordinate, whatever its sign
  double step_m = 0.0;      ///< from there to the next number

  /// Whether the shape in voxels of this side, m, differs visibly from the one that was drawn.
  bool is_coarse(double voxel_m) const { return step_m > voxel_m / 32; }
  /// Whether it may be another shape.
  bool is_useless(double voxel_m) const { return step_m > voxel_m / 4; }
};

/// Returns the precision of the coordinates as they are: those of a mesh far from its origin are coarse.
/// Pure.
CoordinatePrecision coordinate_precision(const TriangleMesh& mesh);

/// Returns a clause for a warning or an error: "reaches 5e+06 m from its origin, where …".
std::string describe(const CoordinatePrecision& precision, double voxel_m);

}  // namespace phantom::geometry
