#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/implicit.hpp"
#include "common/geometry/mesh.hpp"
#include "common/layers/layers.hpp"
#include "common/workspace/object_bricks.hpp"
#include "common/workspace/profile.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::layers {

/// A body to be activated: its mesh or its formula where the model has it, and the fluid around it.
struct Body {
  std::string name;
  std::uint16_t id = 0;           ///< 1…65534
  geometry::TriangleMesh mesh_W;  ///< the body's surface; of a formula, made from it
  workspace::LayerProfile profile;
  geometry::ImplicitPtr implicit_W = nullptr;  ///< if there is one, it decides what is solid, exactly
};

/// What the activation of one body found and took.
struct BodyReport {
  voxelise::VoxeliseReport mesh;
  workspace::VoxelBox box;  ///< of the object voxel array, within the grid grown by the profile's reach
  std::size_t boundary_voxels = 0;  ///< in the grid, as interior_voxels
  std::size_t interior_voxels = 0;
  double voxelise_s = 0.0, layers_s = 0.0;
};

/// Seconds from any origin; for the reports only. Null: durations stay 0.
using Stopwatch = std::function<double()>;

/// Most voxels of the box around an object and its layers: a cell of 5 m × 4 m × 4 m at 1 mm, and something
/// to spare. More is a mistake in scale.
inline constexpr std::size_t kMaxObjectVoxels = std::size_t{1} << 37;

/// Grid over a box in W with corner `min_m`; a last voxel that is not whole is added.
workspace::GridSpec grid_over(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m,
                              double voxel_size_m);

/// How an activation runs, and whom it tells.
struct ActivationOptions {
  int threads = 1;
  Stopwatch stopwatch;
  std::function<void(double share)> on_progress;  ///< 0…1, now and then, rising; from the calling thread
  std::function<bool()> keep_going;  ///< asked now and then, likewise; "no" ends it with kUnavailable
  /// Objects in larger boxes are made part by part: it bounds the work space, at three to four bits a voxel.
  std::size_t most_voxels_at_once = std::size_t{1} << 29;
};

/// A body turned into graded, viscous space.
struct ActivatedObject {
  workspace::ObjectBricks bricks;
  BodyReport report;
};

/// Voxelises a body in the workspace's grid and lays its layers; merge_bricks() then puts it into a
/// workspace. Refuses a profile that cannot be used and a body that is too large or too far away; the message
/// names the body. A body that does not reach the grid gives no bricks. The same bricks for any number of
/// threads. Not real-time safe.
core::Expected<ActivatedObject> activate_object(const Body& body, const workspace::GridSpec& grid,
                                                const ActivationOptions& options = {});

/// Activates a single mesh in a grid of its own: the smallest whole-voxel box around the solid (one or two
/// voxels more on each side if it is made part by part), grown by the profile's reach; voxel borders at whole
/// multiples of the voxel size in W.
core::Expected<std::pair<workspace::Workspace, BodyReport>> activate_alone(
    const Body& body, double voxel_size_m, const ActivationOptions& options = {});

/// Voxels of the grid per neighbour order; index: the order's byte.
std::array<std::uint64_t, 256> count_orders(const workspace::Workspace& workspace);

}  // namespace phantom::layers
