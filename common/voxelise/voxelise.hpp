#pragma once

#include "common/core/status.hpp"
#include "common/geometry/mesh.hpp"
#include "common/workspace/voxel_box.hpp"
#include "common/workspace/work_options.hpp"

namespace phantom::voxelise {

/// What was found about a mesh while it was voxelised, and what was assumed. Only where a mesh is not a
/// closed surface that faces one way as it stands are the defects looked for; otherwise they are 0.
struct VoxeliseReport {
  std::size_t triangles = 0;
  std::size_t degenerate_triangles = 0;  ///< with two corners in one place (to 1/16384 voxel); left out
  std::size_t duplicate_triangles = 0;   ///< with the same corners as another; left out
  std::size_t turned_triangles =
      0;               ///< faced against the most of their shell, or their shell against the others
  bool closed = true;  ///< a closed surface that faces one way, as it stands or with the above put right
  /// Voxels on which the lines along the three axes did not agree: the winding number decided (open meshes
  /// only).
  std::size_t disputed_voxels = 0;
};

/// A body as voxels: `boundary` where its surface passes, `inside` where the voxel's centre is inside,
/// surface or not. Interior are those inside through which no surface passes. Both cover `box`.
struct SolidVoxels {
  workspace::VoxelBox box;
  workspace::BitVolume boundary;
  workspace::BitVolume inside;
  VoxeliseReport report;

  bool is_interior(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return inside.get(x, y, z) && !boundary.get(x, y, z);
  }
  workspace::BitVolume interior() const;  ///< all of them, as a volume of its own
};

/// Voxels of a mesh that stands in W (transform the mesh first: turned voxels would have holes), within
/// `clip`.
///
/// Boundary: every voxel that a triangle passes through, however thin the plate or small the triangle, so
/// that the boundary of a closed mesh has no gap. A face that lies on the border between two voxels belongs
/// to the upper one, as in floor().
///
/// Inside: where the winding number along x at a voxel's centre is not 0, each line through an edge or a
/// vertex counted once; so shells that overlap are filled, shells that face inwards within others are
/// cavities, and a mesh that faces inwards as a whole is the same solid. A mesh that is not a closed surface
/// facing one way is mended first: corners in one place are joined, repeated triangles dropped, triangles
/// turned over that face against their shell, shells that face against the others and lie within none. If it
/// still has gaps, the lines along x, y and z vote; a line that enters and leaves a different number of times
/// has no say. Where at least two do not agree, or fewer than two have a say, the generalised winding number
/// does (|w| > ½): it closes a hole with a smooth sheet and never floods the surroundings. It is asked along
/// x at most every 16 voxels where no surface lies between, and more closely the nearer it is to ½.
///
/// Exact on closed meshes: vertices are rounded to 1/16384 voxel, all decisions after that are made in
/// integers; the same for any number of threads. kInvalidArgument if a coordinate is not finite,
/// kResourceExhausted if the mesh reaches farther than 16384 voxels from `clip`. An object that does not
/// touch `clip` gives an empty box. An open mesh in fine voxels may take minutes: options.go_on is asked, and
/// kUnavailable is returned if it says no. Not real-time safe.
core::Expected<SolidVoxels> voxelise(const geometry::TriangleMesh& mesh_W, const workspace::GridSpec& grid,
                                     const workspace::VoxelBox& clip,
                                     const workspace::WorkOptions& options = {});

/// Smallest box of voxels that holds a mesh with these bounds, which must be finite and within ±1e6 m.
workspace::VoxelBox voxel_bounds(const geometry::BoundingBox& bounds_W, const workspace::GridSpec& grid);

}  // namespace phantom::voxelise
