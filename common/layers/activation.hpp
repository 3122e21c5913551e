#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/core/work_budget.hpp"
#include "common/geometry/implicit/implicit.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/layers/layers.hpp"
#include "common/workspace/object_bricks.hpp"
#include "common/workspace/profile.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::layers {

/// A body to activate: its mesh, its formula if the model has one, and the fluid around it.
struct Body {
  std::string name;
  std::uint16_t id = 0;           ///< 1…65534
  geometry::TriangleMesh mesh_W;  ///< the body's surface; if there is a formula, made from it
  workspace::LayerProfile profile;
  geometry::ImplicitPtr implicit_W = nullptr;  ///< if not null, it decides exactly what is solid
  /// False: no body but a protected zone. All of it and of its guard is layer 1, so that it has no voxel of a
  /// body; `profile` must have no layers inside.
  bool solid = true;
};

/// Results and durations of one body's activation.
struct BodyReport {
  voxelise::VoxeliseReport mesh;
  workspace::VoxelBox box;  ///< of the object voxel array, clipped to the grid grown by the profile's reach
  std::size_t boundary_voxels = 0;  ///< in the grid, like interior_voxels
  std::size_t interior_voxels = 0;
  double voxelise_s = 0.0, layers_s = 0.0;
};

/// Returns seconds since an arbitrary origin, for the reports only. If null, durations stay 0.
using Stopwatch = std::function<double()>;

/// Greatest number of voxels of the box around an object and its layers: a cell of 5 m × 4 m × 4 m at 1 mm,
/// with some reserve. A larger box points to a mistake in scale.
inline constexpr std::size_t kMaxObjectVoxels = std::size_t{1} << 37;

/// Returns the grid over a box in W with corner `min_m`. If the last voxel of an axis is only partly in the
/// box, it is included.
workspace::GridSpec grid_over(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m,
                              const workspace::VoxelSize& voxel_size_m);

/// How an activation runs, and how it reports progress.
struct ActivationOptions {
  int threads = 1;
  Stopwatch stopwatch;
  /// Called from time to time with a rising share, 0…1, on the thread that called activate_object().
  std::function<void(double share)> on_progress;
  /// Called likewise; false stops the activation with kUnavailable.
  std::function<bool()> keep_going;
  /// Objects in larger boxes are made in parts. This bounds the work space, at three to four bits a voxel.
  std::size_t most_voxels_at_once = std::size_t{1} << 29;
  /// If not null, all work is counted for it; over its bound, the activation ends with kResourceExhausted.
  core::WorkBudget* budget = nullptr;
};

/// A body converted to layers of fluid.
struct ActivatedObject {
  workspace::ObjectBricks bricks;
  BodyReport report;
};

/// Voxelises a body in the workspace's grid and lays its layers; merge_bricks() then puts it into a
/// workspace. Refuses an unusable profile and a body that is too large or too far away; the message names the
/// body. A body that does not reach the grid gives no bricks. The bricks are the same for any number of
/// threads. Not real-time safe.
core::Expected<ActivatedObject> activate_object(const Body& body, const workspace::GridSpec& grid,
                                                const ActivationOptions& options = {});

/// Activates a single mesh in its own grid. The grid is the smallest box of whole voxels around the solid,
/// grown by the profile's reach; it is one or two voxels larger on each side if the object is made in parts.
/// Voxel borders lie at whole multiples of the voxel size in W.
core::Expected<std::pair<workspace::Workspace, BodyReport>> activate_alone(
    const Body& body, const workspace::VoxelSize& voxel_size_m, const ActivationOptions& options = {});

/// Counts the grid's voxels for each neighbour order; the index is the order as a byte.
std::array<std::uint64_t, 256> count_orders(const workspace::Workspace& workspace);

}  // namespace phantom::layers
