#pragma once

#include <array>
#include <cstdint>

#include "common/workspace/workspace.hpp"

namespace phantom::workspace {

/// Holds the voxels of one brick in brick_offset order.
struct BrickData {
  std::array<std::uint8_t, kBrickVoxels> mu_code;
  std::array<std::int8_t, kBrickVoxels> order;
  std::array<std::uint16_t, kBrickVoxels> object;

  Workspace::BrickView view() const { return {mu_code.data(), order.data(), object.data()}; }
};

/// Summarises a brick's voxels, so that a workspace can store the brick in as little memory as possible.
struct BrickFacts {
  static constexpr std::uint16_t kSeveral = 65535;  ///< is no object's id

  std::uint16_t object = 0;  ///< the object to which every voxel with a μ and no other voxel belongs;
                             ///< kSeveral: there is no such object
  bool uniform = false;      ///< all voxels have one code and one order
  std::uint8_t greatest_code = 0;
  std::uint8_t greatest_fluid_code = 0;  ///< the greatest code among voxels of layers and guard
};
struct BrickContent {
  BrickData voxels;
  BrickFacts facts;
};

/// Computes the facts by reading every voxel.
BrickFacts facts_of(const BrickData& brick);
/// Computes the facts of `count` voxels, or of the kinds of voxel that occur.
BrickFacts facts_of(const std::uint8_t* codes, const std::int8_t* orders, const std::uint16_t* objects,
                    std::size_t count);

}  // namespace phantom::workspace
