#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/mesh.hpp"
#include "common/voxel/layers.hpp"
#include "common/voxel/profile.hpp"
#include "common/voxel/workspace.hpp"

namespace phantom::voxel {

/// A body to be activated: its mesh where the model has it, and the fluid around it.
struct Body {
  std::string name;
  std::uint16_t id = 0;  ///< 1…65534
  geometry::TriangleMesh mesh_W;
  LayerProfile profile;
};

/// What the activation of one body found and took.
struct BodyReport {
  VoxeliseReport mesh;
  VoxelBox box;  ///< of the object voxel array, within the grid grown by the profile's reach
  std::size_t boundary_voxels = 0;
  std::size_t interior_voxels = 0;
  double voxelise_s = 0.0, layers_s = 0.0, merge_s = 0.0;
};

/// Seconds from any origin; for the reports only. Null: durations stay 0.
using Stopwatch = std::function<double()>;

/// Most voxels of one object's dense work space.
inline constexpr std::size_t kMaxObjectVoxels = std::size_t{1} << 30;

/// Grid over a box in W with corner `min_m`; a last voxel that is not whole is added.
GridSpec grid_over(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m, double voxel_size_m);

/// Turns bodies into graded, viscous space: voxelises, layers and merges one after the other.
class Activation {
 public:
  /// `profiles`: of all bodies that will come; they make the palette. Refuses profiles that cannot be used.
  static core::Expected<Activation> begin(const GridSpec& grid, const std::vector<LayerProfile>& profiles,
                                          Stopwatch stopwatch = {});
  /// Adds a body. On failure (the message names the body) the workspace is as before.
  core::Expected<BodyReport> add(const Body& body);

  const Workspace& workspace() const { return workspace_; }
  Workspace take() { return std::move(workspace_); }

 private:
  Activation(Workspace workspace, Stopwatch stopwatch)
      : workspace_(std::move(workspace)), stopwatch_(std::move(stopwatch)) {}
  double now_s() const { return stopwatch_ ? stopwatch_() : 0.0; }

  Workspace workspace_;
  Stopwatch stopwatch_;
};

/// Activates a single mesh in a grid of its own: the smallest whole-voxel box around the solid, grown by the
/// profile's reach; voxel borders at whole multiples of the voxel size in W.
core::Expected<std::pair<Workspace, BodyReport>> activate_alone(const Body& body, double voxel_size_m,
                                                                const Stopwatch& stopwatch = {});

/// Voxels of the grid per neighbour order; index: the order's byte.
std::array<std::uint64_t, 256> count_orders(const Workspace& workspace);

}  // namespace phantom::voxel
