#include "components/wva_server/live/live_matter.hpp"

#include <gtest/gtest.h>

#include <random>

#include "common/workspace/workspace_hash.hpp"
#include "components/wva_server/tests/test_cell.hpp"
#include "tests/support/same_content.hpp"

namespace phantom::wva_server::live_matter_test {
namespace {

using workspace::Index3;
using workspace::VoxelBox;
constexpr core::Nanoseconds kMs = core::kNsPerMillisecond;

messages::OccupancyChange a_change(std::uint64_t number, bool whole,
                                   std::vector<messages::OccupancyBlock> blocks, std::uint64_t session = 7) {
  messages::OccupancyChange change;
  change.stamp = {number, 0, session};
  change.whole = whole;
  change.blocks = std::move(blocks);
  change.image_age_s = 0.03;
  return change;
}
messages::OccupancyBlock a_block(std::uint16_t x, std::uint64_t word) { return {x, 1, 2, {word}}; }

TEST(LiveIntake, PutsChangesTogetherUntilTheyAreTaken) {
  LiveIntake intake;
  EXPECT_FALSE(intake.take());
  EXPECT_TRUE(intake.put(a_change(1, true, {a_block(1, 5), a_block(2, 6)}), 100 * kMs));
  EXPECT_TRUE(intake.put(a_change(2, false, {a_block(2, 9)}), 200 * kMs));
  const auto taken = intake.take();
  ASSERT_TRUE(taken);
  EXPECT_TRUE(taken->whole);
  EXPECT_EQ(taken->blocks, (std::vector{a_block(1, 5), a_block(2, 9)}));
  EXPECT_EQ(taken->exposed_ns, 70 * kMs);
  EXPECT_FALSE(intake.take());
  EXPECT_TRUE(intake.put(a_change(3, false, {}), 300 * kMs));
  EXPECT_FALSE(intake.take()) << "nothing has changed";
  EXPECT_TRUE(intake.put(a_change(4, false, {a_block(1, 0)}), 400 * kMs));
  EXPECT_FALSE(intake.take()->whole);
}

// Tries wva_server: a change of what cameras see is lost
TEST(LiveIntake, AfterAGapItWaitsForAWholeOne) {
  LiveIntake intake;
  EXPECT_FALSE(intake.put(a_change(1, false, {a_block(1, 5)}), kMs)) << "nothing to change yet";
  EXPECT_TRUE(intake.put(a_change(2, true, {a_block(1, 5)}), kMs));
  EXPECT_FALSE(intake.put(a_change(4, false, {a_block(1, 6)}), kMs));
  EXPECT_FALSE(intake.put(a_change(5, false, {a_block(1, 6)}), kMs));
  EXPECT_FALSE(intake.take());
  EXPECT_EQ(intake.missed(), 1U);
  EXPECT_TRUE(intake.put(a_change(6, true, {a_block(3, 1)}), kMs));
  EXPECT_FALSE(intake.put(a_change(7, false, {}, 8), kMs)) << "of another process";
}

/// Where the blocks of test cells lie: 80 × 80 × 50 voxels of 10 mm from (−0.4, −0.4, 0).
class Live : public TestCell {
 protected:
  static LiveRules rules(int tolerance_vox = 2) {
    LiveRules rules;
    rules.source = "workspace_camera";
    rules.tolerance_vox = tolerance_vox;
    rules.min_voxels = 1;
    rules.join_vox = 1;
    rules.profile = {{2, 3}, {30.0F, 15.0F}, 100.0F, 0};
    return rules;
  }
  static LiveIntake::Taken seen(const workspace::BitVolume& bits, const workspace::GridSpec& grid) {
    std::map<std::array<std::uint16_t, 3>, messages::OccupancyBlock> blocks;
    workspace::VoxelBox::of(grid).for_each([&](Index3 v) {
      if (!bits.get(v)) return;
      const std::array place{static_cast<std::uint16_t>(v.x >> 3), static_cast<std::uint16_t>(v.y >> 3),
                             static_cast<std::uint16_t>(v.z >> 3)};
      auto& block =
          blocks.try_emplace(place, messages::OccupancyBlock{place[0], place[1], place[2], {}}).first->second;
      block.bits[static_cast<std::size_t>(v.z & 7)] |= std::uint64_t{1} << (8 * (v.y & 7) + (v.x & 7));
    });
    LiveIntake::Taken taken{true, {}, {}};
    for (const auto& [place, block] : blocks) taken.blocks.push_back(block);
    return taken;
  }
  static workspace::BitVolume box(const workspace::GridSpec& grid, Index3 from, Index3 to) {
    workspace::BitVolume bits(grid.size_vox);
    workspace::VoxelBox::between(from, to).for_each([&](Index3 v) { bits.set(v.x, v.y, v.z); });
    return bits;
  }
  void merge(LiveCell& cell, LiveMatter& matter) {
    const auto change = cell.put_live(matter.update(now_ns_ += 100 * kMs), cell.workspace().version + 1, 1);
    ASSERT_TRUE(change) << change.status().message();
    EXPECT_EQ(cell.content_hash(), cell.workspace().content_hash());
  }
  core::Nanoseconds now_ns_ = 0;
};

constexpr std::uint16_t kFirst = messages::kFirstLiveObjectId, kSecond = kFirst + 1;

TEST_F(Live, MatterIsAnObjectWithLayersAndGoesWithoutATrace) {
  LiveCell cell_ = activated(cell());
  ASSERT_TRUE(cell_.begin_live(rules().profile, 8));
  LiveMatter matter = LiveMatter::create(cell_.workspace().grid(), rules()).value();
  matter.set_model(cell_.solid());
  merge(cell_, matter);
  const std::uint64_t before = cell_.content_hash();
  const auto& grid = cell_.workspace().grid();
  matter.take(seen(box(grid, {40, 10, 20}, {46, 16, 26}), grid));
  merge(cell_, matter);
  EXPECT_NE(cell_.content_hash(), before);
  const Index3 inside{43, 13, 23};
  EXPECT_EQ(cell_.workspace().order(inside), workspace::kOrderBoundary);
  EXPECT_EQ(cell_.workspace().object(inside), kFirst);
  EXPECT_EQ(cell_.workspace().order(Index3{43, 8, 23}), 1);
  EXPECT_EQ(matter.voxels(), 216U);
  EXPECT_TRUE(matter.middle_m(kFirst)->isApprox(Eigen::Vector3d(0.03, -0.27, 0.23), 1e-9));
  matter.take({true, {}, {}});
  merge(cell_, matter);
  EXPECT_EQ(cell_.content_hash(), before);
  EXPECT_FALSE(matter.middle_m(kFirst));
}

TEST_F(Live, WhatTheModelExplainsIsTheModels) {
  LiveCell cell_ = activated(cell());
  ASSERT_TRUE(cell_.begin_live(rules().profile, 8));
  LiveMatter matter = LiveMatter::create(cell_.workspace().grid(), rules()).value();
  matter.set_model(cell_.solid());
  merge(cell_, matter);
  const auto& grid = cell_.workspace().grid();
  const std::uint64_t before = cell_.content_hash();
  // What a camera sees of the model, and a voxel beside it, is the model's.
  workspace::BitVolume of_model = cell_.solid();
  const Index3 ball = grid.index_of({0.0, 0.0, 0.3});
  of_model.set(ball.x - 7, ball.y, ball.z);
  matter.take(seen(of_model, grid));
  EXPECT_TRUE(matter.update(now_ns_ += kMs).empty());
  EXPECT_EQ(matter.voxels(), 0U);
  EXPECT_EQ(cell_.content_hash(), before);
  // Once the ball is elsewhere, what is still seen there is matter.
  const auto moved = cell_.apply(
      make_command(WorkspaceOperation::kMove, "ball", 0, {Eigen::Matrix3d::Identity(), {0.0, -0.3, 0.3}}),
      cell_.workspace().version + 1, {});
  ASSERT_TRUE(moved) << moved.status().message();
  matter.set_model(cell_.solid());
  merge(cell_, matter);
  EXPECT_GT(matter.voxels(), 500U);
  EXPECT_TRUE(messages::is_live(cell_.workspace().object(ball)));
}

TEST_F(Live, SmallPartsAreNoMatter) {
  LiveRules strict = rules();
  strict.min_voxels = 9;
  const auto grid = runtime::grid_of(runtime::load_cell(cell()));
  LiveMatter matter = LiveMatter::create(grid, strict).value();
  workspace::BitVolume bits = box(grid, {40, 10, 20}, {42, 12, 22});  // 8 voxels
  matter.take(seen(bits, grid));
  EXPECT_TRUE(matter.update(now_ns_ += kMs).empty());
  EXPECT_EQ(matter.voxels(), 0U);
  bits.set(42, 12, 22);  // by a corner, beyond a block's border
  matter.take(seen(bits, grid));
  EXPECT_FALSE(matter.update(now_ns_ += kMs).empty());
  EXPECT_EQ(matter.voxels(), 9U);
  bits.flip(41, 11, 21);  // 7 voxels, and one that is connected with nothing
  matter.take(seen(bits, grid));
  EXPECT_FALSE(matter.update(now_ns_ += kMs).empty());
  EXPECT_EQ(matter.voxels(), 0U);
  EXPECT_FALSE(matter.middle_m(kFirst));
}

/// Between its parts nothing was measured, as of shining steel.
TEST_F(Live, PartsThatAreNearAreOneThingUnlessTheyAreSmall) {
  LiveRules near = rules();
  near.min_voxels = 9;
  near.join_vox = 3;
  const auto grid = runtime::grid_of(runtime::load_cell(cell()));
  LiveMatter matter = LiveMatter::create(grid, near).value();
  workspace::BitVolume bits = box(grid, {40, 10, 20}, {44, 14, 24});
  workspace::VoxelBox::between({46, 10, 20}, {50, 14, 24}).for_each([&](Index3 v) {  // two voxels between
    bits.set(v.x, v.y, v.z);
  });
  bits.set(52, 10, 20);  // as near, and too small
  matter.take(seen(bits, grid));
  matter.update(now_ns_ += kMs);
  EXPECT_EQ(matter.objects().all().size(), 1U);
  EXPECT_EQ(matter.voxels(), 128U);
  ASSERT_TRUE(matter.middle_m(kFirst));
  near.join_vox = 2;
  LiveMatter apart = LiveMatter::create(grid, near).value();
  apart.take(seen(bits, grid));
  apart.update(now_ns_ += kMs);
  EXPECT_EQ(apart.objects().all().size(), 2U);
}

/// A sequence of sights and of moves ends in what the last of them makes from nothing.
TEST_F(Live, EqualsWhatItsLastSightMakesFromNothing) {
  std::mt19937 random(5);
  LiveCell cell_ = activated(cell());
  ASSERT_TRUE(cell_.begin_live(rules().profile, 8));
  LiveRules strict = rules();
  strict.min_voxels = 60;
  LiveMatter matter = LiveMatter::create(cell_.workspace().grid(), strict).value();
  matter.set_model(cell_.solid());
  const auto& grid = cell_.workspace().grid();
  LiveIntake::Taken last;
  for (int i = 0; i < 25; ++i) {
    const auto at = [&random](int size) {
      return static_cast<std::int32_t>(random() % static_cast<unsigned>(size));
    };
    const Index3 from{at(70), at(70), at(40)};
    last = seen(box(grid, from, from + Index3{1 + at(10), 1 + at(10), 1 + at(10)}), grid);
    matter.take(last);
    if (i % 6 == 5) {
      const double x_m = -0.2 + 0.02 * i;
      ASSERT_TRUE(cell_.apply(
          make_command(WorkspaceOperation::kMove, "ball", 0, {Eigen::Matrix3d::Identity(), {x_m, -0.1, 0.3}}),
          cell_.workspace().version + 1, {}));
      matter.set_model(cell_.solid());
    }
    merge(cell_, matter);
  }
  LiveMatter rebuilt = LiveMatter::create(grid, strict).value();
  rebuilt.take(last);
  rebuilt.set_model(cell_.solid());
  auto anew = rebuilt.update(0);
  EXPECT_EQ(rebuilt.voxels(), matter.voxels());
  LiveCell twin = activated(cell());
  ASSERT_TRUE(twin.begin_live(rules().profile, 8));
  const auto& ball = cell_.objects().at(cell_.find(make_command(WorkspaceOperation::kMove, "ball")).value());
  ASSERT_TRUE(twin.apply(make_command(WorkspaceOperation::kMove, "ball", 0, ball.config.X_WO), 9, {}));
  ASSERT_TRUE(twin.put_live(std::move(anew), 10, 1));
  // An id may be another one; nothing else differs.
  std::size_t wrong = 0;
  workspace::VoxelBox::of(grid).for_each([&](Index3 v) {
    const workspace::Workspace &a = cell_.workspace(), &b = twin.workspace();
    const bool same_object =
        a.object(v) == b.object(v) || (messages::is_live(a.object(v)) && messages::is_live(b.object(v)));
    wrong += a.order(v) != b.order(v) || a.mu(v) != b.mu(v) || !same_object ? 1 : 0;
  });
  EXPECT_EQ(wrong, 0U);
}

// Two things in a row of sights: one that passes, and one that stands.
TEST_F(Live, AThingKeepsItsIdWhileItPassesAnotherOne) {
  LiveCell cell_ = activated(cell());
  ASSERT_TRUE(cell_.begin_live(rules().profile, 8));
  LiveMatter matter = LiveMatter::create(cell_.workspace().grid(), rules()).value();
  const auto& grid = cell_.workspace().grid();
  for (int step = 0; step < 12; ++step) {
    workspace::BitVolume bits = box(grid, {40, 10, 20}, {46, 16, 26});
    const Index3 from{4 + 6 * step, 26, 20};
    VoxelBox{from, {5, 5, 5}}.for_each([&](Index3 v) { bits.set(v.x, v.y, v.z); });
    matter.take(seen(bits, grid));
    merge(cell_, matter);
    EXPECT_EQ(cell_.workspace().object(Index3{43, 13, 23}), kFirst) << "it is larger";
    EXPECT_EQ(cell_.workspace().object(from + Index3{2, 2, 2}), kSecond) << "step " << step;
  }
  EXPECT_EQ(matter.objects().all().size(), 2U);
}

TEST_F(Live, AFrozenThingStaysWhateverCamerasSeeThere) {
  LiveCell cell_ = activated(cell());
  ASSERT_TRUE(cell_.begin_live(rules().profile, 8));
  LiveMatter matter = LiveMatter::create(cell_.workspace().grid(), rules()).value();
  const auto& grid = cell_.workspace().grid();
  const auto thing = seen(box(grid, {40, 10, 20}, {46, 16, 26}), grid);
  EXPECT_FALSE(matter.freeze(kFirst)) << "nothing is seen yet";
  matter.take(thing);
  merge(cell_, matter);
  const std::uint64_t with_it = cell_.content_hash();
  ASSERT_TRUE(matter.freeze(kFirst));
  EXPECT_FALSE(matter.freeze(kFirst));
  // It is not seen; it is seen a voxel aside; it is seen in part.
  for (const auto& later :
       {LiveIntake::Taken{true, {}, {}}, seen(box(grid, {41, 10, 20}, {47, 16, 26}), grid),
        seen(box(grid, {40, 10, 20}, {42, 16, 26}), grid)}) {
    matter.take(later);
    merge(cell_, matter);
    EXPECT_EQ(cell_.content_hash(), with_it);
  }
  matter.take({true, {}, {}});
  merge(cell_, matter);
  ASSERT_TRUE(matter.restore(kFirst, now_ns_));
  EXPECT_FALSE(matter.restore(kFirst, now_ns_));
  merge(cell_, matter);
  EXPECT_EQ(matter.voxels(), 0U) << "cameras do not see it";
  matter.take(thing);
  merge(cell_, matter);
  EXPECT_EQ(cell_.content_hash(), with_it) << "it has its id again";
}

TEST_F(Live, SR29_ADiscardedThingIsNotFeltUntilItHasGoneOrIsRestored) {
  LiveCell cell_ = activated(cell());
  ASSERT_TRUE(cell_.begin_live(rules().profile, 8));
  LiveMatter matter = LiveMatter::create(cell_.workspace().grid(), rules()).value();
  const auto& grid = cell_.workspace().grid();
  const auto thing = seen(box(grid, {40, 10, 20}, {46, 16, 26}), grid);
  matter.take(thing);
  merge(cell_, matter);
  const std::uint64_t with_it = cell_.content_hash();
  ASSERT_TRUE(matter.discard(kFirst, now_ns_));
  merge(cell_, matter);
  EXPECT_EQ(matter.voxels(), 0U);
  // Seen for as long as it may be, with its edge a voxel farther out; then another thing beside it.
  for (int i = 0; i < 150; ++i) {
    matter.take(seen(box(grid, {39, 10, 20}, {46, 17, 26}), grid));
    merge(cell_, matter);
    ASSERT_EQ(matter.voxels(), 0U);
  }
  workspace::BitVolume both = box(grid, {40, 10, 20}, {46, 16, 26});
  VoxelBox{{60, 10, 20}, {5, 5, 5}}.for_each([&](Index3 v) { both.set(v.x, v.y, v.z); });
  matter.take(seen(both, grid));
  merge(cell_, matter);
  EXPECT_EQ(matter.voxels(), 125U);
  ASSERT_TRUE(matter.restore(kFirst, now_ns_));
  matter.take(thing);
  merge(cell_, matter);
  EXPECT_EQ(cell_.content_hash(), with_it);
  // Once nothing has been seen there for some time, what comes next is felt.
  ASSERT_TRUE(matter.discard(kFirst, now_ns_));
  matter.take({true, {}, {}});
  merge(cell_, matter);
  EXPECT_TRUE(matter.expires());
  now_ns_ += core::from_seconds(LiveObjects::kForgotten_s);
  merge(cell_, matter);
  EXPECT_FALSE(matter.expires());
  matter.take(thing);
  merge(cell_, matter);
  EXPECT_EQ(matter.voxels(), 216U);
}

// What no id is left for is felt all the same.
TEST_F(Live, MoreThingsThanIdsShareOne) {
  LiveCell cell_ = activated(cell());
  ASSERT_TRUE(cell_.begin_live(rules().profile, 8));
  LiveMatter matter = LiveMatter::create(cell_.workspace().grid(), rules()).value();
  const auto& grid = cell_.workspace().grid();
  workspace::BitVolume bits(grid.size_vox);
  for (std::int32_t i = 0; i < 20; ++i)
    VoxelBox{{4 * (i % 10) + 2, 6 * (i / 10) + 2, 10}, {2, 2, 1 + (i < 15 ? 1 : 0)}}.for_each(
        [&](Index3 v) { bits.set(v.x, v.y, v.z); });
  matter.take(seen(bits, grid));
  merge(cell_, matter);
  EXPECT_EQ(matter.objects().all().size(), messages::kMaxLiveObjects);
  EXPECT_EQ(matter.voxels(), 15U * 8 + 5U * 4);
  EXPECT_EQ(cell_.workspace().object(Index3{4 * 7 + 2, 8, 10}), kLiveId) << "the smaller ones";
  EXPECT_TRUE(matter.middle_m(kLiveId));
  EXPECT_FALSE(matter.freeze(kLiveId));
}

TEST_F(Live, ItsIdAndNameAreNobodyElses) {
  LiveCell cell_ = activated(cell());
  ASSERT_TRUE(cell_.begin_live(rules().profile, 8));
  const auto moved = cell_.apply(make_command(WorkspaceOperation::kMove, kLiveName), 9, {});
  ASSERT_FALSE(moved);
  EXPECT_NE(moved.status().message().find("is what depth cameras see"), std::string::npos);
  EXPECT_FALSE(cell_.apply(make_command(WorkspaceOperation::kRemove, "", kLiveId), 9, {}));
  EXPECT_FALSE(cell_.apply(make_command(WorkspaceOperation::kMove, "live object 2"), 9, {}));
  EXPECT_FALSE(cell_.apply(make_command(WorkspaceOperation::kFreeze, "ball"), 9, {}));
  const auto added = cell_.apply(
      make_command(
          WorkspaceOperation::kAdd, "", 0, {},
          "{name: live matter, primitive: {box: {size_m: [0.1, 0.1, 0.1]}}, pose: {xyz_m: [0, -0.2, 0.2]}}"),
      9, {});
  ASSERT_FALSE(added);
  EXPECT_NE(added.status().message().find("give it another one"), std::string::npos);
}

TEST_F(Live, WhatItCannotHaveIsRefused) {
  const auto grid = runtime::grid_of(runtime::load_cell(cell()));
  LiveRules odd = rules();
  odd.tolerance_vox = 21;
  EXPECT_FALSE(LiveMatter::create(grid, odd));
  odd = rules();
  odd.profile.method = workspace::LayerMethod::kDilation;
  EXPECT_FALSE(LiveMatter::create(grid, odd));
  workspace::GridSpec bars = grid;
  bars.voxel_size_m = workspace::VoxelSize(Eigen::Vector3d(0.01, 0.01, 0.02));
  EXPECT_FALSE(LiveMatter::create(bars, rules()));
}

}  // namespace
}  // namespace phantom::wva_server::live_matter_test
