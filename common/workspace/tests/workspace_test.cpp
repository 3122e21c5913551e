#include "common/workspace/workspace.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "common/workspace/profile.hpp"
#include "common/workspace/tests/random_workspace.hpp"
#include "common/workspace/workspace_hash.hpp"

namespace phantom::workspace {
namespace {

TEST(BrickOffset, NamesEveryVoxelOnceAndKeepsTilesTogether) {
  std::set<std::size_t> seen;
  for (std::uint32_t z = 0; z < 32; ++z) {
    for (std::uint32_t y = 0; y < 32; ++y) {
      for (std::uint32_t x = 0; x < 32; ++x) {
        const std::size_t offset = brick_offset(x, y, z);
        ASSERT_LT(offset, kBrickVoxels);
        EXPECT_EQ(offset / 64, brick_offset(x & ~3U, y & ~3U, z & ~3U) / 64);  // one tile, one cache line
        seen.insert(offset);
      }
    }
  }
  EXPECT_EQ(seen.size(), kBrickVoxels);
}

TEST(Workspace, IsFreeWhereNothingIs) {
  const Workspace nothing;
  EXPECT_EQ(nothing.mu({0, 0, 0}), 0.0F);
  const Workspace empty({Eigen::Vector3d::Zero(), 0.01, {70, 40, 33}}, {0.0F, 5.0F});
  EXPECT_EQ(empty.size_bricks(), (std::array<std::int32_t, 3>{3, 2, 2}));
  EXPECT_EQ(empty.brick_count(), 0U);
  for (const Index3 v : {Index3{0, 0, 0}, {69, 39, 32}, {70, 0, 0}, {-1, 5, 5}, {0, 0, 1 << 30}}) {
    EXPECT_EQ(empty.mu_code(v), 0);
    EXPECT_EQ(empty.order(v), kOrderFree);
    EXPECT_EQ(empty.object(v), 0);
  }
}

TEST(Workspace, KeepsWhatIsWrittenWhereItIsWritten) {
  Workspace workspace({Eigen::Vector3d::Zero(), 0.01, {70, 40, 33}}, {0.0F, 5.0F, 9.0F});
  const auto brick = workspace.edit_brick({2, 1, 1});
  const std::size_t at = brick_offset(69 - 64, 39 - 32, 0);
  brick.mu_code[at] = 2;
  brick.order[at] = kOrderInterior;
  brick.object[at] = 7;
  EXPECT_EQ(workspace.mu({69, 39, 32}), 9.0F);
  EXPECT_EQ(workspace.order({69, 39, 32}), kOrderInterior);
  EXPECT_EQ(workspace.object({69, 39, 32}), 7);
  EXPECT_EQ(workspace.mu_code({68, 39, 32}), 0);
  EXPECT_EQ(workspace.bricks(), (std::vector<BrickKey>{{2, 1, 1}}));
  EXPECT_EQ(
      workspace.codes()[workspace.directory()[workspace.directory_index({2, 1, 1})] * kBrickVoxels + at], 2);
}

TEST(Workspace, ForgetsRemovedBricksAndReusesTheirRoom) {
  Workspace workspace({Eigen::Vector3d::Zero(), 0.01, {128, 32, 32}}, {0.0F, 5.0F});
  workspace.edit_brick({0, 0, 0}).mu_code[5] = 1;
  workspace.edit_brick({1, 0, 0}).mu_code[5] = 1;
  const std::size_t bytes = workspace.bytes();
  workspace.remove_brick({0, 0, 0});
  EXPECT_FALSE(workspace.has_brick({0, 0, 0}));
  EXPECT_EQ(workspace.brick_count(), 1U);
  EXPECT_EQ(workspace.edit_brick({3, 0, 0}).mu_code[5], 0);
  EXPECT_EQ(workspace.bytes(), bytes);
  EXPECT_EQ(workspace.brick_count(), 2U);
}

TEST(Workspace, BricksOfOneObjectAndBricksOfOneValueReadLikeAnyOther) {
  const GridSpec grid{{}, 0.01, {96, 32, 32}};
  Workspace plain(grid, {0.0F, 5.0F, 9.0F}), lean = plain;
  for (const BrickKey key : {BrickKey{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}) {
    const auto to = plain.edit_brick(key);
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      const bool there = key.x != 0 || i % 3 == 0;
      to.mu_code[i] = there ? 2 : 0;
      to.order[i] = there ? kOrderInterior : kOrderFree;
      to.object[i] = there ? 7 : 0;
    }
  }
  const auto orders = std::make_shared<std::int8_t[]>(kBrickVoxels);
  std::uint8_t* const codes = lean.make_brick({0, 0, 0}, {orders, nullptr, 7});
  EXPECT_EQ(lean.brick({0, 0, 0}).object, nullptr);
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    codes[i] = i % 3 == 0 ? 2 : 0;
    orders[static_cast<std::ptrdiff_t>(i)] = i % 3 == 0 ? kOrderInterior : kOrderFree;
  }
  const std::size_t before = lean.bytes();
  lean.fill_brick({1, 0, 0}, 2, kOrderInterior, 7);
  const std::size_t one_more = lean.bytes();
  EXPECT_GT(one_more, before);
  lean.fill_brick({2, 0, 0}, 2, kOrderInterior, 7);
  EXPECT_EQ(lean.bytes(), one_more);  // shared
  EXPECT_LT(2 * lean.bytes(), plain.bytes());
  EXPECT_EQ(lean.content_hash(), plain.content_hash());
  EXPECT_EQ(lean.bricks(), plain.bricks());
  for (int x = 0; x < 96; ++x) EXPECT_EQ(lean.object({x, 5, 6}), plain.object({x, 5, 6}));
  // To write into one of them leaves its twin alone.
  lean.edit_brick({1, 0, 0}).object[3] = 8;
  plain.edit_brick({1, 0, 0}).object[3] = 8;
  lean.edit_brick({0, 0, 0}).mu_code[0] = 1;
  plain.edit_brick({0, 0, 0}).mu_code[0] = 1;
  EXPECT_EQ(lean.content_hash(), plain.content_hash());
  lean.remove_brick({1, 0, 0});
  plain.remove_brick({1, 0, 0});
  lean.fill_brick({0, 0, 0}, 1, 3, 9);
  EXPECT_EQ(lean.object({31, 31, 31}), 9);
  plain.remove_brick({0, 0, 0});
  lean.remove_brick({0, 0, 0});
  EXPECT_EQ(lean.content_hash(), plain.content_hash());
  EXPECT_EQ(lean.brick_count(), 1U);
}

TEST(Workspace, SharedOrdersStayAsTheyAreWhateverIsWritten) {
  const std::shared_ptr<std::int8_t[]> orders(new std::int8_t[kBrickVoxels]);
  std::fill_n(orders.get(), kBrickVoxels, std::int8_t{3});
  Workspace one({Eigen::Vector3d::Zero(), 0.01, {64, 32, 32}}, {0.0F, 5.0F});
  std::fill_n(one.make_brick({1, 0, 0}, {orders, nullptr, 7}), kBrickVoxels, std::uint8_t{1});
  EXPECT_EQ(one.brick({1, 0, 0}).order, orders.get());
  Workspace other = one;
  EXPECT_EQ(other.content_hash(), one.content_hash());
  one.edit_brick({1, 0, 0}).order[0] = 4;
  EXPECT_EQ(one.order({32, 0, 0}), 4);
  EXPECT_EQ(one.object({32, 0, 0}), 7);
  EXPECT_EQ(orders[0], 3);
  Workspace twin = one;  // shares orders that were one's own
  twin.edit_brick({1, 0, 0}).order[0] = 5;
  EXPECT_EQ(one.order({32, 0, 0}), 4);
  EXPECT_EQ(other.order({32, 0, 0}), 3);
}

TEST(Grid, HasASizeForEachAxis) {
  const GridSpec grid{{-0.5, 0.25, 1.0}, VoxelSize(Eigen::Vector3d(0.004, 0.01, 0.008)), {100, 50, 25}};
  EXPECT_EQ(grid.index_of({-0.4999, 0.25, 1.0079}), (Index3{0, 0, 0}));
  EXPECT_EQ(grid.index_of({-0.4959, 0.2599, 1.0081}), (Index3{1, 0, 1}));
  EXPECT_EQ(grid.index_of({-0.5041, 0.2499, 0.9999}), (Index3{-2, -1, -1}));
  EXPECT_TRUE(grid.centre_of({3, 2, 1}).isApprox(Eigen::Vector3d(-0.486, 0.275, 1.012), 1e-12));
  EXPECT_TRUE(grid.extent_m().isApprox(Eigen::Vector3d(0.4, 0.5, 0.2), 1e-12));
  EXPECT_EQ(grid.voxel_size_m.reference_m(), 0.004);
  EXPECT_EQ(grid.voxel_size_m.stretch(), Eigen::Vector3d(1.0, 2.5, 2.0));
  EXPECT_FALSE(grid.voxel_size_m.is_cube());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-1.0, 2.0);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d p_m(place(random), place(random), place(random));
    const Index3 v = grid.index_of(p_m);
    EXPECT_TRUE(
        ((p_m - grid.centre_of(v)).cwiseAbs().array() <= (0.5 + 1e-9) * grid.voxel_size_m.sides_m().array())
            .all());
  }
  const VoxelSize cube = 0.003;
  EXPECT_EQ(cube.stretch(), Eigen::Vector3d::Ones());
  EXPECT_TRUE(cube.is_cube());
}

