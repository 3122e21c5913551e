#pragma once

#include "common/geometry/implicit.hpp"
#include "common/voxelise/voxelise.hpp"
#include "common/workspace/work_options.hpp"

namespace phantom::voxelise {

/// How far a boundary voxel may be from the surface: the edge, in voxels, of the parts into which a voxel is
/// cut before it is taken for touched without proof.
inline constexpr double kImplicitPart_vox = 1.0 / 16.0;

/// Voxels of a solid by formula that stands in W, within `clip`.
///
/// Inside: f < 0 at the voxel's centre. Boundary: one of the voxel's 16³ parts may hold a point of the
/// surface, by bounds of f over the part. So every voxel that the surface passes through is marked, however
/// thin the wall, the boundary has no gap, and a marked voxel that the surface misses has it within reach of
/// the bounds: for f that is a distance, √3/16 voxel. A surface on the border between two voxels belongs to
/// the upper one, as in floor(). Where f is undefined, space is outside.
///
/// Cubes of voxels that f's bounds put on one side are settled at once: cost rises with the surface, not with
/// the volume. The same for any number of threads. kResourceExhausted if the solid reaches too far,
/// kUnavailable if options.go_on said no. Not real-time safe.
core::Expected<SolidVoxels> voxelise(const geometry::ImplicitSolid& solid_W, const workspace::GridSpec& grid,
                                     const workspace::VoxelBox& clip,
                                     const workspace::WorkOptions& options = {});

/// Smallest box of voxels that holds the solid's bounding box, which must be within ±1e6 m.
workspace::VoxelBox voxel_bounds(const geometry::ImplicitSolid& solid_W, const workspace::GridSpec& grid);

}  // namespace phantom::voxelise
