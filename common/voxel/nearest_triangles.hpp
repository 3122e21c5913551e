#pragma once

// Private to this library: the distance from voxel centres to a mesh, one tile of space at a time.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/mesh.hpp"
#include "common/voxel/voxel_box.hpp"

namespace phantom::voxel::detail {

/// Distances in voxels from the centres of a box's voxels to the nearest of a list of triangles.
///
/// Exact within a voxel of each triangle. Farther out a front moves away from the surface: each voxel hands
/// its nearest triangle on to its neighbours, which compute their own distance to it exactly. A voxel may so
/// get the second nearest triangle: the error is below a twentieth of a voxel (finely meshed, curved
/// surfaces).
class NearestTriangles {
 public:
  /// `vertices_vox`: the mesh in voxels from the grid's corner. `reach_vox`: farther distances are not looked
  /// for.
  NearestTriangles(const std::vector<Eigen::Vector3f>& vertices_vox,
                   const std::vector<std::array<std::uint32_t, 3>>& triangles, float reach_vox);

  /// Computes the box's distances to the triangles in `list`. Work space is kept from call to call.
  void compute(const VoxelBox& box, std::span<const std::uint32_t> list);
  /// Distance of a voxel of the box (given in grid voxels); infinity beyond the reach.
  float distance_vox(Index3 v) const {
    return cells_[at(v.x - box_.min.x, v.y - box_.min.y, v.z - box_.min.z)].distance;
  }

 private:
  struct Cell {
    float distance;
    std::int32_t triangle;  // −1: none known
    Eigen::Vector3f nearest;
    bool exact;      // else an upper bound: the distance to a neighbour's nearest point
    bool handed_on;  // to the neighbours
  };
  /// A voxel of the front, by its place in the box.
  struct Entry {
    std::int16_t x, y, z;
  };
  /// Cells stand in the box with a rim of one, which no front enters.
  std::size_t at(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return (static_cast<std::size_t>(z + 1) * stride_y_ + static_cast<std::size_t>(y + 1)) * stride_x_ +
           static_cast<std::size_t>(x + 1);
  }
  Eigen::Vector3f centre(const Entry& e) const {
    return {static_cast<float>(box_.min.x + e.x) + 0.5F, static_cast<float>(box_.min.y + e.y) + 0.5F,
            static_cast<float>(box_.min.z + e.z) + 0.5F};
  }
  void clear();
  void seed(std::uint32_t triangle);
  void offer(const Entry& entry, Cell& cell, std::int32_t triangle);
  void take(const Entry& entry, Cell& cell, const Cell& better);
  void hand_on(const Entry& entry);
  std::size_t bucket_of(float distance) const {
    return std::min(buckets_.size() - 1, static_cast<std::size_t>(distance * kBucketsPerVoxel));
  }

  static constexpr float kBucketsPerVoxel = 4.0F;
  const std::vector<Eigen::Vector3f>& vertices_;
  const std::vector<std::array<std::uint32_t, 3>>& triangles_;
  std::vector<std::uint8_t> large_;  // per triangle: longer than a voxel's diagonal
  float reach_;
  VoxelBox box_;
  std::size_t stride_x_ = 0, stride_y_ = 0;
  std::vector<Cell> cells_;
  std::vector<std::vector<Entry>> buckets_;  // the front, nearest first
  std::size_t bucket_ = 0;                   // that is being worked on
};

}  // namespace phantom::voxel::detail
