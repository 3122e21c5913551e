#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "common/workspace/workspace.hpp"

namespace phantom::test {

inline std::vector<std::uint16_t> objects_of(const workspace::Workspace& workspace, workspace::BrickKey key) {
  std::vector<std::uint16_t> objects(workspace::kBrickVoxels);
  workspace.brick(key).copy_objects(objects.data());
  return objects;
}

/// The same μ, orders and objects everywhere, by whatever codes: those depend on what was there before.
inline void expect_same_content(const workspace::Workspace& a, const workspace::Workspace& b) {
  ASSERT_EQ(a.bricks(), b.bricks());
  for (const workspace::BrickKey key : a.bricks()) {
    const auto brick = a.brick(key), other = b.brick(key);
    bool same = std::memcmp(brick.order, other.order, workspace::kBrickVoxels) == 0;
    for (std::size_t i = 0; i < workspace::kBrickVoxels; ++i)
      same = same && a.palette()[brick.mu_code[i]] == b.palette()[other.mu_code[i]];
    ASSERT_TRUE(same && objects_of(a, key) == objects_of(b, key));
  }
}

}  // namespace phantom::test