TEST(Grid, SaysWhatAVoxelsSizeMayBe) {
  const auto problem = [](double x, double y, double z) {
    return check_voxel_size(VoxelSize(Eigen::Vector3d(x, y, z))).message();
  };
  EXPECT_EQ(problem(0.8, 0.1, 0.1), "");
  EXPECT_EQ(problem(0.1, -0.1, 0.1), "is not above 0");
  EXPECT_EQ(problem(0.1, 0.1, 0.0), "is not above 0");
  EXPECT_EQ(problem(0.1, 0.9, 0.1), "is 9 times as long along y as along x; allowed: at most 8 times");
}

TEST(Workspace, HashOfCubesIsWhatItWasBeforeThereWereOthers) {
  const GridSpec cubes{{-0.5, 0.25, 1.0}, 0.005, {120, 96, 50}};
  EXPECT_EQ(header_hash(cubes, {0, 9, 20, 100}), 0xfe180e4741cb9811U);
  std::set<std::uint64_t> hashes{header_hash(cubes, {0, 9, 20, 100})};
  for (const Eigen::Vector3d& sides_m :
       {Eigen::Vector3d(0.005, 0.005, 0.01), Eigen::Vector3d(0.005, 0.01, 0.005),
        Eigen::Vector3d(0.01, 0.005, 0.005), Eigen::Vector3d(0.005, 0.01, 0.01)}) {
    GridSpec other = cubes;
    other.voxel_size_m = VoxelSize(sides_m);
    EXPECT_TRUE(hashes.insert(header_hash(other, {0, 9, 20, 100})).second);
  }
}

