#pragma once

// Private to this library: Euclidean distances among voxels whose sides differ, one axis after the other. It
// is plain where BandedDistance is fast, because with such sides squares are not whole numbers.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/layers/banded_distance.hpp"

namespace phantom::layers::detail {

/// Computes the orders of blocks of bricks from distances in reference lengths (workspace::VoxelSize): a step
/// along an axis is as long as that axis's stretch. Distances that differ by less than 5e-10 of themselves
/// count as equal, so that rounding does not decide where a limit falls on a voxel's centre. Holds the work
/// space of one thread.
class StretchedDistance {
 public:
  /// Keeps references to `solid` and `steps`.
  StretchedDistance(const voxelise::SolidVoxels& solid, const OrderSteps& steps,
                    const Eigen::Vector3d& stretch);

  /// Writes every voxel of every wanted brick, as BandedDistance::run() does.
  void run(const BrickBlock& block);

 private:
  static constexpr std::size_t kEdge = workspace::kBrickEdge;
  /// Squared distances of the voxels of a row of a brick.
  using Row = std::array<double, kEdge>;

  bool nearest_along_x(workspace::Index3 first, Row& squares) const;
  bool nearest_along_y(workspace::Index3 first, Row* squares);
  void nearest_along_z(const Row* plane, Row* squares) const;
  void lower(const Row& from, double more, Row& to) const;
  void write(workspace::Index3 corner, std::int8_t* orders);

  const voxelise::SolidVoxels& solid_;
  const OrderSteps& steps_;
  std::array<std::vector<double>, 3> square_of_;  ///< [axis][k]: square of k steps along the axis, in reach
  std::vector<double> above_;                     ///< OrderSteps::above, with reserve for rounding
  double far_;                                    ///< more than any square in reach
  std::vector<Row> rows_;                         ///< [y] of one slice, with the reach around the brick
  std::vector<std::uint8_t> in_rows_;             ///< whether the row holds any square in reach
  std::vector<Row> slices_;                       ///< [z][y], with the reach around the brick along z
  std::vector<std::uint8_t> in_slices_;
};

}  // namespace phantom::layers::detail
