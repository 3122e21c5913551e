#pragma once

// Private to this library: the distance from voxel centres to a mesh, one tile of space at a time.

#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/mesh.hpp"
#include "common/voxel/voxel_box.hpp"

namespace phantom::voxel::detail {

/// Distances in voxels from the centres of a box's voxels to the nearest of a list of triangles.
///
/// Exact within a voxel of each triangle; farther out, the nearest triangle is handed on from neighbour to
/// neighbour (two sweeps in each direction) and its distance computed exactly. Where two features are about
/// equally far the nearer one may be missed by a hair.
class NearestTriangles {
 public:
  /// `vertices_vox`: the mesh in voxels from the grid's corner. `reach_vox`: farther distances are not looked
  /// for.
  NearestTriangles(const std::vector<Eigen::Vector3f>& vertices_vox,
                   const std::vector<std::array<std::uint32_t, 3>>& triangles, float reach_vox);

  /// Computes the box's distances to the triangles in `list`. Work space is kept from call to call.
  void compute(const VoxelBox& box, std::span<const std::uint32_t> list);
  /// Distance of a voxel of the box (given in grid voxels); infinity beyond the reach.
  float distance_vox(Index3 v) const;

 private:
  struct Cell {
    float distance2;
    std::int32_t triangle;  // −1: none known
    Eigen::Vector3f nearest;
  };
  std::size_t at(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(box_.size[1]) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(box_.size[0]) +
           static_cast<std::size_t>(x);
  }
  Eigen::Vector3f centre(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return {static_cast<float>(box_.min.x + x) + 0.5F, static_cast<float>(box_.min.y + y) + 0.5F,
            static_cast<float>(box_.min.z + z) + 0.5F};
  }
  void seed(std::uint32_t triangle);
  void sweep(int direction);
  void offer(Cell& cell, const Eigen::Vector3f& p, std::int32_t triangle);

  const std::vector<Eigen::Vector3f>& vertices_;
  const std::vector<std::array<std::uint32_t, 3>>& triangles_;
  std::vector<float> extent_;  // longest edge of each triangle, at most a voxel's diagonal
  float reach2_;
  VoxelBox box_;
  std::vector<Cell> cells_;
};

}  // namespace phantom::voxel::detail
