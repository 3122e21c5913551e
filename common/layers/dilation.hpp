#pragma once

#include "common/layers/layers.hpp"

namespace phantom::layers {

/// Returns whether the shaping element of size m contains the cell at (i, j, k) from its centre (thesis
/// 4.6.3b, 4.7.2; spec 1.4).
bool in_element(workspace::ShapingElement element, int m, int i, int j, int k);

/// Lays layers by the thesis's method. The element of size m_1 is centred on every boundary voxel, and the
/// empty voxels that it contains get order 1. Then the element of size m_2 is centred on every voxel of order
/// 1, and so on. Interior voxels are not empty. With a guard of j voxels, every empty voxel whose centre is
/// at most j voxels from the centre of a solid voxel is guard, and layer 1 grows from all guard voxels
/// instead of the boundary.
///
/// Computes the bricks of `part`, a part of the grid whose lower corner is a brick's. The solid must be known
/// within the profile's reach around it. The result is the same for any number of threads and any division of
/// the grid into parts. Work space: three bits for each voxel that the layers reach and, for each thread, a
/// few slices of the element's size. Not real-time safe.
workspace::ObjectBricks dilation_bricks(const voxelise::SolidVoxels& solid,
                                        const workspace::LayerProfile& profile,
                                        const workspace::VoxelBox& part,
                                        const workspace::WorkOptions& options = {});

}  // namespace phantom::layers
