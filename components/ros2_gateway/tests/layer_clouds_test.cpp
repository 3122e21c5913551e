#include "components/ros2_gateway/layer_clouds.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <map>
#include <random>

namespace phantom::ros2_gateway {
namespace {

struct Point {
  float x, y, z;
  std::uint32_t brick;
  std::uint16_t object;
  std::int16_t layer;
};

std::vector<Point> read(const std::vector<std::uint8_t>& octets) {
  std::vector<Point> points;
  for (std::size_t at = 0; at < octets.size(); at += LayerCloud::kPointStep) {
    const auto number = [&](std::size_t offset, auto value) {
      std::copy_n(octets.data() + at + offset, sizeof(value), reinterpret_cast<std::uint8_t*>(&value));
      return value;
    };
    points.push_back({number(0, 0.0F), number(4, 0.0F), number(8, 0.0F), number(12, std::uint32_t{0}),
                      number(16, std::uint16_t{0}), number(18, std::int16_t{0})});
  }
  return points;
}

workspace::Workspace empty_workspace() {
  workspace::GridSpec grid;
  grid.origin_m = {-1.0, 0.5, 0.25};
  grid.voxel_size_m = workspace::VoxelSize(Eigen::Vector3d(0.01, 0.012, 0.02));
  grid.size_vox = {80, 70, 40};
  return workspace::Workspace(grid, {0.0F, 1.0F, 2.0F});
}
void set(workspace::Workspace& to, workspace::Index3 v, std::int8_t order, std::uint16_t object) {
  const auto brick = to.edit_brick(workspace::brick_of(v));
  const std::size_t at = workspace::brick_offset(v);
  brick.order[at] = order;
  brick.object[at] = object;
  brick.mu_code[at] = order == workspace::kOrderFree ? 0 : 1;
}

// The literal twin: each voxel of the grid, one by one.
std::map<std::array<int, 3>, std::uint16_t> voxels_of(const workspace::Workspace& workspace,
                                                      std::int8_t order) {
  std::map<std::array<int, 3>, std::uint16_t> all;
  const auto& size = workspace.grid().size_vox;
  for (int z = 0; z < size[2]; ++z)
    for (int y = 0; y < size[1]; ++y)
      for (int x = 0; x < size[0]; ++x)
        if (workspace.order({x, y, z}) == order) all[{x, y, z}] = workspace.object({x, y, z});
  return all;
}

std::map<std::array<int, 3>, std::uint16_t> voxels_of(
    const std::map<std::uint32_t, std::vector<Point>>& bricks, const workspace::GridSpec& grid) {
  std::map<std::array<int, 3>, std::uint16_t> all;
  for (const auto& [number, points] : bricks)
    for (const Point& p : points) {
      const auto v = grid.index_of(Eigen::Vector3f(p.x, p.y, p.z).cast<double>());
      EXPECT_LT((grid.centre_of(v) - Eigen::Vector3d(p.x, p.y, p.z)).norm(), 1e-6);
      all[{v.x, v.y, v.z}] = p.object;
    }
  return all;
}

/// Does what the README has a reader of the updates do.
void apply_update(const std::vector<Point>& update, std::map<std::uint32_t, std::vector<Point>>& bricks) {
  for (const Point& p : update) bricks.erase(p.brick);
  for (const Point& p : update)
    if (!std::isnan(p.x)) bricks[p.brick].push_back(p);
}

TEST(LayerCloud, AppliedChangeByChangeItIsTheWorkspace) {
  std::mt19937 random(7);
  const auto draw = [&](int least, int most) { return std::uniform_int_distribution(least, most)(random); };
  workspace::Workspace workspace = empty_workspace();
  LayerCloud cloud(workspace::kOrderBoundary);
  std::map<std::uint32_t, std::vector<Point>> bricks;
  for (int version = 0; version < 60; ++version) {
    const workspace::Index3 v{draw(0, 79), draw(0, 69), draw(0, 39)};
    const int orders[] = {workspace::kOrderBoundary, 3, workspace::kOrderFree};
    for (int k = draw(0, 5); k > 0; --k)
      set(workspace, min(v + workspace::Index3{k, 0, 0}, {79, 69, 39}),
          static_cast<std::int8_t>(orders[draw(0, 2)]), 7);
    if (version % 10 == 9)  // a whole brick goes
      for (const auto& [at, object] : voxels_of(workspace, workspace::kOrderBoundary))
        if (at[0] < 32) set(workspace, {at[0], at[1], at[2]}, workspace::kOrderFree, 0);
    apply_update(read(cloud.update(workspace)), bricks);
    const auto expected = voxels_of(workspace, workspace::kOrderBoundary);
    EXPECT_EQ(voxels_of(bricks, workspace.grid()), expected) << version;
    std::map<std::uint32_t, std::vector<Point>> whole;
    apply_update(read(cloud.whole()), whole);
    EXPECT_EQ(voxels_of(whole, workspace.grid()), expected) << version;
    EXPECT_EQ(cloud.points(), expected.size());
  }
}

TEST(LayerCloud, ChangesAreThoseBricksAlone) {
  workspace::Workspace workspace = empty_workspace();
  set(workspace, {1, 2, 3}, workspace::kOrderBoundary, 4);
  set(workspace, {40, 2, 3}, workspace::kOrderBoundary, 5);
  set(workspace, {40, 40, 3}, 2, 5);
  LayerCloud cloud(workspace::kOrderBoundary);
  EXPECT_EQ(read(cloud.update(workspace)).size(), 2u);
  EXPECT_TRUE(cloud.update(workspace).empty());
  set(workspace, {41, 2, 3}, workspace::kOrderBoundary, 5);
  const auto changed = read(cloud.update(workspace));
  ASSERT_EQ(changed.size(), 2u);
  for (const Point& p : changed) {
    EXPECT_EQ(p.brick, 1u);
    EXPECT_EQ(p.object, 5u);
    EXPECT_EQ(p.layer, 100);
  }
  set(workspace, {1, 2, 3}, workspace::kOrderFree, 0);
  const auto gone = read(cloud.update(workspace));
  ASSERT_EQ(gone.size(), 1u);
  EXPECT_TRUE(std::isnan(gone[0].x) && std::isnan(gone[0].y) && std::isnan(gone[0].z));
  EXPECT_EQ(gone[0].brick, 0u);
  // The colour of a voxel is its object's: another object is another point.
  set(workspace, {41, 2, 3}, workspace::kOrderBoundary, 6);
  EXPECT_EQ(read(cloud.update(workspace)).size(), 2u);
  LayerCloud layer(2);
  const auto second = read(layer.update(workspace));
  ASSERT_EQ(second.size(), 1u);
  EXPECT_EQ(second[0].layer, 2);
  EXPECT_FLOAT_EQ(second[0].x, -1.0F + 0.405F);
}

}  // namespace
}  // namespace phantom::ros2_gateway
