#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/geometry/mesh.hpp"
#include "common/workspace/profile.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::layers {

/// How far faces lie from where they should, in voxels; positive: too far out.
struct Deviation {
  std::size_t faces = 0;
  double mean_vox = 0.0, rms_vox = 0.0;
  double min_vox = 0.0, max_vox = 0.0;
};

/// Where a face lies as seen from the nearest point of the surface: along an axis, between two axes (an edge
/// of a cube around that point) or between three (a corner), whichever of the 26 directions is nearest.
enum class Side { kMinusX, kPlusX, kMinusY, kPlusY, kMinusZ, kPlusZ, kEdge, kCorner };
inline constexpr std::size_t kSides = 8;
const char* name_of(Side side);

/// Fidelity of one layer's outer face.
struct LayerFidelity {
  int order = 0;            ///< 1…q; kOrderGuard: the guard skin
  double offset_vox = 0.0;  ///< where the face should be: this far from the surface
  Deviation whole;
  std::array<Deviation, kSides> by_side;  ///< index: Side
};

/// Fidelity of a layering (spec 1.4): the outer face of a layer is made of the voxels' faces between it, or
/// what lies nearer to the body, and what lies farther out; the deviation of each is the distance of its
/// middle from the surface minus the layer's nominal distance. `workspace` holds one body alone; `mesh_W` is
/// its surface, `profile` what its layers were made by. Pure; the same for any number of threads. Not
/// real-time safe.
std::vector<LayerFidelity> measure_fidelity(const geometry::TriangleMesh& mesh_W,
                                            const workspace::LayerProfile& profile,
                                            const workspace::Workspace& workspace, int threads = 1);

}  // namespace phantom::layers
