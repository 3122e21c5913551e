#pragma once

#include "common/layers/layers.hpp"

namespace phantom::layers {

/// Whether the shaping element of size m holds the cell (i, j, k) from its centre (thesis 4.6.3b, 4.7.2;
/// spec 1.4).
bool in_element(workspace::ShapingElement element, int m, int i, int j, int k);

/// Layers by the thesis's method: the element of size m_1 is centred on every boundary voxel, and the empty
/// voxels that it holds get order 1; the element of size m_2 on every voxel of order 1, and so on. Interior
/// voxels are not empty. With a guard of j voxels, every empty voxel at a distance of at most j voxels from
/// the solid (centres) is guard, and layer 1 grows from all guard voxels instead of the boundary.
///
/// `part` is the part of the grid whose bricks are wanted, its lower corner a brick's; the solid must be
/// known within the profile's reach around it. The same for any number of threads, and in whatever parts the
/// grid is done. Work space: three bits a voxel of what the layers reach, and for each thread a few slices of
/// the element's size. Not real-time safe.
workspace::ObjectBricks dilation_bricks(const voxelise::SolidVoxels& solid,
                                        const workspace::LayerProfile& profile,
                                        const workspace::VoxelBox& part,
                                        const workspace::WorkOptions& options = {});

}  // namespace phantom::layers
