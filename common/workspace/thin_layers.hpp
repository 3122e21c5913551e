#pragma once

#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/workspace/grid.hpp"
#include "common/workspace/profile.hpp"

namespace phantom::workspace {

/// Refuses a profile of which no layer has a voxel along one of the axes, where voxels are longer along it
/// than the layers reach: bodies would be felt along the others alone. The dilation method counts in voxels
/// along each axis and keeps every layer. The profile must have been checked.
core::Status check_layers(const LayerProfile& profile, const VoxelSize& size);

/// Returns a sentence for each axis along which a voxel is longer than a layer is thick, with the layers that
/// may have no voxel there and, of the distance method, those that never have one. Empty: there are none.
std::vector<std::string> thin_layer_notes(const LayerProfile& profile, const VoxelSize& size);

}  // namespace phantom::workspace
