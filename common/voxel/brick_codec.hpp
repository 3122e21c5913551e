#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/status.hpp"
#include "common/voxel/workspace.hpp"

namespace phantom::voxel {

/// One brick on its own, in brick_offset order.
struct BrickData {
  std::array<std::uint8_t, kBrickVoxels> mu_code;
  std::array<std::int8_t, kBrickVoxels> order;
  std::array<std::uint16_t, kBrickVoxels> object;

  Workspace::BrickView view() const { return {mu_code.data(), order.data(), object.data()}; }
};

/// Bytes of the topic workspace_brick: zstd (with checksum) of the μ codes, the orders and the object ids
/// (little endian), each kBrickVoxels long. Not real-time safe.
std::vector<std::uint8_t> encode_brick(const Workspace::BrickView& brick);

/// Back from encode_brick(). Refuses anything that is not exactly one brick, in bounded memory. Not real-time
/// safe.
core::Status decode_brick(std::span<const std::uint8_t> bytes, BrickData& brick);

}  // namespace phantom::voxel
