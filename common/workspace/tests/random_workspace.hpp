#pragma once

#include <algorithm>
#include <random>

#include "common/workspace/workspace.hpp"
#include "common/workspace/workspace_assembler.hpp"

namespace phantom::workspace {

/// A workspace of 4×3×2 bricks, about half of which hold noise; made backwards if asked. Orders are noise
/// too, in half of the bricks one of two to each code.
inline Workspace random_workspace(unsigned seed, bool backwards = false) {
  Workspace workspace({{-0.5, 0.25, 1.0}, 0.005, {120, 96, 50}}, {0.0F, 9.0F, 20.0F, 100.0F});
  std::vector<BrickKey> keys;
  std::mt19937 random(seed);
  for (std::int32_t z = 0; z < 2; ++z) {
    for (std::int32_t y = 0; y < 3; ++y) {
      for (std::int32_t x = 0; x < 4; ++x) {
        if (random() % 2 == 0) keys.push_back({x, y, z});
      }
    }
  }
  if (backwards) std::reverse(keys.begin(), keys.end());
  for (const BrickKey key : keys) {
    std::mt19937 noise(seed + static_cast<unsigned>(key.x + 10 * key.y + 100 * key.z));
    const bool by_code = noise() % 2 == 0;
    const auto brick = workspace.edit_brick(key);
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      brick.mu_code[i] = static_cast<std::uint8_t>(noise() % 4);
      const std::uint8_t code = brick.mu_code[i];
      brick.order[i] = static_cast<std::int8_t>(code == 0 ? 0
                                                : by_code ? 9 * code + noise() % 2
                                                          : noise() % 100);
      brick.object[i] = static_cast<std::uint16_t>(brick.mu_code[i] == 0 ? 0 : noise());
    }
  }
  workspace.version = seed;
  return workspace;
}

inline VersionDescription describe(const Workspace& workspace) {
  return {workspace.version, workspace.grid(), workspace.palette(),
          static_cast<std::uint32_t>(workspace.brick_count()), workspace.content_hash()};
}

}  // namespace phantom::workspace
