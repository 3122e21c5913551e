#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/workspace/workspace.hpp"

namespace phantom::phantom_sensing {

/// A direct-mapped cache of the principal gradients of one workspace's voxels. An arm moves by a tenth of a
/// voxel in a tick, so most of the voxels that it is in were looked up in the tick before. Of voxels that
/// share an entry the newest stays. Real-time safe: yes, but for the constructor.
class GradientCache {
 public:
  GradientCache() : entries_(kEntries) {}

  /// Forgets all gradients if this is another workspace than before.
  void follow(const workspace::Workspace& voxels) noexcept {
    if (voxels_ == &voxels && version_ == voxels.version) return;
    voxels_ = &voxels;
    version_ = voxels.version;
    ++generation_;
  }
  /// Returns a voxel's gradient; null: not known.
  const Eigen::Vector3d* find(workspace::Index3 voxel) const noexcept {
    const Entry& entry = entries_[place_of(voxel)];
    return entry.generation == generation_ && entry.voxel == voxel ? &entry.pgv_m : nullptr;
  }
  const Eigen::Vector3d& put(workspace::Index3 voxel, const Eigen::Vector3d& pgv_m) noexcept {
    Entry& entry = entries_[place_of(voxel)];
    entry = {generation_, voxel, pgv_m};
    return entry.pgv_m;
  }

 private:
  static constexpr std::size_t kEntries = 16384;
  struct Entry {
    std::uint64_t generation = 0;
    workspace::Index3 voxel{};
    Eigen::Vector3d pgv_m = Eigen::Vector3d::Zero();
  };
  /// Neighbours along any axis have different places: 32 × 32 × 16 voxels fit without a clash.
  static std::size_t place_of(workspace::Index3 voxel) noexcept {
    return (static_cast<std::size_t>(voxel.x) & 31U) | (static_cast<std::size_t>(voxel.y) & 31U) << 5 |
           (static_cast<std::size_t>(voxel.z) & 15U) << 10;
  }

  std::vector<Entry> entries_;
  const workspace::Workspace* voxels_ = nullptr;
  std::uint64_t version_ = 0, generation_ = 1;
};

}  // namespace phantom::phantom_sensing
