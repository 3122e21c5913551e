#pragma once

#include "common/layers/layers.hpp"

namespace phantom::layers {

/// Layers inside the body (spec 1.4, error guard; thesis A.5.2), for every method: with d the exact Euclidean
/// distance in voxels from an interior voxel's centre to the centre of the nearest voxel that is not
/// interior, and D_i the thickness of the first i inner layers, a voxel gets order −i where D_{i−1} < d ≤
/// D_i. Deeper ones stay interior, the boundary stays boundary. Changes those voxels of `bricks`, which the
/// solid's outer layers made in `part`, as with distance_bricks(); the solid must be known within the inner
/// layers' depth around it. Not real-time safe.
void lay_inside(const voxelise::SolidVoxels& solid, const workspace::LayerProfile& profile,
                const workspace::VoxelBox& part, workspace::ObjectBricks& bricks,
                const workspace::WorkOptions& options = {});

}  // namespace phantom::layers
