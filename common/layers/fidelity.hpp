#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"
#include "common/workspace/profile.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::layers {

/// Deviation of faces from their nominal positions, in voxels (if they are no cubes: in their shortest
/// sides); positive: too far out.
struct Deviation {
  std::size_t faces = 0;
  double mean_vox = 0.0, rms_vox = 0.0;
  double min_vox = 0.0, max_vox = 0.0;
};

/// Direction of a face from the nearest point of the surface: along an axis, between two axes (an edge of a
/// cube around that point) or between three (a corner), whichever of the 26 directions is nearest.
enum class Side { kMinusX, kPlusX, kMinusY, kPlusY, kMinusZ, kPlusZ, kEdge, kCorner };
inline constexpr std::size_t kSides = 8;
const char* name_of(Side side);

/// Fidelity of one layer's outer face.
struct LayerFidelity {
  int order = 0;            ///< 1…q; kOrderGuard: the guard
  double offset_vox = 0.0;  ///< nominal distance of the face from the surface
  Deviation whole;
  std::array<Deviation, kSides> by_side;  ///< index: Side
};

/// Measures the fidelity of the layers (spec 1.4). A layer's outer face consists of the voxel faces between
/// what lies outside the layer and either the layer or what lies nearer to the body. The deviation of each
/// face is the distance of its middle from the surface minus the layer's nominal distance. `workspace` holds
/// this body alone, `mesh_W` is its surface, and `profile` is the profile of its layers. Pure; the same for
/// any number of threads. Not real-time safe.
std::vector<LayerFidelity> measure_fidelity(const geometry::TriangleMesh& mesh_W,
                                            const workspace::LayerProfile& profile,
                                            const workspace::Workspace& workspace, int threads = 1);

}  // namespace phantom::layers
