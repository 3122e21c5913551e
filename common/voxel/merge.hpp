#pragma once

#include <cstdint>

#include "common/voxel/layers.hpp"
#include "common/voxel/profile.hpp"
#include "common/voxel/workspace.hpp"

namespace phantom::voxel {

/// Merges one object's voxels into the workspace: in each voxel the higher μ prevails, object and order
/// follow it; where they are equal the lower object id prevails (and, within one object, the higher order),
/// so that the result does not depend on the order of merging (spec 1.6). Makes bricks only where the object
/// has something. Not real-time safe.
void merge(const ObjectVoxels& object, std::uint16_t object_id, const CodeTable& codes, Workspace& workspace);

}  // namespace phantom::voxel
