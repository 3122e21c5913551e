#pragma once

#include <cstddef>

#include "common/geometry/mesh/mesh.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::synthetic_viewer {

/// Greatest number of rectangles of a live_shape().
inline constexpr std::size_t kMaxLiveFaces = 20'000;

/// Returns the surface in W of what depth cameras see and the model lacks (messages::kLiveId), as its voxels
/// have it: two triangles for each rectangle of faces. Without triangles: there is none, or it has more than
/// kMaxLiveFaces rectangles. Takes time as the workspace has bricks; pure.
geometry::TriangleMesh live_shape(const workspace::Workspace& workspace);

}  // namespace phantom::synthetic_viewer
