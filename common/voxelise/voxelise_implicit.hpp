#pragma once

#include "common/geometry/implicit/implicit.hpp"
#include "common/voxelise/voxelise.hpp"
#include "common/workspace/work_options.hpp"

namespace phantom::voxelise {

/// Edge, in voxels, of the smallest parts into which a voxel is divided. If bounds cannot exclude the surface
/// from such a part, the voxel is marked as boundary. This limits how far a boundary voxel can be from the
/// surface.
inline constexpr double kImplicitPart_vox = 1.0 / 16.0;

/// Converts a solid in W given by a formula into voxels within `clip`.
///
/// Inside: f < 0 at the voxel's centre. Boundary: one of the voxel's 16³ parts may hold a point of the
/// surface, according to the bounds of f over the part. So every voxel through which the surface passes is
/// marked, however thin the wall, and the boundary has no gap. If the surface misses a marked voxel, it is as
/// near as the bounds can tell: within √3/16 voxel if f is a distance. A surface on the border between two
/// voxels belongs to the upper one, as in floor(). Where f is undefined, space is outside.
///
/// Cubes of voxels that the bounds of f place on one side are decided at once, so that the cost grows with
/// the surface and not with the volume. The result does not depend on the number of threads. Returns
/// kResourceExhausted if the solid reaches too far or options.budget is used up (every evaluation counts the
/// solid's steps()), and kUnavailable if options.go_on returned false. Not real-time safe.
core::Expected<SolidVoxels> voxelise(const geometry::ImplicitSolid& solid_W, const workspace::GridSpec& grid,
                                     const workspace::VoxelBox& clip,
                                     const workspace::WorkOptions& options = {});

/// Returns the smallest box of voxels that holds the solid's bounding box, which must be within ±1e6 m.
workspace::VoxelBox voxel_bounds(const geometry::ImplicitSolid& solid_W, const workspace::GridSpec& grid);

}  // namespace phantom::voxelise
