#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/fusion/fusion.hpp"

namespace phantom::fusion {

/// How long ago the cameras saw each part of a grid. The grid is divided into equal cubes; the last ones may
/// reach beyond it.
struct SpaceAges {
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  std::int32_t cube_vox = 0;   ///< edge of a cube in voxels
  workspace::VoxelBox cubes;   ///< all cubes, counted from 0
  std::vector<double> ages_s;  ///< by cubes.index(); kNever: never seen
};

/// Returns the ages at `now_s`, by the clock of the images. A cube has the age within which a quarter of its
/// blocks was seen: the rest may be inside of an object, or behind one. Its edge is 32 voxels; it is doubled
/// until there are at most `max_cubes`, which must be 1 or more. `left_out`: blocks that do not count, by
/// their place in blocks_of(): the arm's own place, say. A cube in which none counts has age 0; empty: all
/// count.
SpaceAges space_ages(const Fusion& fusion, double now_s, std::size_t max_cubes,
                     std::span<const std::uint8_t> left_out = {});

}  // namespace phantom::fusion