TEST(Workspace, HashTellsContentNotHistory) {
  const Workspace one = random_workspace(1, false);
  const Workspace backwards = random_workspace(1, true);
  EXPECT_EQ(one.content_hash(), backwards.content_hash());
  Workspace changed = one;
  const BrickKey key = changed.bricks().front();
  changed.edit_brick(key).object[17] ^= 1;
  EXPECT_NE(changed.content_hash(), one.content_hash());
  changed.edit_brick(key).object[17] ^= 1;
  EXPECT_EQ(changed.content_hash(), one.content_hash());
  changed.remove_brick(key);
  EXPECT_NE(changed.content_hash(), one.content_hash());
  GridSpec moved = one.grid();
  moved.origin_m.x() += 1e-3;
  EXPECT_NE(Workspace(moved, one.palette()).content_hash(),
            Workspace(one.grid(), one.palette()).content_hash());
}

TEST(Workspace, HashTellsWhereABrickIs) {
  Workspace here({Eigen::Vector3d::Zero(), 0.01, {64, 32, 32}}, {0.0F, 5.0F}), there = here;
  here.edit_brick({0, 0, 0}).mu_code[3] = 1;
  there.edit_brick({1, 0, 0}).mu_code[3] = 1;
  EXPECT_NE(here.content_hash(), there.content_hash());
}

