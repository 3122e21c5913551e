#include "common/layers/layers.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/layers/merge.hpp"
#include "common/voxelise/tests/literal_twins.hpp"
#include "common/voxelise/tests/random_solid.hpp"

namespace phantom::layers {
namespace {

const workspace::VoxelBox kBox{{0, 0, 0}, {100, 90, 96}};

/// Every voxel of `part`, and nothing beyond it.
void expect_like_the_twin(const voxelise::SolidVoxels& solid, const workspace::LayerProfile& profile,
                          const workspace::VoxelBox& part = kBox, int threads = 1,
                          const workspace::VoxelSize& size = 1.0) {
  ASSERT_TRUE(workspace::check_profile(profile)) << workspace::check_profile(profile).message();
  const workspace::ObjectBricks bricks = distance_bricks(solid, profile, part, {threads, {}}, size.stretch());
  const auto solids = voxelise::twin::solid_voxels(solid);
  const workspace::VoxelBox reached = solid.box.grown(profile.reach_vox() + 1).intersection(part);
  std::size_t there = 0;
  voxelise::twin::for_each(reached, [&](workspace::Index3 v) {
    const std::int8_t order = bricks.at(v);
    ASSERT_EQ(order, voxelise::twin::order(solid, solids, profile, v, size))
        << v.x << ' ' << v.y << ' ' << v.z;
    there += order != workspace::kOrderFree ? 1 : 0;
  });
  std::size_t in_all = 0;
  for (const workspace::BrickKey key : bricks.keys()) {
    const auto taken = static_cast<std::size_t>(
        std::count_if(bricks.orders(key), bricks.orders(key) + workspace::kBrickVoxels,
                      [](std::int8_t order) { return order != workspace::kOrderFree; }));
    EXPECT_GT(taken, 0U) << "an empty brick";
    in_all += taken;
  }
  EXPECT_EQ(in_all, there);
}

std::vector<workspace::LayerProfile> many_profiles() {
  return {{{1}, {5.0F}, 100.0F, 0},
          {{1, 1, 1}, {9.0F, 8.0F, 7.0F}, 100.0F, 0},
          {{4, 4, 4}, {9.0F, 8.0F, 7.0F}, 100.0F, 0},
          {{2, 3, 1}, {9.0F, 8.0F, 7.0F}, 100.0F, 2},
          {{1, 5}, {9.0F, 8.0F}, 100.0F, 1},
          {{20, 13}, {9.0F, 8.0F}, 100.0F, 0}};
}

TEST(DistanceBricks, EqualTheLiteralTwinInEveryVoxel) {
  unsigned seed = 1;
  for (const auto& profile : many_profiles()) {
    expect_like_the_twin(voxelise::scattered_solid(seed++, {7, 5, 6}, 20), profile);
    expect_like_the_twin(voxelise::scattered_solid(seed++, {9, 9, 9}, 200), profile);
    expect_like_the_twin(voxelise::scattered_solid(seed++, {70, 3, 2}, 30), profile);
    expect_like_the_twin(voxelise::scattered_solid(seed++, {1, 1, 1}, 1), profile);
  }
}

TEST(DistanceBricks, EqualTheLiteralTwinInSolidsThatAreLongAlongEachAxis) {
  const workspace::LayerProfile profile{{2, 2}, {9.0F, 8.0F}, 100.0F, 1};
  unsigned seed = 1;
  for (const std::array<std::int32_t, 3> size :
       {std::array{1200, 3, 2}, std::array{3, 1200, 2}, std::array{2, 3, 1200}})
    expect_like_the_twin(voxelise::scattered_solid(seed++, size, 60), profile,
                         {{0, 0, 0}, {1280, 1280, 1280}});
}

std::vector<workspace::VoxelSize> sizes_of_no_cubes() {
  std::vector<workspace::VoxelSize> sizes;
  for (const Eigen::Vector3d& sides_m :
       {Eigen::Vector3d(0.004, 0.004, 0.008), Eigen::Vector3d(0.006, 0.004, 0.004),
        Eigen::Vector3d(0.003, 0.0071, 0.005), Eigen::Vector3d(0.001, 0.008, 0.0013)})
    sizes.emplace_back(sides_m);
  return sizes;
}

TEST(DistanceBricks, EqualTheLiteralTwinInMetresWhereVoxelsAreNoCubes) {
  unsigned seed = 40;
  for (const workspace::VoxelSize& size : sizes_of_no_cubes()) {
    SCOPED_TRACE(testing::Message() << size.sides_m().transpose());
    for (const auto& profile : many_profiles()) {
      expect_like_the_twin(voxelise::scattered_solid(seed++, {7, 5, 6}, 20), profile, kBox, 1, size);
      expect_like_the_twin(voxelise::scattered_solid(seed++, {9, 9, 9}, 200), profile, kBox, 2, size);
      expect_like_the_twin(voxelise::scattered_solid(seed++, {70, 3, 2}, 30), profile, kBox, 1, size);
      expect_like_the_twin(voxelise::scattered_solid(seed++, {40, 40, 30}, 3000, {-20, 60, 80}), profile,
                           kBox, 2, size);
    }
  }
}

TEST(DistanceBricks, OfVoxelsThatAreAlmostCubesAreThoseOfCubes) {
  // The two ways to compute them have nothing in common but this.
  const Eigen::Vector3d almost(1.0, 1.0 + 1e-13, 1.0);
  const auto compare = [&](const voxelise::SolidVoxels& solid, const workspace::LayerProfile& profile) {
    const workspace::ObjectBricks cubes = distance_bricks(solid, profile, kBox, {2, {}});
    const workspace::ObjectBricks others = distance_bricks(solid, profile, kBox, {2, {}}, almost);
    ASSERT_EQ(cubes.keys(), others.keys());
    EXPECT_GT(cubes.keys().size(), 3U);
    voxelise::twin::for_each(kBox, [&](workspace::Index3 v) { ASSERT_EQ(cubes.at(v), others.at(v)); });
  };
  unsigned seed = 70;
  for (const auto& profile : many_profiles())
    compare(voxelise::scattered_solid(seed++, {60, 50, 40}, 800), profile);
  compare(voxelise::walled_block(), {{3, 2}, {9.0F, 8.0F}, 100.0F, 1});
}

TEST(DistanceBricks, AreTheSameWithEveryInstructionSet) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    SCOPED_TRACE(hwy::TargetName(target));
    unsigned seed = 1;
    for (const auto& profile : many_profiles())
      expect_like_the_twin(voxelise::scattered_solid(seed++, {40, 5, 6}, 50), profile);
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST(DistanceBricks, AreTheSameWithManyThreads) {
  const workspace::LayerProfile profile{{3, 2}, {9.0F, 8.0F}, 100.0F, 1};
  expect_like_the_twin(voxelise::scattered_solid(3, {60, 30, 40}, 2000), profile, kBox, 3);
}

TEST(DistanceBricks, ReachFarWithoutOverflow) {
  voxelise::SolidVoxels dot = voxelise::scattered_solid(1, {1, 1, 1}, 1);
  dot.box.min = {290, 270, 300};
  const workspace::LayerProfile widest{{250, 4}, {2.0F, 1.0F}, 100.0F, 0};
  ASSERT_TRUE(workspace::check_profile(widest));
  const workspace::VoxelBox part{{0, 0, 0}, {600, 580, 600}};
  const workspace::ObjectBricks bricks = distance_bricks(dot, widest, part, {2, {}});
  const auto solids = voxelise::twin::solid_voxels(dot);
  const auto expect_at = [&](workspace::Index3 v) {
    ASSERT_EQ(bricks.at(v), voxelise::twin::order(dot, solids, widest, v));
  };
  std::mt19937 random(5);
  for (int i = 0; i < 300000; ++i) {
    expect_at({static_cast<int>(random() % 600), static_cast<int>(random() % 580),
               static_cast<int>(random() % 600)});
  }
  for (int i = 0; i < 600; ++i)
    expect_at({i, 270, 300}), expect_at({290, std::min(i, 579), 300}), expect_at({290, 270, i});
}

TEST(DistanceBricks, OfAPartOfTheGridAreThoseOfTheWhole) {
  const workspace::LayerProfile profile{{3, 2}, {9.0F, 8.0F}, 100.0F, 1};
  voxelise::SolidVoxels solid = voxelise::scattered_solid(9, {40, 40, 40}, 400);
  const workspace::ObjectBricks whole = distance_bricks(solid, profile, kBox);
  for (const workspace::VoxelBox part :
       {workspace::VoxelBox{{32, 0, 32}, {32, 64, 64}}, workspace::VoxelBox{{0, 32, 0}, {96, 32, 96}}}) {
    const workspace::ObjectBricks bricks = distance_bricks(solid, profile, part);
    voxelise::twin::for_each(part, [&](workspace::Index3 v) { ASSERT_EQ(bricks.at(v), whole.at(v)); });
    for (const workspace::BrickKey key : bricks.keys())
      EXPECT_FALSE(workspace::box_of(key).intersection(part).empty());
  }
}

TEST(DistanceBricks, OfASolidBeyondTheGridReachIn) {
  voxelise::SolidVoxels solid = voxelise::scattered_solid(11, {30, 20, 20}, 50);
  for (const workspace::Index3 corner :
       {workspace::Index3{-32, -10, 40}, {95, 80, 90}, {-15, 85, -21}, {102, 30, 30}}) {
    solid.box.min = corner;
    expect_like_the_twin(solid, {{4, 4}, {9.0F, 8.0F}, 100.0F, 0});
  }
}

TEST(DistanceBricks, KeepAWallWithinABodyAsBoundary) {
  const voxelise::SolidVoxels block = voxelise::walled_block();
  const workspace::ObjectBricks bricks = distance_bricks(block, {{2}, {9.0F}, 100.0F, 0}, kBox, {2, {}});
  voxelise::twin::for_each(block.box, [&](workspace::Index3 v) {
    ASSERT_EQ(bricks.at(v),
              voxelise::twin::is_boundary(block, v) ? workspace::kOrderBoundary : workspace::kOrderInterior)
        << v.x << ' ' << v.y << ' ' << v.z;
  });
}

TEST(DistanceBricks, OfABallAreShellsAroundIt) {
  // An independent oracle: a solid thick enough to have bricks of interior alone.
  voxelise::SolidVoxels ball;
  ball.box = {{3, 2, 1}, {90, 90, 90}};
  ball.boundary = ball.inside = workspace::BitVolume(ball.box.size);
  voxelise::twin::for_each({{0, 0, 0}, ball.box.size}, [&](workspace::Index3 v) {
    const double r = std::hypot(v.x - 44.5, v.y - 44.5, v.z - 44.5);
    if (r < 44.0) (r > 42.0 ? ball.boundary : ball.inside).set(v.x, v.y, v.z);
  });
  const workspace::LayerProfile profile{{2, 3}, {9.0F, 8.0F}, 100.0F, 0};
  const workspace::ObjectBricks bricks = distance_bricks(ball, profile, kBox, {2, {}});
  voxelise::twin::for_each(kBox, [&](workspace::Index3 v) {
    const double outside = std::hypot(v.x - 47.5, v.y - 46.5, v.z - 45.5) - 44.0;
    const int order = bricks.at(v);
    if (voxelise::twin::is_solid(ball, v)) {
      ASSERT_EQ(order,
                voxelise::twin::is_boundary(ball, v) ? workspace::kOrderBoundary : workspace::kOrderInterior);
    } else if (outside > 6.0) {
      ASSERT_EQ(order, workspace::kOrderFree);
    } else if (outside < 1.0) {
      ASSERT_EQ(order, 1);
    }
  });
}

TEST(DistanceBricks, OfNothingAreNothing) {
  EXPECT_TRUE(distance_bricks(voxelise::SolidVoxels{}, {{1}, {1.0F}, 100.0F, 0}, kBox).keys().empty());
}

TEST(DistanceBricks, EndWhenToldTo) {
  const workspace::LayerProfile profile{{3, 2}, {9.0F, 8.0F}, 100.0F, 1};
  int asked = 0;
  const workspace::WorkOptions options{1, [&](double) { return ++asked < 2; }};
  EXPECT_TRUE(distance_bricks(voxelise::scattered_solid(9, {70, 60, 60}, 400), profile, kBox, options)
                  .keys()
                  .empty());
  EXPECT_EQ(asked, 2);
}

// --- profile and palette
// -------------------------------------------------------------------------------------------

TEST(LayerProfile, IsRefusedWithAReason) {
  const auto reason = [](const workspace::LayerProfile& profile) {
    return workspace::check_profile(profile).message();
  };
  const workspace::LayerProfile good{{4, 4}, {9.0F, 8.0F}, 100.0F, 0};
  EXPECT_TRUE(workspace::check_profile(good));
  workspace::LayerProfile bad = good;
  bad.mu_Pa_s_per_m = {8.0F, 9.0F};
  EXPECT_NE(reason(bad).find("does not fall outwards at layer 2"), std::string::npos);
  bad = good;
  bad.thickness_vox = {4};
  EXPECT_NE(reason(bad).find("one per layer"), std::string::npos);
  bad = good;
  bad.thickness_vox = {4, 0};
  EXPECT_NE(reason(bad).find("at least 1"), std::string::npos);
  bad = good;
  bad.thickness_vox = {200, 55};
  EXPECT_NE(reason(bad).find("at most 254"), std::string::npos);
  bad = good;
  bad.mu_skin_Pa_s_per_m = 1.0F;
  EXPECT_NE(reason(bad).find("skin"), std::string::npos);
  bad = good;
  bad.guard_vox = -1;
  EXPECT_NE(reason(bad).find("guard"), std::string::npos);
  EXPECT_FALSE(workspace::check_profile({}));
  bad = good;
  bad.mu_Pa_s_per_m = {9.0F, std::numeric_limits<float>::quiet_NaN()};
  EXPECT_FALSE(workspace::check_profile(bad));
}

TEST(MakePalette, SortsWhatAllProfilesName) {
  const auto palette =
      workspace::make_palette({{{1, 1}, {9.0F, 8.0F}, 100.0F, 0}, {{1, 1}, {30.0F, 8.0F}, 50.0F, 0}});
  ASSERT_TRUE(palette);
  EXPECT_EQ(*palette, (std::vector<float>{0, 8, 9, 30, 50, 100}));
  const workspace::CodeTable codes = workspace::code_table({{1, 1}, {30.0F, 8.0F}, 50.0F, 1}, *palette);
  EXPECT_EQ(codes[0], 0);
  EXPECT_EQ(codes[1], 3);
  EXPECT_EQ(codes[2], 1);
  EXPECT_EQ(codes[workspace::kOrderGuard], 3);
  EXPECT_EQ(codes[workspace::kOrderBoundary], 4);
  EXPECT_EQ(codes[workspace::kOrderInterior], 4);
}

TEST(MakePalette, RefusesTooManyViscosities) {
  std::vector<workspace::LayerProfile> profiles;
  for (int i = 0; i < 128; ++i) {
    const float mu = 1.0F + static_cast<float>(i);
    profiles.push_back({{1, 1}, {mu + 0.5F, mu}, 1000.0F, 0});
  }
  EXPECT_FALSE(workspace::make_palette(profiles));
}

// --- merge
// ---------------------------------------------------------------------------------------------------------

struct Part {
  workspace::ObjectBricks ova;
  std::uint16_t id;
  workspace::LayerProfile profile;
};

class Merge : public ::testing::Test {
 protected:
  void SetUp() override {
    const workspace::LayerProfile strong{{3, 3}, {30.0F, 20.0F}, 100.0F, 0},
        weak{{5, 4}, {25.0F, 20.0F}, 60.0F, 1};
    unsigned seed = 40;
    for (const auto& profile : {strong, weak, strong, weak}) {
      voxelise::SolidVoxels solid = voxelise::scattered_solid(seed, {14, 11, 9}, 60);
      solid.box.min = {static_cast<int>(3 * (seed - 40)), 20, static_cast<int>(25 + 2 * (seed - 40))};
      const auto id = static_cast<std::uint16_t>(1 + seed++ - 40);
      parts_.push_back({distance_bricks(solid, profile, workspace::VoxelBox::of(grid_)), id, profile});
      profiles_.push_back(profile);
    }
    palette_ = *workspace::make_palette(profiles_);
    for (const Part& part : parts_) {
      codes_.push_back(workspace::code_table(part.profile, palette_));
    }
  }
  workspace::Workspace merged(const std::vector<std::size_t>& sequence,
                              MergeLaw law = MergeLaw::kHighestViscosity, int threads = 1) const {
    std::vector<MergeEntry> entries;
    for (const std::size_t i : sequence)
      entries.push_back({&parts_[i].ova, parts_[i].id, &codes_[i], kRanks[i]});
    workspace::Workspace workspace(grid_, palette_);
    merge_bricks(law, entries, keys_of(entries), workspace, threads);
    return workspace;
  }
  /// Whether part `a` keeps the voxel against part `b`, word for word.
  bool prevails(MergeLaw law, std::size_t a, float mu_a, std::size_t b, float mu_b) const {
    if (law != MergeLaw::kHighestViscosity && kRanks[a] != kRanks[b]) return kRanks[a] > kRanks[b];
    return mu_a != mu_b ? mu_a > mu_b : parts_[a].id < parts_[b].id;
  }
  float mu_of(std::size_t i, std::int8_t order) const {
    return palette_[codes_[i][static_cast<std::uint8_t>(order)]];
  }
  static constexpr std::int64_t kRanks[] = {3, -7, 3, 1LL << 40};
  workspace::GridSpec grid_{{0, 0, 0}, 0.01, {45, 40, 50}};
  std::vector<Part> parts_;
  std::vector<workspace::CodeTable> codes_;
  std::vector<workspace::LayerProfile> profiles_;
  std::vector<float> palette_;
};

TEST_F(Merge, IsItsLawWordForWord) {
  for (const MergeLaw law :
       {MergeLaw::kHighestViscosity, MergeLaw::kLatestObject, MergeLaw::kObjectPriority}) {
    const workspace::Workspace workspace = merged({0, 1, 2, 3}, law);
    std::size_t contested = 0;
    voxelise::twin::for_each(workspace::VoxelBox::of(grid_), [&](workspace::Index3 v) {
      std::vector<std::size_t> claims;
      for (std::size_t i = 0; i < parts_.size(); ++i) {
        if (parts_[i].ova.at(v) != workspace::kOrderFree) claims.push_back(i);
      }
      contested += claims.size() > 1 ? 1 : 0;
      const auto winner = std::find_if(claims.begin(), claims.end(), [&](std::size_t a) {
        return std::all_of(claims.begin(), claims.end(), [&](std::size_t b) {
          return a == b || prevails(law, a, mu_of(a, parts_[a].ova.at(v)), b, mu_of(b, parts_[b].ova.at(v)));
        });
      });
      ASSERT_EQ(winner == claims.end(), claims.empty());
      ASSERT_EQ(workspace.order(v), claims.empty() ? workspace::kOrderFree : parts_[*winner].ova.at(v));
      ASSERT_EQ(workspace.mu(v), claims.empty() ? 0.0F : mu_of(*winner, parts_[*winner].ova.at(v)));
      ASSERT_EQ(workspace.object(v), claims.empty() ? 0 : parts_[*winner].id);
    });
    EXPECT_GT(contested, 1000U);
  }
}

TEST_F(Merge, IsTheSameWithEveryInstructionSetAndManyThreads) {
  for (const MergeLaw law : {MergeLaw::kHighestViscosity, MergeLaw::kLatestObject}) {
    const std::uint64_t hash = merged({0, 1, 2, 3}, law).content_hash();
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::SetSupportedTargetsForTest(target);
      EXPECT_EQ(merged({0, 1, 2, 3}, law, 3).content_hash(), hash) << hwy::TargetName(target);
    }
    hwy::SetSupportedTargetsForTest(0);
  }
}

TEST_F(Merge, OfSomeBricksLeavesTheOthersAndForgetsWhatWasThere) {
  std::vector<MergeEntry> entries;
  for (std::size_t i = 0; i < parts_.size(); ++i)
    entries.push_back({&parts_[i].ova, parts_[i].id, &codes_[i]});
  workspace::Workspace workspace = merged({0, 1, 2, 3});
  const std::uint64_t hash = workspace.content_hash();
  const std::vector<workspace::BrickKey> keys = parts_[2].ova.keys();
  const std::vector<MergeEntry> without{entries[0], entries[1], entries[3]};
  merge_bricks(MergeLaw::kHighestViscosity, without, keys, workspace);
  EXPECT_EQ(workspace.content_hash(), merged({0, 1, 3}).content_hash());
  merge_bricks(MergeLaw::kHighestViscosity, entries, keys, workspace);
  EXPECT_EQ(workspace.content_hash(), hash);
}

TEST_F(Merge, IsCommutativeAssociativeAndIdempotent) {
  const std::uint64_t hash = merged({0, 1, 2, 3}).content_hash();
  EXPECT_EQ(merged({3, 2, 1, 0}).content_hash(), hash);
  EXPECT_EQ(merged({2, 0, 3, 1}).content_hash(), hash);
  EXPECT_EQ(merged({1, 1, 0, 2, 3, 0, 2}).content_hash(), hash);
  // Merging what is merged already, and in two steps, changes nothing.
  workspace::Workspace again = merged({0, 1});
  std::vector<MergeEntry> entries;
  for (std::size_t i = 0; i < parts_.size(); ++i)
    entries.push_back({&parts_[i].ova, parts_[i].id, &codes_[i]});
  merge_bricks(MergeLaw::kHighestViscosity, entries, keys_of(entries), again);
  EXPECT_EQ(again.content_hash(), hash);
  merge_bricks(MergeLaw::kHighestViscosity, entries, keys_of(entries), again);
  EXPECT_EQ(again.content_hash(), hash);
}

TEST_F(Merge, MakesNoEmptyBricks) {
  const workspace::Workspace workspace = merged({0});
  for (const workspace::BrickKey key : workspace.bricks()) {
    const auto brick = workspace.brick(key);
    EXPECT_TRUE(std::any_of(brick.mu_code, brick.mu_code + workspace::kBrickVoxels,
                            [](std::uint8_t code) { return code != 0; }));
  }
}

}  // namespace
}  // namespace phantom::layers
