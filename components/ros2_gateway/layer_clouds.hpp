#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/workspace/workspace.hpp"

namespace phantom::ros2_gateway {

/// The voxels of one order of the workspace as points, brick by brick, as they stand in the data of a
/// PointCloud2: x, y, z of the voxel's centre in W (float32, m), the brick's number (uint32: its place
/// x + n_x·(y + n_y·z) among the grid's bricks), the object's id (uint16), the order (int16): kPointStep
/// octets, little endian. Not thread-safe.
class LayerCloud {
 public:
  static constexpr std::uint32_t kPointStep = 20;

  explicit LayerCloud(std::int8_t order) : order_(order) {}

  std::int8_t order() const noexcept { return order_; }
  /// Takes a version, and returns the points of each brick that holds others than before, one brick after the
  /// other; a brick that holds none any more is one point of NaN with its number.
  std::vector<std::uint8_t> update(const workspace::Workspace& workspace);
  /// Returns all points.
  std::vector<std::uint8_t> whole() const;
  std::size_t points() const noexcept { return octets_ / kPointStep; }

 private:
  using Points = std::vector<std::uint8_t>;
  std::int8_t order_;
  workspace::GridSpec grid_;
  std::map<std::uint32_t, Points> bricks_;  // those that have points, by number
  std::size_t octets_ = 0;
};

}  // namespace phantom::ros2_gateway