TEST(Palette, MustRiseFromZero) {
  EXPECT_TRUE(check_palette({0.0F}));
  EXPECT_TRUE(check_palette({0.0F, 1.0F, 2.0F}));
  EXPECT_FALSE(check_palette({}));
  EXPECT_FALSE(check_palette({1.0F, 2.0F}));
  EXPECT_FALSE(check_palette({0.0F, 2.0F, 2.0F}));
  EXPECT_FALSE(check_palette({0.0F, std::numeric_limits<float>::quiet_NaN()}));
  EXPECT_FALSE(check_palette({0.0F, std::numeric_limits<float>::infinity()}));
  EXPECT_FALSE(check_palette(std::vector<float>(257)));
  EXPECT_THROW(Workspace({Eigen::Vector3d::Zero(), 0.01, {32, 32, 32}}, {2.0F}), std::invalid_argument);
}

std::vector<LayerProfile> one_layer_each(const std::vector<float>& mu) {
  std::vector<LayerProfile> profiles;
  for (const float value : mu) profiles.push_back({{1}, {value}, value, 0});
  return profiles;
}

/// Profiles come and go at random. The palette always has every μ of those that are there; codes stay unless
/// it says otherwise, which it does only where there was no room between two others.
TEST(Palette, KeepsCodesThroughAnySequenceOfProfiles) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> exponent(-6, 6);
    const std::size_t most = seed % 2 == 0 ? 8 : 120;
    std::vector<float> palette{0.0F}, mu;
    std::size_t kept = 0, anew = 0;
    for (int step = 0; step < 300; ++step) {
      if (mu.empty() || (mu.size() < most && random() % 2 == 0)) {
        const std::size_t count = 1 + random() % 3;
        for (std::size_t i = 0; i < count; ++i) mu.push_back(std::pow(10.0F, exponent(random)));
      } else {
        mu.erase(mu.begin() + static_cast<std::ptrdiff_t>(random() % mu.size()));
      }
      const auto next = next_palette(one_layer_each(mu), palette);
      ASSERT_TRUE(next);
      ASSERT_TRUE(check_palette(next->mu_Pa_s_per_m));
      const std::vector<float> sought = *make_palette(one_layer_each(mu));
      ASSERT_TRUE(std::ranges::includes(next->mu_Pa_s_per_m, sought));
      const auto code_in = [](const std::vector<float>& codes, float value) {
        return std::ranges::find(codes, value) - codes.begin();
      };
      for (const float value : sought) {
        const bool was_there = std::ranges::count(palette, value) > 0;
        if (was_there && next->keeps_codes) {
          ASSERT_EQ(code_in(palette, value), code_in(next->mu_Pa_s_per_m, value));
        }
      }
      ++(next->keeps_codes ? kept : anew);
      palette = next->mu_Pa_s_per_m;
    }
    EXPECT_GT(kept, 5 * anew) << "seed " << seed;
  }
}

TEST(Palette, OfAFewViscositiesStaysWhereSensingIsFastest) {
  std::vector<float> mu;
  for (int i = 1; i <= 15; ++i) {
    mu.push_back(static_cast<float>(i));
    const auto next = next_palette(one_layer_each(mu), {0.0F});
    ASSERT_TRUE(next);
    EXPECT_LE(next->mu_Pa_s_per_m.size(), 32U);
    EXPECT_GE(next->mu_Pa_s_per_m.size(), 2U * mu.size()) << "there is a free code beside each";
  }
}

TEST(Palette, OfAllCodesOrOfNeighbouringFloatsHasNoFreeOnes) {
  std::vector<float> mu;
  for (int i = 1; i <= 255; ++i) mu.push_back(static_cast<float>(i));
  const auto full = next_palette(one_layer_each(mu), {0.0F});
  ASSERT_TRUE(full);
  EXPECT_EQ(full->mu_Pa_s_per_m, make_palette(one_layer_each(mu)).value());
  mu.push_back(256.0F);
  EXPECT_FALSE(next_palette(one_layer_each(mu), full->mu_Pa_s_per_m));
  const std::vector<float> close{1.0F, std::nextafter(1.0F, 2.0F), 3.0F};
  const auto tight = next_palette(one_layer_each(close), {0.0F});
  ASSERT_TRUE(tight);
  EXPECT_FALSE(tight->keeps_codes);
  EXPECT_EQ(tight->mu_Pa_s_per_m, make_palette(one_layer_each(close)).value());
}

}  // namespace
}  // namespace phantom::workspace
