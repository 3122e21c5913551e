#pragma once

#include "common/core/status.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/workspace/voxel_box.hpp"
#include "common/workspace/work_options.hpp"

namespace phantom::voxelise {

/// Reports the defects of a mesh and how they were repaired during voxelisation. Defects are looked for only
/// if the mesh as given is not a closed, consistently oriented surface; otherwise the counts are 0.
struct VoxeliseReport {
  std::size_t triangles = 0;
  std::size_t degenerate_triangles = 0;  ///< with two equal corners (to 1/16384 voxel); left out
  std::size_t duplicate_triangles = 0;   ///< with the same corners as another; left out
  std::size_t turned_triangles = 0;  ///< that faced the other way than most of their shell, or whose shell
                                     ///< faced the other way than the others
  bool closed = true;  ///< whether the mesh is a closed, consistently oriented surface, as given or once
                       ///< repaired as above
  /// Voxels on which the lines along the three axes disagreed, so that the winding number decided (open
  /// meshes only).
  std::size_t disputed_voxels = 0;
};

/// Holds a body as voxels. `boundary` holds the voxels through which its surface passes; `inside` holds those
/// whose centre is inside, whether the surface passes or not. Interior voxels are inside and no surface
/// passes through them. Both volumes cover `box`.
struct SolidVoxels {
  workspace::VoxelBox box;
  workspace::BitVolume boundary;
  workspace::BitVolume inside;
  VoxeliseReport report;

  bool is_interior(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return inside.get(x, y, z) && !boundary.get(x, y, z);
  }
  workspace::BitVolume interior() const;  ///< all interior voxels
};

/// Converts a mesh in W into voxels within `clip`. (Transform the mesh first: rotated voxels would have
/// holes.)
///
/// Boundary: every voxel through which a triangle passes, however thin the plate or small the triangle, so
/// that the boundary of a closed mesh has no gap. A face on the border between two voxels belongs to the
/// upper one, as in floor().
///
/// Inside: every voxel at whose centre the winding number along x is not 0. A line that passes through an
/// edge or a vertex counts that crossing once. So overlapping shells are filled, shells that face inwards
/// within others are cavities, and a mesh that faces inwards as a whole is the same solid.
///
/// A mesh that is not a closed, consistently oriented surface is repaired first. Corners at the same position
/// are joined and repeated triangles are dropped. Triangles that face the other way than their shell are
/// turned over, and so are shells that face the other way than the others and lie within none.
///
/// If the mesh still has gaps, the lines along x, y and z vote. A line that enters and leaves a different
/// number of times has no vote. Where at least two votes do not agree, or there are fewer than two votes, the
/// generalised winding number decides (|w| > ½): it closes a hole with a smooth sheet and never fills the
/// surroundings. It is evaluated along x, at most every 16 voxels where no surface lies between, and at
/// smaller steps the closer it is to ½.
///
/// Exact on closed meshes: vertices are rounded to 1/16384 voxel, and all decisions after that are made in
/// integers. The result does not depend on the number of threads.
///
/// Returns kInvalidArgument if a coordinate is not finite, and kResourceExhausted if the mesh reaches farther
/// than 16384 voxels from `clip`. An object that does not touch `clip` gives an empty box. An open mesh in
/// fine voxels may take minutes: options.go_on is called, and kUnavailable is returned if it returns false.
/// options.budget counts eight steps for each line of voxels that a triangle's box reaches over, before
/// anything is marked, and what winding numbers take; kResourceExhausted if it is used up. Not real-time
/// safe.
core::Expected<SolidVoxels> voxelise(const geometry::TriangleMesh& mesh_W, const workspace::GridSpec& grid,
                                     const workspace::VoxelBox& clip,
                                     const workspace::WorkOptions& options = {});

/// Returns the smallest box of voxels that holds a mesh with these bounds, which must be finite and within
/// ±1e6 m.
workspace::VoxelBox voxel_bounds(const geometry::BoundingBox& bounds_W, const workspace::GridSpec& grid);

}  // namespace phantom::voxelise
