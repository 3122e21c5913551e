#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>

#include "common/core/status.hpp"

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

/// Lengths of a voxel's sides along x, y and z, above 0. What takes a length along an axis uses that axis's
/// side; what is given in voxels but is a length in any direction (a layer's thickness, a guard, a skin's
/// pitch) counts in the reference length, which for cubes is their side.
class VoxelSize {
 public:
  /// A cube. Implicit, because a single number says just that.
  VoxelSize(double side_m = 0.005) : sides_m_(Eigen::Vector3d::Constant(side_m)) {}
  explicit VoxelSize(const Eigen::Vector3d& sides_m) : sides_m_(sides_m) {}

  const Eigen::Vector3d& sides_m() const noexcept { return sides_m_; }
  double operator[](std::size_t axis) const noexcept { return sides_m_[static_cast<Eigen::Index>(axis)]; }
  /// The least side.
  double reference_m() const noexcept { return sides_m_.minCoeff(); }
  double greatest_m() const noexcept { return sides_m_.maxCoeff(); }
  /// The sides in reference lengths, each at least 1; exactly 1 for cubes.
  Eigen::Vector3d stretch() const noexcept { return sides_m_ / reference_m(); }
  bool is_cube() const noexcept { return sides_m_ == Eigen::Vector3d::Constant(sides_m_.x()); }
  /// The farthest that a point in a voxel is from its centre.
  double half_diagonal_m() const noexcept { return 0.5 * sides_m_.norm(); }
  /// The size of voxels `factor` times as large.
  friend VoxelSize operator*(double factor, const VoxelSize& size) {
    return VoxelSize(Eigen::Vector3d(factor * size.sides_m_));
  }
  friend bool operator==(const VoxelSize& a, const VoxelSize& b) noexcept { return a.sides_m_ == b.sides_m_; }

 private:
  Eigen::Vector3d sides_m_;
};

/// How many times as long as its shortest side a voxel may be. Beyond that, the long side would decide what
/// is felt, and a mistake in unit is likelier than a wish.
inline constexpr double kMaxStretch = 8.0;

/// Refuses sides that are not above 0 and finite, and voxels longer than kMaxStretch times their shortest
/// side.
core::Status check_voxel_size(const VoxelSize& size);

/// A regular grid in the workspace frame W: voxel (i,j,k) spans [origin + i·s, origin + (i+1)·s)×…, with an s
/// for each axis (spec 1.3).
struct GridSpec {
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< corner of voxel (0,0,0) in W
  VoxelSize voxel_size_m;                              ///< s
  std::array<std::int32_t, 3> size_vox{0, 0, 0};       ///< voxels along x, y, z

  /// Returns floor((p − origin) / s) per axis; the index may lie outside the grid. `p_W_m` must be finite and
  /// within ±1e6 m.
  Index3 index_of(const Eigen::Vector3d& p_W_m) const noexcept {
    const Eigen::Array3i floor = to_voxels(p_W_m).array().floor().cast<int>();
    return {floor.x(), floor.y(), floor.z()};
  }
  /// Returns a point in voxels from the grid's corner: whole numbers are borders.
  Eigen::Vector3d to_voxels(const Eigen::Vector3d& p_W_m) const noexcept {
    return (p_W_m - origin_m).cwiseQuotient(voxel_size_m.sides_m());
  }
  Eigen::Vector3d centre_of(Index3 index) const noexcept {
    return origin_m + voxel_size_m.sides_m().cwiseProduct((vector(index).array() + 0.5).matrix());
  }
  /// Returns the lower corner of a voxel in W.
  Eigen::Vector3d corner_of(Index3 index) const noexcept {
    return origin_m + voxel_size_m.sides_m().cwiseProduct(vector(index));
  }
  /// Returns how far the grid extends along each axis.
  Eigen::Vector3d extent_m() const noexcept {
    return voxel_size_m.sides_m().cwiseProduct(Eigen::Vector3d(size_vox[0], size_vox[1], size_vox[2]));
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
