#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

#include "common/geometry/mesh/mesh.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::synthetic_viewer {

/// Greatest number of rectangles of all live_shapes().
inline constexpr std::size_t kMaxLiveFaces = 20'000;

/// Surfaces in W of what depth cameras see and the model lacks, by its ids (messages::is_live).
using LiveShapes = std::map<std::uint16_t, geometry::TriangleMesh>;

/// Returns the surfaces as the voxels have them: two triangles for each rectangle of faces. An object is left
/// out with which they would have more than kMaxLiveFaces rectangles. Takes time as the workspace has bricks;
/// pure.
LiveShapes live_shapes(const workspace::Workspace& workspace);

}  // namespace phantom::synthetic_viewer
