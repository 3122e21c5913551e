// The layers of a changing occupancy are always those that it gives from nothing.
#include "common/fusion/incremental_layers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <set>

#include "common/fusion/fused_block.hpp"
#include "tests/support/thorough.hpp"

namespace phantom::fusion {
namespace {

using workspace::BrickKey;
using workspace::Index3;
using workspace::VoxelBox;

const workspace::GridSpec kLayersGrid{{}, 0.005, {150, 100, 90}};  // the last bricks are partial
const workspace::LayerProfile kLiveProfile{{3, 4, 5}, {60.0F, 40.0F, 20.0F}, 100.0F, 2};

bool same_brick(const std::int8_t* a, const std::int8_t* b) {
  return (a == nullptr) == (b == nullptr) &&
         (a == nullptr || std::memcmp(a, b, workspace::kBrickVoxels) == 0);
}

/// Edits at random: boxes that come and go, at any place and of any size.
class Edited {
 public:
  explicit Edited(unsigned seed) : random_(seed) {}

  void edit() {
    VoxelBox box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.size[axis] = 1 + static_cast<std::int32_t>(random_() % (random_() % 8 == 0 ? 40 : 6));
      box.min[axis] =
          static_cast<std::int32_t>(random_() % static_cast<unsigned>(kLayersGrid.size_vox[axis]));
    }
    const bool occupy = random_() % 5 < 2;
    box.intersection(VoxelBox::of(kLayersGrid)).for_each([&](Index3 v) {
      if (occupied.get(v) == occupy) return;
      occupied.flip(v.x, v.y, v.z);
      changed.insert(block_of(v));
    });
  }
  std::vector<Index3> take_changed() {
    std::vector<Index3> blocks(changed.begin(), changed.end());
    changed.clear();
    return blocks;
  }

  workspace::BitVolume occupied{kLayersGrid.size_vox};
  std::set<Index3> changed;

 private:
  std::mt19937 random_;
};

TEST(IncrementalLayers, EqualActivationFromNothingAfterRandomEdits) {
  Edited edited(test::thorough_or(1U, 2U));
  auto layers = IncrementalLayers::create(kLayersGrid, kLiveProfile).value();
  std::mt19937 random(9);
  workspace::ObjectBricks before = layers.bricks();
  std::size_t computed = 0, removed = 0;
  const int updates = test::thorough_or(60, 5000);
  for (int n = 0; n < updates; ++n) {
    for (unsigned i = 0; i < 1 + random() % 6; ++i) edited.edit();
    if (n % 20 == 19) {  // everything goes
      for (std::uint64_t& word : edited.occupied.words()) word = 0;
      VoxelBox::between({}, {19, 13, 12}).for_each([&](Index3 block) { edited.changed.insert(block); });
    }
    const LayersChange& change = layers.update(edited.occupied, edited.take_changed());
    computed += change.computed;
    removed += change.removed.size();
    const workspace::ObjectBricks now = layers.bricks(),
                                  all = layers_of(edited.occupied, kLayersGrid, kLiveProfile);
    ASSERT_EQ(now.keys(), all.keys()) << n;
    for (const BrickKey& key : all.keys()) ASSERT_TRUE(same_brick(now.orders(key), all.orders(key))) << n;
    // It reports exactly the bricks that differ.
    std::set<BrickKey> differ, gone;
    for (const BrickKey& key : now.keys()) {
      if (!same_brick(now.orders(key), before.orders(key))) differ.insert(key);
    }
    for (const BrickKey& key : before.keys()) {
      if (now.orders(key) == nullptr) gone.insert(key);
    }
    EXPECT_EQ(std::vector<BrickKey>(differ.begin(), differ.end()), change.changed) << n;
    EXPECT_EQ(std::vector<BrickKey>(gone.begin(), gone.end()), change.removed) << n;
    before = now;
  }
  EXPECT_GT(removed, 5U);
  EXPECT_LT(computed, static_cast<std::size_t>(updates) * 45U);  // of 60 bricks
}

TEST(IncrementalLayers, ComputeOnlyWhatIsWithinReach) {
  auto layers = IncrementalLayers::create(kLayersGrid, kLiveProfile).value();
  workspace::BitVolume occupied(kLayersGrid.size_vox);
  occupied.set(50, 50, 50);
  const std::vector<Index3> block{block_of({50, 50, 50})};
  EXPECT_EQ(layers.update(occupied, block).computed, 7U);  // reach 14: 34…69, but for the brick at the corner
  occupied.set(66, 50, 50);
  const std::vector<Index3> other{block_of({66, 50, 50})};
  EXPECT_EQ(layers.update(occupied, other).computed, 8U);
  EXPECT_EQ(layers.update(occupied, {}).computed, 0U);
}

TEST(IncrementalLayers, RefuseWhatTheyCannotKeep) {
  workspace::LayerProfile profile = kLiveProfile;
  profile.method = workspace::LayerMethod::kDilation;
  EXPECT_THAT(IncrementalLayers::create(kLayersGrid, profile).status().message(),
              testing::HasSubstr("allowed: method distance"));
  workspace::GridSpec grid = kLayersGrid;
  grid.voxel_size_m = workspace::VoxelSize(Eigen::Vector3d(0.005, 0.005, 0.01));
  EXPECT_THAT(IncrementalLayers::create(grid, kLiveProfile).status().message(), testing::HasSubstr("cubes"));
  profile = kLiveProfile;
  profile.thickness_vox.clear();
  EXPECT_FALSE(IncrementalLayers::create(kLayersGrid, profile));
}

}  // namespace
}  // namespace phantom::fusion
