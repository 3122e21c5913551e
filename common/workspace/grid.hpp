#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>

namespace phantom::workspace {

/// Integer address of a voxel in a grid, from 0; or a difference of addresses.
struct Index3 {
  std::int32_t x = 0, y = 0, z = 0;

  constexpr std::int32_t& operator[](std::size_t axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  constexpr std::int32_t operator[](std::size_t axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  friend constexpr Index3 operator+(Index3 a, Index3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Index3 operator-(Index3 a, Index3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Index3 operator*(std::int32_t k, Index3 a) { return {k * a.x, k * a.y, k * a.z}; }
  friend constexpr auto operator<=>(const Index3&, const Index3&) = default;
};
constexpr Index3 min(Index3 a, Index3 b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
constexpr Index3 max(Index3 a, Index3 b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}
inline Eigen::Vector3d vector(Index3 a) { return {double(a.x), double(a.y), double(a.z)}; }

/// A regular grid in the workspace frame W: voxel (i,j,k) spans [origin + i·s, origin + (i+1)·s)×…
/// (spec 1.3).
struct GridSpec {
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< corner of voxel (0,0,0) in W
  double voxel_size_m = 0.005;                         ///< s
  std::array<std::int32_t, 3> size_vox{0, 0, 0};       ///< voxels along x, y, z

  /// Returns floor((p − origin) / s) per axis; the index may lie outside the grid. `p_W_m` must be finite and
  /// within ±1e6 m.
  Index3 index_of(const Eigen::Vector3d& p_W_m) const noexcept {
    const Eigen::Array3i floor = ((p_W_m - origin_m) / voxel_size_m).array().floor().cast<int>();
    return {floor.x(), floor.y(), floor.z()};
  }
  Eigen::Vector3d centre_of(Index3 index) const noexcept {
    return origin_m + voxel_size_m * (vector(index).array() + 0.5).matrix();
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
