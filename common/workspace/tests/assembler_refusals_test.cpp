#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>

#include "common/workspace/tests/random_workspace.hpp"
#include "common/workspace/workspace_assembler.hpp"

namespace phantom::workspace {
namespace {

TEST(WorkspaceAssembler, RefusesImpossibleInput) {
  const Workspace workspace = random_workspace(5);
  const auto bytes = encode_brick(workspace.brick(workspace.bricks().front()));
  WorkspaceAssembler assembler;
  EXPECT_FALSE(assembler.put_brick({-1, 0, 0}, 1, bytes));
  EXPECT_FALSE(assembler.put_brick({0, 0, 256}, 1, bytes));
  EXPECT_FALSE(assembler.put_brick({0, 0, 0}, 1, std::span(bytes).first(7)));
  EXPECT_EQ(assembler.bricks_held(), 0U);

  const auto refused = [&](auto change) {
    VersionDescription description = describe(workspace);
    change(description);
    return !assembler.commit(description).is_ok();
  };
  EXPECT_TRUE(refused([](auto& d) { d.grid.voxel_size_m = 0; }));
  EXPECT_TRUE(refused([](auto& d) { d.grid.voxel_size_m = std::numeric_limits<double>::quiet_NaN(); }));
  for (const double side_m : {0.0, -0.005, 0.0006, 0.05})
    EXPECT_TRUE(refused([&](auto& d) {
      d.grid.voxel_size_m = VoxelSize(Eigen::Vector3d(0.005, side_m, 0.005));
    })) << side_m;
  EXPECT_TRUE(refused([](auto& d) { d.grid.origin_m.x() = std::numeric_limits<double>::infinity(); }));
  EXPECT_TRUE(refused([](auto& d) { d.grid.size_vox[1] = 0; }));
  EXPECT_TRUE(refused([](auto& d) { d.grid.size_vox[1] = 8193; }));
  EXPECT_TRUE(refused([](auto& d) { d.palette_Pa_s_per_m = {0.0F, 5.0F, 4.0F}; }));
  EXPECT_FALSE(assembler.pending());
}

TEST(WorkspaceAssembler, RefusesCodesThatThePaletteDoesNotHave) {
  Workspace workspace = random_workspace(5);
  Workspace narrow(workspace.grid(), {0.0F, 9.0F});
  for (const BrickKey key : workspace.bricks()) {
    std::memcpy(narrow.edit_brick(key).mu_code, workspace.brick(key).mu_code, kBrickVoxels);
  }
  WorkspaceAssembler assembler;
  for (const BrickKey key : narrow.bricks())
    ASSERT_TRUE(assembler.put_brick(key, narrow.version, encode_brick(narrow.brick(key))));
  ASSERT_TRUE(assembler.commit(describe(narrow)));
  EXPECT_EQ(assembler.current(), nullptr);
}

/// A brick that is full of one thing, as it travels.
std::vector<std::uint8_t> uniform_brick(std::uint8_t code, std::uint16_t object) {
  Workspace workspace({Eigen::Vector3d::Zero(), 0.01, {kBrickEdge, kBrickEdge, kBrickEdge}},
                      {0.0F, 1.0F, 2.0F});
  workspace.fill_brick({0, 0, 0}, code, 1, object);
  return encode_brick(workspace.brick({0, 0, 0}));
}

BrickKey key_number(std::int32_t i) {
  return {i % kMaxBricks, i / kMaxBricks % kMaxBricks, i / (kMaxBricks * kMaxBricks)};
}

TEST(WorkspaceAssembler, BricksThatNoVersionNamesAreBoundedByMemory) {
  constexpr std::size_t kMax = std::size_t{4} << 20;
  WorkspaceAssembler assembler(kMax);
  std::size_t refused = 0;
  const auto bricks = std::array{uniform_brick(1, 1), uniform_brick(2, 1), uniform_brick(1, 2)};
  for (std::int32_t i = 0; i < 30'000; ++i) {
    refused += assembler.put_brick(key_number(i), 1 + i, bricks[i % 3]) ? 0 : 1;
    ASSERT_LE(assembler.bytes(), kMax);
  }
  EXPECT_GT(refused, 0U);
  EXPECT_LT(assembler.bricks_held(), 15'000U);
  for (std::int32_t i = 0; i < 30'000; ++i) assembler.remove_brick(key_number(i));
  EXPECT_EQ(assembler.bytes(), 0U);
  EXPECT_TRUE(assembler.put_brick(key_number(7), 1, bricks[0]));
}

// Tries phantom_sensing: more than 262,144 of them
TEST(WorkspaceAssembler, RefusesAVersionOfMoreBricksThanTheTopicHolds) {
  WorkspaceAssembler assembler;
  VersionDescription description{1, {Eigen::Vector3d::Zero(), 0.01, {64, 64, 64}}, {0.0F, 1.0F}, 0, 0};
  description.brick_count = kMaxBricksInAll + 1;
  EXPECT_FALSE(assembler.commit(description));
}

}  // namespace
}  // namespace phantom::workspace
