#pragma once

// Private to this library: computes the distance from voxel centres to a mesh, in a band around it.

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <vector>

#include "common/geometry/mesh.hpp"
#include "common/workspace/voxel_box.hpp"

namespace phantom::voxelise::detail {

/// Holds distances, in voxels, from voxel centres to the nearest triangle of a mesh.
///
/// Distances are exact within a voxel of each triangle. Farther out, a front moves away from the surface:
/// each voxel passes its nearest triangle on to its neighbours, which compute their own exact distance to it.
/// A voxel may thus get the second nearest triangle; the error is below a twentieth of a voxel. Time and
/// memory grow with the number of voxels in the band, not in the box.
class NearestTriangles {
 public:
  /// Computes all distances. `vertices_vox`: the mesh's vertices in voxels from the grid's corner. Only
  /// voxels of `region` (at most 16384 along an axis) and distances up to `reach_vox` are considered. The
  /// mesh must outlive this object. `keep_going`, if set, is called repeatedly; if it returns false, the rest
  /// is left undone (see is_whole()).
  NearestTriangles(const std::vector<Eigen::Vector3f>& vertices_vox,
                   const std::vector<std::array<std::uint32_t, 3>>& triangles,
                   const workspace::VoxelBox& region, float reach_vox,
                   const std::function<bool()>& keep_going = {});

  /// Returns whether the computation was completed; otherwise the distances have no meaning.
  bool is_whole() const { return whole_; }

  /// Returns the distance of a voxel, given by its address in the grid; infinity beyond the reach and outside
  /// the region.
  float distance_vox(workspace::Index3 v) const;
  /// Returns whether any distance is known in the cube of 8³ voxels with this corner (multiples of 8).
  bool knows_cube(workspace::Index3 corner) const;

 private:
  struct Cell {
    float distance = std::numeric_limits<float>::infinity();
    std::int32_t triangle = -1;
    Eigen::Vector3f nearest = Eigen::Vector3f::Zero();
    bool exact = true;       // false: an upper bound, the distance to a neighbour's nearest point
    bool handed_on = false;  // whether it was passed on to the neighbours
  };
  using Cube = std::array<Cell, 512>;
  /// A voxel of the front, counted from origin_.
  struct Entry {
    std::int16_t x, y, z;
  };

  Eigen::Vector3f centre(const Entry& e) const {
    return {static_cast<float>(origin_.x + e.x) + 0.5F, static_cast<float>(origin_.y + e.y) + 0.5F,
            static_cast<float>(origin_.z + e.z) + 0.5F};
  }
  bool in_region(const Entry& e) const {
    return e.x >= first_.x && e.y >= first_.y && e.z >= first_.z && e.x < end_.x && e.y < end_.y &&
           e.z < end_.z;
  }
  std::size_t cube_index(std::int32_t x, std::int32_t y, std::int32_t z) const {  // from origin_
    return (static_cast<std::size_t>(z >> 3) * cubes_y_ + static_cast<std::size_t>(y >> 3)) * cubes_x_ +
           static_cast<std::size_t>(x >> 3);
  }
  static std::size_t in_cube(std::int32_t x, std::int32_t y, std::int32_t z) {
    return static_cast<std::size_t>((z & 7) << 6 | (y & 7) << 3 | (x & 7));
  }
  Cell& cell(const Entry& e);

  /// Counts work. Returns false once keep_going has ended it.
  bool goes_on(const std::function<bool()>& keep_going, std::size_t work);
  std::size_t seed(std::uint32_t triangle);
  void offer(const Entry& entry, Cell& cell, std::int32_t triangle);
  void take(const Entry& entry, Cell& cell, const Cell& better);
  void hand_on(const Entry& entry);
  std::size_t bucket_of(float distance) const;

  const std::vector<Eigen::Vector3f>& vertices_;
  const std::vector<std::array<std::uint32_t, 3>>& triangles_;
  std::vector<std::uint8_t> large_;  // per triangle: 1 if it is several voxels long
  float reach_;
  workspace::Index3 origin_;       // corner of the first cube, in the grid
  workspace::Index3 first_, end_;  // the region, from origin_
  std::size_t cubes_x_ = 0, cubes_y_ = 0;
  std::vector<Cube*> directory_;
  std::deque<Cube> cubes_;
  std::vector<std::vector<Entry>> buckets_;  // the front, nearest first
  std::size_t bucket_ = 0;                   // the bucket that is being processed
  std::size_t unasked_ = 0;                  // work since the last call of keep_going
  bool whole_ = true;
};

}  // namespace phantom::voxelise::detail
