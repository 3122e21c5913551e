// How things that cameras see keep their ids and names from sight to sight.
#include "components/wva_server/live/live_objects.hpp"

#include <gmock/gmock.h>

#include <random>
#include <set>

#include "common/workspace/voxel_box.hpp"

namespace phantom::wva_server::live_objects_test {
namespace {

using testing::HasSubstr;
using workspace::Index3;
using workspace::VoxelBox;

constexpr double kVoxel_m = 0.01;
constexpr std::uint16_t kFirst = messages::kFirstLiveObjectId;

std::vector<Index3> voxels_of(const VoxelBox& box) {
  std::vector<Index3> voxels;
  box.for_each([&](Index3 v) { voxels.push_back(v); });
  return voxels;
}
LivePart cube(Index3 from, std::int32_t edge) { return part_of(voxels_of({from, {edge, edge, edge}})); }
core::Nanoseconds at_s(double time_s) { return core::from_seconds(time_s); }

TEST(LivePart, CountsSharesAndDiffersAsItsVoxels) {
  std::mt19937 random(11);
  for (int i = 0; i < 50; ++i) {
    std::set<Index3> a, b;
    for (int k = 0; k < 300; ++k) {
      const auto at = [&] { return static_cast<std::int32_t>(random() % 20); };
      a.insert({at(), at(), at()});
      b.insert({at(), at(), at()});
    }
    const LivePart of_a = part_of(std::vector(a.begin(), a.end())),
                   of_b = part_of(std::vector(b.begin(), b.end()));
    std::size_t shared = 0;
    std::set<Index3> blocks;
    for (const Index3 v : a) shared += b.count(v);
    for (const auto* one : {&a, &b})
      for (const Index3 v : *one)
        if (a.count(v) != b.count(v)) blocks.insert({v.x / 8, v.y / 8, v.z / 8});
    EXPECT_EQ(of_a.voxels, a.size());
    EXPECT_EQ(shared_voxels(of_a, of_b), shared);
    const auto differing = differing_blocks(of_a, of_b);
    EXPECT_EQ(std::set(differing.begin(), differing.end()), blocks);
    std::vector<Index3> only_b;
    for (const Index3 v : b)
      if (a.count(v) == 0) only_b.push_back(v);
    LivePart united = of_a;
    unite(united, part_of(only_b));
    EXPECT_EQ(united.voxels, a.size() + only_b.size());
    EXPECT_EQ(shared_voxels(united, of_b), b.size());
    EXPECT_EQ(shared_voxels(united, of_a), a.size());
  }
}

/// Against the distances of all pairs of voxels.
TEST(LivePart, AreJoinedThatHaveNearVoxelsAndNoOthers) {
  std::mt19937 random(5);
  std::size_t fewer = 0;
  for (int i = 0; i < 60; ++i) {
    const int reach_vox = 1 + i % 6;
    std::vector<std::vector<Index3>> voxels;
    std::set<Index3> taken;
    for (int k = 0; k < 9; ++k) {
      const auto within = [&](std::uint32_t limit) { return static_cast<std::int32_t>(random() % limit); };
      const VoxelBox box{{within(36), within(36), within(36)}, {1 + within(6), 1 + within(6), 1 + within(6)}};
      std::vector<Index3> part;
      box.for_each([&](Index3 v) {
        if (random() % 3 != 0 && taken.insert(v).second) part.push_back(v);
      });
      if (!part.empty()) voxels.push_back(part);
    }
    const auto near = [&](const std::vector<Index3>& a, const std::vector<Index3>& b) {
      for (const Index3 v : a)
        for (const Index3 w : b)
          if (std::max({std::abs(v.x - w.x), std::abs(v.y - w.y), std::abs(v.z - w.z)}) <= reach_vox)
            return true;
      return false;
    };
    std::vector<LivePart> parts;
    for (const auto& part : voxels) parts.push_back(part_of(part));
    for (std::size_t a = 0; a < voxels.size(); ++a)
      for (std::size_t b = 0; b < voxels.size(); ++b)
        EXPECT_EQ(are_near(parts[a], parts[b], reach_vox), near(voxels[a], voxels[b]));
    for (bool again = true; again;) {
      again = false;
      for (std::size_t a = 0; a < voxels.size(); ++a) {
        for (std::size_t b = a + 1; b < voxels.size(); ++b) {
          if (!near(voxels[a], voxels[b])) continue;
          voxels[a].insert(voxels[a].end(), voxels[b].begin(), voxels[b].end());
          voxels.erase(voxels.begin() + static_cast<std::ptrdiff_t>(b));
          again = true;
        }
      }
    }
    fewer += parts.size() - voxels.size();
    const std::vector<LivePart> found = joined(parts, reach_vox);
    ASSERT_EQ(found.size(), voxels.size());
    for (std::size_t k = 0; k < found.size(); ++k) {
      EXPECT_TRUE(differing_blocks(found[k], part_of(voxels[k])).empty());
      EXPECT_EQ(found[k].voxels, voxels[k].size());
      EXPECT_LT((found[k].sum_vox - part_of(voxels[k]).sum_vox).norm(), 1e-9);
    }
  }
  EXPECT_GT(fewer, 20U) << "some were joined";
}

TEST(LiveObjects, TwoThatCrossKeepTheirIds) {
  LiveObjects objects(kVoxel_m);
  for (int step = 0; step < 30; ++step) {
    // A large one goes to the right, a small one to the left, past each other 5 voxels apart.
    EXPECT_EQ(objects.follow({cube({2 * step, 0, 0}, 10), cube({60 - 2 * step, 15, 0}, 6)}, at_s(0.1 * step))
                  .voxels,
              0U);
    ASSERT_EQ(objects.all().size(), 2U);
    EXPECT_EQ(objects.all().at(kFirst).part.voxels, 1000U) << "step " << step;
    EXPECT_EQ(objects.all().at(kFirst + 1).part.voxels, 216U) << "step " << step;
  }
}

TEST(LiveObjects, AFastOneThatSharesNoVoxelIsTheSameWithinItsStep) {
  LiveObjects objects(kVoxel_m);
  objects.follow({cube({0, 0, 0}, 8)}, 0);
  objects.follow({cube({20, 0, 0}, 8)}, at_s(0.1));
  EXPECT_EQ(objects.all().at(kFirst).standing, LiveStanding::kTracked);
  EXPECT_EQ(objects.all().size(), 1U);
  objects.follow({cube({60, 0, 0}, 8)}, at_s(0.2));
  EXPECT_EQ(objects.all().at(kFirst).standing, LiveStanding::kLost) << "too far";
  EXPECT_EQ(objects.all().at(kFirst + 1).standing, LiveStanding::kTracked);
  objects.follow({cube({75, 0, 0}, 2)}, at_s(0.3));
  EXPECT_EQ(objects.all().size(), 3U) << "64 times smaller is another one";
}

TEST(LiveObjects, AfterASplitTheLargerShareKeepsTheIdAndTheUnionHasTheOlderOnes) {
  LiveObjects objects(kVoxel_m);
  objects.follow({cube({0, 0, 0}, 12)}, 0);
  objects.follow({part_of(voxels_of({{0, 0, 0}, {4, 12, 12}})), part_of(voxels_of({{6, 0, 0}, {6, 12, 12}}))},
                 at_s(0.1));
  EXPECT_EQ(objects.all().at(kFirst).part.voxels, 6U * 144);
  EXPECT_EQ(objects.all().at(kFirst + 1).part.voxels, 4U * 144);
  objects.follow({cube({0, 0, 0}, 12)}, at_s(0.2));
  EXPECT_EQ(objects.all().at(kFirst).standing, LiveStanding::kTracked);
  EXPECT_EQ(objects.all().at(kFirst + 1).standing, LiveStanding::kLost);
}

TEST(LiveObjects, ALostOneComesBackWithItsNameOrIsForgotten) {
  LiveObjects objects(kVoxel_m);
  objects.follow({cube({0, 0, 0}, 8)}, 0);
  ASSERT_TRUE(objects.rename(kFirst, "bucket"));
  EXPECT_EQ(objects.find("bucket"), kFirst);
  objects.follow({}, at_s(100.0));  // nothing has changed for long
  EXPECT_FALSE(objects.expire(at_s(101.9)));
  EXPECT_EQ(objects.all().size(), 1U);
  objects.follow({cube({1, 0, 0}, 8)}, at_s(101.9));
  EXPECT_EQ(objects.all().at(kFirst).name, "bucket");
  objects.follow({}, at_s(110.0));
  objects.expire(at_s(112.1));
  EXPECT_TRUE(objects.all().empty());
  EXPECT_EQ(objects.find("bucket"), 0);
  objects.follow({cube({1, 0, 0}, 8)}, at_s(113.0));
  EXPECT_EQ(objects.all().begin()->first, kFirst + 1) << "an id is not given again at once";
  EXPECT_EQ(objects.all().begin()->second.name, "live object 2");
}

TEST(LiveObjects, TheOneThatWasLostFirstMakesRoom) {
  LiveObjects objects(kVoxel_m);
  std::vector<LivePart> parts;
  for (std::int32_t i = 0; i < 15; ++i) parts.push_back(cube({40 * i, 0, 0}, 4));
  EXPECT_EQ(objects.follow(parts, 0).voxels, 0U);
  parts.push_back(cube({0, 200, 0}, 2));
  EXPECT_EQ(objects.follow(parts, at_s(0.1)).voxels, 8U) << "no id is left";
  parts.erase(parts.begin() + 3);
  EXPECT_EQ(objects.follow(parts, at_s(0.2)).voxels, 8U) << "the fourth is looked for still";
  EXPECT_EQ(objects.follow(parts, at_s(0.3)).voxels, 0U);
  EXPECT_EQ(objects.all().at(kFirst + 3).part.voxels, 8U);
}

TEST(LiveObjects, WhatCannotBeDecidedIsRefusedWithWhatIsAllowed) {
  LiveObjects objects(kVoxel_m);
  objects.follow({cube({0, 0, 0}, 8), cube({50, 0, 0}, 6)}, 0);
  const auto said = [](const core::Status& status) {
    return status ? std::string("done") : status.message();
  };
  EXPECT_THAT(said(objects.freeze(kFirst + 7)),
              HasSubstr("cameras see no 'live object 8'; they see: live object 1, "));
  EXPECT_THAT(said(objects.freeze(messages::kLiveId)), HasSubstr("no id was left"));
  EXPECT_THAT(said(objects.restore(kFirst, 0)), HasSubstr("neither frozen nor discarded"));
  EXPECT_THAT(said(objects.rename(kFirst, "live object 2")), HasSubstr("another thing"));
  EXPECT_THAT(said(objects.rename(kFirst, "live object 9")), HasSubstr("give it another one"));
  EXPECT_THAT(said(objects.rename(kFirst, "a\nb")), HasSubstr("printable"));
  EXPECT_THAT(said(objects.rename(kFirst, "")), HasSubstr("is no name"));
  ASSERT_TRUE(objects.discard(kFirst, 0));
  EXPECT_THAT(said(objects.discard(kFirst, 0)), HasSubstr("is discarded already"));
  EXPECT_THAT(said(objects.freeze(kFirst)), HasSubstr("is discarded; allowed: to restore it first"));
  objects.follow({cube({50, 0, 0}, 6)}, at_s(1.0));
  EXPECT_EQ(objects.all().at(kFirst).standing, LiveStanding::kDiscarded) << "cameras are not asked";
}

// Random scenes: every part has one id at most, an id one part at most, and nothing is lost.
TEST(LiveObjects, EveryVoxelThatIsSeenHasOneOwner) {
  std::mt19937 random(7);
  LiveObjects objects(kVoxel_m);
  for (int step = 0; step < 500; ++step) {
    std::vector<LivePart> parts;
    std::size_t seen = 0;
    const auto count = random() % 22;
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto at = static_cast<std::int32_t>(20 * i);
      parts.push_back(cube({at, static_cast<std::int32_t>(random() % 20), 0},
                           2 + static_cast<std::int32_t>(random() % 9)));
      seen += parts.back().voxels;
    }
    const auto now_ns = at_s(0.1 * step);
    objects.expire(now_ns);
    const LivePart rest = objects.follow(parts, now_ns);
    std::size_t owned = rest.voxels;
    std::set<std::string> names;
    for (const auto& [id, object] : objects.all()) {
      EXPECT_TRUE(names.insert(object.name).second);
      if (object.standing == LiveStanding::kTracked) owned += object.part.voxels;
    }
    ASSERT_EQ(owned, seen) << "step " << step;
    EXPECT_LE(objects.all().size(), messages::kMaxLiveObjects);
  }
}

}  // namespace
}  // namespace phantom::wva_server::live_objects_test
