#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/robot/drag.hpp"
#include "common/robot/skin.hpp"
#include "common/voxel/workspace.hpp"

namespace phantom::robot {

/// The sensor that meets the greatest μ. Among several of that μ, the one in whose surroundings μ is
/// greatest: that is where the object is nearest, finer than the layers tell.
struct WorstSensor {
  bool found = false;      ///< false: every sensor is in free space; the rest is then meaningless
  std::size_t sensor = 0;  ///< index in the layout
  std::size_t link = 0;    ///< link that carries it
  voxel::Index3 voxel;     ///< where it is
  Eigen::Vector3d position_W_m = Eigen::Vector3d::Zero();
  float mu = 0.0F;           ///< Pa·s/m
  std::int8_t order = 0;     ///< neighbour order of that voxel
  std::uint16_t object = 0;  ///< object whose fluid it is
};

struct SensingOptions {
  /// Also take the sums of ∇μ (for directional drag): central differences over ± gradient_reach_vox voxels,
  /// on sensors that meet fluid. The reach should be a layer's thickness: μ is constant within a layer, and a
  /// shorter one sees no gradient in a layer's middle.
  bool gradient = false;
  int gradient_reach_vox = 4;
};

/// Takes the sums of a whole skin against a workspace. Holds the scratch memory of a tick; the layout and the
/// workspace are constant. Cost: one byte gathered per sensor and ten sums, whatever the number of joints;
/// with `gradient` six more bytes per sensor that meets fluid.
class SkinSensing {
 public:
  SkinSensing(const SkinLayout& layout, const SensingOptions& options);

  /// Real-time safe: yes. Results: sums(), active(), worst(). `joint_count` moving links are sensed.
  void sense(const LinkPoses& X_WL, std::size_t joint_count, const voxel::Workspace& workspace) noexcept;

  const LinkSums& sums() const noexcept { return sums_; }
  std::size_t active() const noexcept { return active_; }  ///< sensors that meet fluid
  const WorstSensor& worst() const noexcept { return worst_; }
  const SkinLayout& layout() const noexcept { return *layout_; }

 private:
  struct Block;
  void look_up(const Block& block, const voxel::Workspace& workspace) noexcept;
  void add_gradients(const Block& block, const voxel::Workspace& workspace, ViscousSums& sums) noexcept;
  void sense_link(std::size_t link, const geometry::Pose& X_WL, const voxel::Workspace& workspace) noexcept;
  void find_worst(const LinkPoses& X_WL, const voxel::Workspace& workspace) noexcept;

  const SkinLayout* layout_;
  SensingOptions options_;
  LinkSums sums_;
  std::size_t active_ = 0;
  WorstSensor worst_;
  std::vector<std::uint8_t> codes_;        // of every sensor, this tick
  std::vector<std::uint8_t> block_worst_;  // greatest code of each kBlock sensors
};

}  // namespace phantom::robot
