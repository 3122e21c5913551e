#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>

namespace phantom::workspace {

/// Integer address of a voxel in a grid, from 0.
struct Index3 {
  std::int32_t x = 0, y = 0, z = 0;
  friend bool operator==(const Index3&, const Index3&) = default;
};

/// A regular grid in the workspace frame W: voxel (i,j,k) spans [origin + i·s, origin + (i+1)·s)×…
/// (spec 1.3).
struct GridSpec {
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< corner of voxel (0,0,0) in W
  double voxel_size_m = 0.005;                         ///< s
  std::array<std::int32_t, 3> size_vox{0, 0, 0};       ///< voxels along x, y, z

  /// Returns floor((p − origin) / s) per axis; the index may lie outside the grid. `p_W_m` must be finite and
  /// within ±1e6 m.
  Index3 index_of(const Eigen::Vector3d& p_W_m) const noexcept {
    const Eigen::Vector3d scaled = (p_W_m - origin_m) / voxel_size_m;
    return {static_cast<std::int32_t>(std::floor(scaled.x())),
            static_cast<std::int32_t>(std::floor(scaled.y())),
            static_cast<std::int32_t>(std::floor(scaled.z()))};
  }
  Eigen::Vector3d centre_of(Index3 index) const noexcept {
    return origin_m + voxel_size_m * Eigen::Vector3d(index.x + 0.5, index.y + 0.5, index.z + 0.5);
  }
  bool contains(Index3 index) const noexcept {
    return static_cast<std::uint32_t>(index.x) < static_cast<std::uint32_t>(size_vox[0]) &&
           static_cast<std::uint32_t>(index.y) < static_cast<std::uint32_t>(size_vox[1]) &&
           static_cast<std::uint32_t>(index.z) < static_cast<std::uint32_t>(size_vox[2]);
  }
  std::int64_t voxel_count() const noexcept {
    return static_cast<std::int64_t>(size_vox[0]) * size_vox[1] * size_vox[2];
  }
};

}  // namespace phantom::workspace
