#pragma once

#include <array>
#include <cstdint>

#include "common/workspace/workspace.hpp"

namespace phantom::workspace {

/// One brick on its own, in brick_offset order.
struct BrickData {
  std::array<std::uint8_t, kBrickVoxels> mu_code;
  std::array<std::int8_t, kBrickVoxels> order;
  std::array<std::uint16_t, kBrickVoxels> object;

  Workspace::BrickView view() const { return {mu_code.data(), order.data(), object.data()}; }
};

/// What a workspace must know of a brick to keep it in as little memory as it needs.
struct BrickFacts {
  static constexpr std::uint16_t kSeveral = 65535;  ///< no object's id

  std::uint16_t object = 0;  ///< that every voxel with a μ belongs to, and no other voxel; kSeveral: there is
                             ///< no such object
  bool uniform = false;  ///< all voxels have one code and one order
  std::uint8_t greatest_code = 0;
  std::uint8_t greatest_fluid_code = 0;  ///< of the voxels of layers and guard
};
struct BrickContent {
  BrickData voxels;
  BrickFacts facts;
};

/// The facts, found by looking at every voxel.
BrickFacts facts_of(const BrickData& brick);

}  // namespace phantom::workspace
