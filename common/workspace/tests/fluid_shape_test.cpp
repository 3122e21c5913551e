// What people see of the fluid, against slow literal twins on noise, and on a box whose shells are known.
#include "common/workspace/fluid_shape.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <random>
#include <set>
#include <vector>

namespace phantom::workspace {
namespace {

constexpr std::size_t kMany = 1'000'000;

/// Noise of three objects in most bricks; the last brick along x reaches beyond the grid.
Workspace noise_of(unsigned seed) {
  Workspace workspace({{-0.5, 0.25, 1.0}, 0.005, {70, 40, 33}}, {0.0F, 9.0F, 20.0F, 100.0F});
  const std::array<std::int8_t, 9> orders{kOrderFree,     kOrderFree,    1, 2, 3, -1, kOrderGuard,
                                          kOrderBoundary, kOrderInterior};
  std::mt19937 random(seed);
  VoxelBox{{}, workspace.size_bricks()}.for_each([&](Index3 at) {
    if (random() % 4 == 0) return;
    const auto brick = workspace.edit_brick(BrickKey{at});
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      brick.order[i] = orders[random() % orders.size()];
      const bool free = brick.order[i] == kOrderFree;
      brick.mu_code[i] = static_cast<std::uint8_t>(free ? 0 : 1 + random() % 3);
      brick.object[i] = static_cast<std::uint16_t>(free ? 0 : 5 + random() % 3);
    }
  });
  return workspace;
}

bool is_of(const Workspace& workspace, Index3 v, std::uint16_t object) {
  return workspace.order(v) != kOrderFree && (object == kEveryObject || workspace.object(v) == object);
}

/// A face of one voxel: where, and which way it is turned.
using Face = std::array<std::int32_t, 4>;

/// The faces between voxels of the shell and others, one by one.
std::set<Face> literal_faces(const Workspace& workspace, const VoxelBox& box, std::uint16_t object,
                             std::int8_t order) {
  const auto in_shell = [&](Index3 v) {
    return box.contains(v) && is_of(workspace, v, object) && depth_of(workspace.order(v)) >= depth_of(order);
  };
  std::set<Face> faces;
  box.for_each([&](Index3 v) {
    if (!in_shell(v)) return;
    for (std::int32_t axis = 0; axis < 3; ++axis) {
      Index3 step;
      step[static_cast<std::size_t>(axis)] = 1;
      if (!in_shell(v + step)) faces.insert({(v + step).x, (v + step).y, (v + step).z, 2 * axis});
      if (!in_shell(v - step)) faces.insert({v.x, v.y, v.z, 2 * axis + 1});
    }
  });
  return faces;
}

/// The same of rectangles; fails if two have one face.
std::set<Face> faces_of(const std::vector<ShellFace>& rectangles, std::int8_t order) {
  std::set<Face> faces;
  for (const ShellFace& one : rectangles) {
    EXPECT_EQ(one.order, order);
    const std::size_t axis = one.side / 2U;
    for (std::int32_t u = 0; u < one.size[0]; ++u) {
      for (std::int32_t v = 0; v < one.size[1]; ++v) {
        Index3 at{one.corner[0], one.corner[1], one.corner[2]};
        at[(axis + 1) % 3] += u;
        at[(axis + 2) % 3] += v;
        EXPECT_TRUE(faces.insert({at.x, at.y, at.z, one.side}).second) << "a face lies in two rectangles";
      }
    }
  }
  return faces;
}

TEST(FluidShape, EveryFaceOfAShellLiesInOneRectangle) {
  for (const unsigned seed : {1U, 2U}) {
    const Workspace workspace = noise_of(seed);
    const VoxelBox whole = VoxelBox::of(workspace.grid()), part{{20, 3, 5}, {37, 30, 28}};
    for (const auto& [box, object, order] :
         std::initializer_list<std::tuple<VoxelBox, int, int>>{{whole, kEveryObject, 3},
                                                               {whole, 6, 2},
                                                               {part, 5, kOrderBoundary},
                                                               {part, 7, -1},
                                                               {part, 6, kOrderGuard}}) {
      const auto id = static_cast<std::uint16_t>(object);
      const auto of = static_cast<std::int8_t>(order);
      const auto shell = shell_of(workspace, box, id, of, kMany);
      ASSERT_TRUE(shell);
      const std::set<Face> expected = literal_faces(workspace, box, id, of);
      EXPECT_GT(expected.size(), 1000U);
      EXPECT_EQ(faces_of(*shell, of), expected) << "object " << object << ", order " << order;
      EXPECT_LT(shell->size(), expected.size()) << "faces that lie side by side are joined";
    }
  }
}

TEST(FluidShape, ASectionIsWhatTheVoxelsAre) {
  const Workspace workspace = noise_of(3);
  const VoxelBox box{{10, 2, 1}, {60, 38, 32}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t along = (axis + 1) % 3, across = (axis + 2) % 3;
    for (const std::uint16_t object : {kEveryObject, std::uint16_t{6}}) {
      for (std::int32_t at = box.min[axis] - 1; at <= box.end()[axis]; ++at) {
        const std::vector<std::int8_t> orders = section_of(workspace, box, object, axis, at);
        ASSERT_EQ(orders.size(),
                  static_cast<std::size_t>(box.size[along]) * static_cast<std::size_t>(box.size[across]));
        std::size_t cell = 0;
        Index3 v;
        v[axis] = at;
        for (std::int32_t j = 0; j < box.size[across]; ++j) {
          for (std::int32_t i = 0; i < box.size[along]; ++i, ++cell) {
            v[along] = box.min[along] + i;
            v[across] = box.min[across] + j;
            ASSERT_EQ(orders[cell], is_of(workspace, v, object) ? workspace.order(v) : kOrderFree)
                << v.x << ' ' << v.y << ' ' << v.z;
          }
        }
      }
    }
  }
  for (const std::int32_t outside : {-1, 33, 1 << 20})
    EXPECT_EQ(std::ranges::count(section_of(workspace, box, kEveryObject, 2, outside), kOrderFree), 60 * 38);
}

TEST(FluidShape, TheFluidsAreThoseThatTheVoxelsHave) {
  const Workspace workspace = noise_of(4);
  std::map<std::uint16_t, ObjectFluid> expected;
  VoxelBox::of(workspace.grid()).for_each([&](Index3 v) {
    if (workspace.order(v) == kOrderFree) return;
    ObjectFluid& fluid = expected[workspace.object(v)];
    fluid.box = fluid.box.hull({v, {1, 1, 1}});
    std::uint8_t& code = fluid.mu_code[workspace.order(v)];
    code = std::max(code, workspace.mu_code(v));
  });
  const std::vector<ObjectFluid> found = fluids_of(workspace);
  ASSERT_EQ(found.size(), expected.size());
  for (const ObjectFluid& fluid : found) {
    ASSERT_TRUE(expected.contains(fluid.object));
    EXPECT_EQ(fluid.box.min, expected[fluid.object].box.min);
    EXPECT_EQ(fluid.box.size, expected[fluid.object].box.size);
    EXPECT_EQ(fluid.mu_code, expected[fluid.object].mu_code);
  }
  EXPECT_TRUE(fluids_of(Workspace({{0, 0, 0}, 0.01, {40, 40, 40}}, {0.0F, 1.0F})).empty());
}

// A box of 10 × 8 × 6 voxels with three layers of 2, by the distance along the axes: each shell is a box.
TEST(FluidShape, TheShellsOfABoxAreBoxes) {
  Workspace workspace({{0, 0, 0}, 0.01, {64, 64, 64}}, {0.0F, 9.0F, 20.0F, 32.0F, 100.0F});
  const VoxelBox solid{{28, 29, 30}, {10, 8, 6}};
  solid.grown(6).for_each([&](Index3 v) {
    std::int32_t away = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      away = std::max({away, solid.min[axis] - v[axis], v[axis] - solid.end()[axis] + 1});
    const auto layer = static_cast<std::int8_t>((away + 1) / 2);
    const auto brick = workspace.edit_brick(brick_of(v));
    brick.order[brick_offset(v)] = layer == 0 ? kOrderBoundary : layer;
    brick.mu_code[brick_offset(v)] = static_cast<std::uint8_t>(4 - layer);
    brick.object[brick_offset(v)] = 3;
  });
  const std::vector<ObjectFluid> fluids = fluids_of(workspace);
  ASSERT_EQ(fluids.size(), 1U);
  EXPECT_EQ(fluids[0].box.min, solid.grown(6).min);
  EXPECT_EQ(fluids[0].mu_code, (std::map<std::int8_t, std::uint8_t>{{1, 3}, {2, 2}, {3, 1}, {100, 4}}));
  for (const int layer : {0, 1, 2, 3}) {
    const auto order = static_cast<std::int8_t>(layer == 0 ? kOrderBoundary : layer);
    const auto shell = shell_of(workspace, fluids[0].box, 3, order, kMany);
    ASSERT_TRUE(shell);
    EXPECT_EQ(shell->size(), 6U) << "one rectangle a side";
    const int x = 10 + 4 * layer, y = 8 + 4 * layer, z = 6 + 4 * layer;
    EXPECT_EQ(faces_of(*shell, order).size(), static_cast<std::size_t>(2 * (x * y + y * z + z * x)));
  }
  const auto refused = shell_of(workspace, fluids[0].box, 3, 1, 5);
  EXPECT_EQ(refused.status().code(), core::ErrorCode::kResourceExhausted);
  EXPECT_TRUE(shell_of(workspace, fluids[0].box, 3, 1, 6));
  EXPECT_TRUE(shell_of(workspace, fluids[0].box, 4, 1, kMany)->empty()) << "of an object that is not there";
}

TEST(FluidShape, DepthRisesOnTheWayIn) {
  const std::vector<std::int8_t> inwards{kOrderFree,     98, 2,  1,   kOrderGuard,
                                         kOrderBoundary, -1, -2, -98, kOrderInterior};
  for (std::size_t i = 1; i < inwards.size(); ++i) EXPECT_LT(depth_of(inwards[i - 1]), depth_of(inwards[i]));
}

}  // namespace
}  // namespace phantom::workspace
