#pragma once

#include "common/layers/layers.hpp"

namespace phantom::layers {

/// Lays the layers inside the body, for every method (spec 1.4, error guard; thesis A.5.2). Let d be the
/// exact Euclidean distance in voxels from an interior voxel's centre to the centre of the nearest voxel that
/// is not interior, and D_i the thickness of the first i inner layers. Then a voxel gets order −i where
/// D_{i−1} < d ≤ D_i. Deeper voxels stay interior, and the boundary stays boundary. Changes those voxels of
/// `bricks`, which already hold the outer layers in `part`, as distance_bricks() makes them. The solid must
/// be known within the inner layers' depth around the part. Not real-time safe.
void lay_inside(const voxelise::SolidVoxels& solid, const workspace::LayerProfile& profile,
                const workspace::VoxelBox& part, workspace::ObjectBricks& bricks,
                const workspace::WorkOptions& options = {});

}  // namespace phantom::layers
