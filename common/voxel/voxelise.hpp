#pragma once

#include "common/core/status.hpp"
#include "common/geometry/mesh.hpp"
#include "common/voxel/voxel_box.hpp"

namespace phantom::voxel {

/// What was found about a mesh while it was voxelised, and what was assumed.
struct VoxeliseReport {
  std::size_t triangles = 0;
  std::size_t duplicate_triangles = 0;  ///< named again with the same orientation; ignored
  bool closed = true;                   ///< every edge is shared by an even number of triangles
  std::size_t disputed_voxels = 0;      ///< voxels on which the three axes did not agree (open meshes only)
};

/// A body as voxels: `boundary` where its surface passes, `interior` where the voxel's centre is inside and
/// no surface passes. All cover `box`.
struct SolidVoxels {
  VoxelBox box;
  BitVolume boundary;
  BitVolume interior;
  BitVolume inside;  ///< every voxel whose centre is inside, surface or not
  VoxeliseReport report;
};

/// Voxels of a mesh that stands in W (transform the mesh first: turned voxels would have holes), within
/// `clip`.
///
/// Boundary: every voxel that a triangle passes through, however thin the plate or small the triangle, so
/// that the boundary of a closed mesh has no gap. A face that lies on the border between two voxels belongs
/// to the upper one, as in floor(). Interior: parity along x at voxel centres, each line through an edge or a
/// vertex counted once. Where a mesh is not closed, the lines along x, y and z vote, and a line that crosses
/// the surface an odd number of times says "outside": an open mesh never floods its surroundings.
///
/// Exact: vertices are rounded to 1/16384 voxel, all decisions after that are made in integers.
/// kResourceExhausted if the mesh reaches farther than 16384 voxels from `clip`. An object that does not
/// touch `clip` gives an empty box. Not real-time safe.
core::Expected<SolidVoxels> voxelise(const geometry::TriangleMesh& mesh_W, const GridSpec& grid,
                                     const VoxelBox& clip);

/// Smallest box of voxels that holds the mesh. Its vertices must be finite and within ±1e6 m.
VoxelBox voxel_bounds(const geometry::TriangleMesh& mesh_W, const GridSpec& grid);

}  // namespace phantom::voxel
