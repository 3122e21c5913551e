#include "common/voxel/layers.hpp"

#include <gtest/gtest.h>

#include <random>

#include "common/geometry/primitives.hpp"
#include "common/voxel/merge.hpp"
#include "common/voxel/tests/literal_twins.hpp"

namespace phantom::voxel {
namespace {

SolidVoxels random_solid(unsigned seed, std::array<std::int32_t, 3> size, int one_in) {
  std::mt19937 random(seed);
  SolidVoxels solid;
  solid.box = {{20, 25, 30}, size};
  solid.boundary = solid.interior = BitVolume(size);
  for (std::int32_t z = 0; z < size[2]; ++z) {
    for (std::int32_t y = 0; y < size[1]; ++y) {
      for (std::int32_t x = 0; x < size[0]; ++x) {
        if (random() % static_cast<unsigned>(one_in) != 0) continue;
        (random() % 2 == 0 ? solid.boundary : solid.interior).set(x, y, z);
      }
    }
  }
  solid.inside = solid.interior;
  return solid;
}

void expect_like_the_twin(const SolidVoxels& solid, const LayerProfile& profile, const VoxelBox& clip) {
  ASSERT_TRUE(check_profile(profile)) << check_profile(profile).message();
  const ObjectVoxels ova = distance_layers(solid, profile, clip);
  const auto solids = twin::solid_voxels(solid);
  twin::for_each(ova.box, [&](Index3 v) { ASSERT_EQ(ova.at(v), twin::order(solid, solids, profile, v)); });
}

const VoxelBox kEverywhere{{-100, -100, -100}, {300, 300, 300}};

TEST(DistanceLayers, EqualTheLiteralTwinInEveryVoxel) {
  const LayerProfile profiles[] = {{{1}, {5.0F}, 100.0F, 0},
                                   {{1, 1, 1}, {9.0F, 8.0F, 7.0F}, 100.0F, 0},
                                   {{4, 4, 4}, {9.0F, 8.0F, 7.0F}, 100.0F, 0},
                                   {{2, 3, 1}, {9.0F, 8.0F, 7.0F}, 100.0F, 2},
                                   {{1, 5}, {9.0F, 8.0F}, 100.0F, 1}};
  unsigned seed = 1;
  for (const auto& profile : profiles) {
    expect_like_the_twin(random_solid(seed++, {7, 5, 6}, 20), profile, kEverywhere);
    expect_like_the_twin(random_solid(seed++, {9, 9, 9}, 200), profile, kEverywhere);
    expect_like_the_twin(random_solid(seed++, {40, 3, 2}, 30), profile, kEverywhere);
    expect_like_the_twin(random_solid(seed++, {1, 1, 1}, 1), profile, kEverywhere);
  }
}

TEST(DistanceLayers, ReachFarWithoutOverflow) {
  const SolidVoxels dot = random_solid(1, {1, 1, 1}, 1);
  const LayerProfile widest{{250, 4}, {2.0F, 1.0F}, 100.0F, 0};
  ASSERT_TRUE(check_profile(widest));
  const VoxelBox plane{{-240, -235, 28}, {520, 520, 5}};  // all of the reach in x and y
  const ObjectVoxels ova = distance_layers(dot, widest, plane);
  const auto solids = twin::solid_voxels(dot);
  std::mt19937 random(5);
  for (int i = 0; i < 200000; ++i) {
    const Index3 v{ova.box.min.x + static_cast<int>(random() % static_cast<unsigned>(ova.box.size[0])),
                   ova.box.min.y + static_cast<int>(random() % static_cast<unsigned>(ova.box.size[1])),
                   28 + static_cast<int>(random() % 5)};
    ASSERT_EQ(ova.at(v), twin::order(dot, solids, widest, v));
  }
}

TEST(DistanceLayers, ClippingDoesNotChangeWhatIsLeft) {
  const LayerProfile profile{{3, 2}, {9.0F, 8.0F}, 100.0F, 1};
  const SolidVoxels solid = random_solid(9, {12, 12, 12}, 40);
  const VoxelBox wanted{{24, 20, 33}, {5, 20, 6}};
  const ObjectVoxels whole = distance_layers(solid, profile, kEverywhere);
  const ObjectVoxels part = distance_layers(solid, profile, wanted.grown(profile.reach_vox()));
  twin::for_each(wanted, [&](Index3 v) { EXPECT_EQ(part.at(v), whole.at(v)); });
}

TEST(DistanceLayers, OfNothingAreNothing) {
  EXPECT_TRUE(distance_layers(SolidVoxels{}, {{1}, {1.0F}, 100.0F, 0}, kEverywhere).box.empty());
}

// --- profile and palette
// -------------------------------------------------------------------------------------------

TEST(LayerProfile, IsRefusedWithAReason) {
  const auto reason = [](const LayerProfile& profile) { return check_profile(profile).message(); };
  const LayerProfile good{{4, 4}, {9.0F, 8.0F}, 100.0F, 0};
  EXPECT_TRUE(check_profile(good));
  LayerProfile bad = good;
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
  EXPECT_FALSE(check_profile({}));
  bad = good;
  bad.mu_Pa_s_per_m = {9.0F, std::numeric_limits<float>::quiet_NaN()};
  EXPECT_FALSE(check_profile(bad));
}

TEST(MakePalette, SortsWhatAllProfilesName) {
  const auto palette = make_palette({{{1, 1}, {9.0F, 8.0F}, 100.0F, 0}, {{1, 1}, {30.0F, 8.0F}, 50.0F, 0}});
  ASSERT_TRUE(palette);
  EXPECT_EQ(*palette, (std::vector<float>{0, 8, 9, 30, 50, 100}));
  const CodeTable codes = code_table({{1, 1}, {30.0F, 8.0F}, 50.0F, 1}, *palette);
  EXPECT_EQ(codes[0], 0);
  EXPECT_EQ(codes[1], 3);
  EXPECT_EQ(codes[2], 1);
  EXPECT_EQ(codes[kOrderGuard], 3);
  EXPECT_EQ(codes[kOrderBoundary], 4);
  EXPECT_EQ(codes[kOrderInterior], 4);
}

TEST(MakePalette, RefusesTooManyViscosities) {
  std::vector<LayerProfile> profiles;
  for (int i = 0; i < 128; ++i) {
    const float mu = 1.0F + static_cast<float>(i);
    profiles.push_back({{1, 1}, {mu + 0.5F, mu}, 1000.0F, 0});
  }
  EXPECT_FALSE(make_palette(profiles));
}

// --- merge
// ---------------------------------------------------------------------------------------------------------

struct Part {
  ObjectVoxels ova;
  std::uint16_t id;
  LayerProfile profile;
};

class Merge : public ::testing::Test {
 protected:
  void SetUp() override {
    const LayerProfile strong{{3, 3}, {30.0F, 20.0F}, 100.0F, 0}, weak{{5, 4}, {25.0F, 20.0F}, 60.0F, 1};
    unsigned seed = 40;
    for (const auto& profile : {strong, weak, strong, weak}) {
      SolidVoxels solid = random_solid(seed, {14, 11, 9}, 60);
      solid.box.min = {static_cast<int>(3 * (seed - 40)), 20, static_cast<int>(25 + 2 * (seed - 40))};
      const auto id = static_cast<std::uint16_t>(1 + seed++ - 40);
      parts_.push_back({distance_layers(solid, profile, voxelise_clip(grid_, profile)), id, profile});
      profiles_.push_back(profile);
    }
    palette_ = *make_palette(profiles_);
    for (const Part& part : parts_) {
      bricks_.push_back(ObjectBricks::of(part.ova, grid_));
      codes_.push_back(code_table(part.profile, palette_));
    }
  }
  Workspace merged(const std::vector<std::size_t>& sequence) const {
    std::vector<MergeEntry> entries;
    for (const std::size_t i : sequence) entries.push_back({&bricks_[i], parts_[i].id, &codes_[i]});
    Workspace workspace(grid_, palette_);
    merge_bricks(MergeLaw::kHighestViscosity, entries, keys_of(entries), workspace);
    return workspace;
  }
  GridSpec grid_{{0, 0, 0}, 0.01, {45, 40, 50}};
  std::vector<Part> parts_;
  std::vector<ObjectBricks> bricks_;
  std::vector<CodeTable> codes_;
  std::vector<LayerProfile> profiles_;
  std::vector<float> palette_;
};

TEST_F(Merge, HigherViscosityPrevailsThenTheLowerObject) {
  const Workspace workspace = merged({0, 1, 2, 3});
  std::size_t contested = 0;
  twin::for_each(VoxelBox::of(grid_), [&](Index3 v) {
    float mu = 0.0F;
    std::uint16_t object = 0;
    std::int8_t order = 0;
    int claims = 0;
    for (const Part& part : parts_) {  // in order of rising id: a later one must be strictly stronger
      const std::int8_t here = part.ova.at(v);
      if (here == kOrderFree) continue;
      ++claims;
      const float its = palette_[code_table(part.profile, palette_)[static_cast<std::uint8_t>(here)]];
      if (its > mu) {
        mu = its;
        object = part.id;
        order = here;
      }
    }
    contested += claims > 1 ? 1 : 0;
    ASSERT_EQ(workspace.mu(v), mu);
    ASSERT_EQ(workspace.object(v), object);
    ASSERT_EQ(workspace.order(v), order);
  });
  EXPECT_GT(contested, 1000U);
}

TEST_F(Merge, IsCommutativeAssociativeAndIdempotent) {
  const std::uint64_t hash = merged({0, 1, 2, 3}).content_hash();
  EXPECT_EQ(merged({3, 2, 1, 0}).content_hash(), hash);
  EXPECT_EQ(merged({2, 0, 3, 1}).content_hash(), hash);
  EXPECT_EQ(merged({1, 1, 0, 2, 3, 0, 2}).content_hash(), hash);
}

TEST_F(Merge, MakesNoEmptyBricks) {
  const Workspace workspace = merged({0});
  for (const BrickKey key : workspace.bricks()) {
    const auto brick = workspace.brick(key);
    EXPECT_TRUE(std::any_of(brick.mu_code, brick.mu_code + kBrickVoxels,
                            [](std::uint8_t code) { return code != 0; }));
  }
}

}  // namespace
}  // namespace phantom::voxel
