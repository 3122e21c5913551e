// A live workspace is always what its objects make when they are activated all at once, and says truly what
// changed.
#include "common/layers/live_workspace.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <climits>
#include <cstring>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "tests/support/same_content.hpp"

namespace phantom::layers {
namespace {

using phantom::test::expect_same_content;
using phantom::test::objects_of;
using testing::HasSubstr;

const workspace::GridSpec kLiveGrid{{-0.5, -0.4, 0.0}, 0.01, {100, 90, 70}};

const workspace::LayerProfile kCell{{2, 3}, {30.0F, 20.0F}, 100.0F, 0};
const workspace::LayerProfile kAsCell{{4}, {20.0F}, 100.0F, 1};  // other layers, the same viscosities
const workspace::LayerProfile kOwn{{3, 2, 2}, {50.0F, 25.0F, 5.0F}, 120.0F, 0};

struct Thing {
  Body body;
  std::int64_t priority = 0;
};

Body random_body(std::uint16_t id, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto size_m = [&] { return 0.05 + 0.1 * std::abs(unit(random)); };
  const geometry::TriangleMesh shapes[] = {geometry::make_sphere(size_m(), 3),
                                           geometry::make_box({size_m(), size_m(), size_m()}),
                                           geometry::make_torus(0.1, 0.03)};
  const workspace::LayerProfile profiles[] = {kCell, kCell, kAsCell, kOwn};
  const geometry::Pose pose{
      geometry::rotation_from_rpy(3 * unit(random), 3 * unit(random), 3 * unit(random)),
      {0.6 * unit(random), 0.5 * unit(random), 0.35 + 0.45 * unit(random)}};  // also half outside
  return {"thing " + std::to_string(id), id, shapes[random() % 3].transformed(pose), profiles[random() % 4]};
}

/// All at once, from nothing.
workspace::Workspace from_scratch(const std::vector<Thing>& things, MergeLaw law) {
  std::vector<workspace::LayerProfile> profiles;
  for (const Thing& thing : things) profiles.push_back(thing.body.profile);
  workspace::Workspace workspace(kLiveGrid, workspace::make_palette(profiles).value());
  std::vector<workspace::ObjectBricks> bricks;
  std::vector<workspace::CodeTable> codes;
  for (const Thing& thing : things) {
    bricks.push_back(activate_object(thing.body, kLiveGrid).value().bricks);
    codes.push_back(workspace::code_table(thing.body.profile, workspace.palette()));
  }
  std::vector<MergeEntry> entries;
  for (std::size_t i = 0; i < things.size(); ++i) {
    const auto latest =
        static_cast<std::int64_t>(i);  // things stand in the order in which they came or moved last
    entries.push_back({&bricks[i], things[i].body.id, &codes[i],
                       law == MergeLaw::kLatestObject ? latest : things[i].priority});
  }
  merge_bricks(law, entries, keys_of(entries), workspace);
  return workspace;
}

bool same_brick(const workspace::Workspace& a, const workspace::Workspace& b, workspace::BrickKey key) {
  return a.has_brick(key) == b.has_brick(key) &&
         std::memcmp(a.brick(key).mu_code, b.brick(key).mu_code, workspace::kBrickVoxels) == 0 &&
         std::memcmp(a.brick(key).order, b.brick(key).order, workspace::kBrickVoxels) == 0 &&
         objects_of(a, key) == objects_of(b, key);
}

/// The change names exactly the bricks in which the workspace differs from what it was.
void expect_told(const workspace::Workspace& before, const workspace::Workspace& now,
                 const WorkspaceChange& change) {
  std::vector<workspace::BrickKey> changed, removed;
  std::vector<workspace::BrickKey> keys = before.bricks();
  for (const workspace::BrickKey key : now.bricks()) keys.push_back(key);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  for (const workspace::BrickKey key : keys) {
    if (!now.has_brick(key)) {
      removed.push_back(key);
    } else if (!same_brick(before, now, key)) {
      changed.push_back(key);
    }
  }
  EXPECT_EQ(change.changed, changed);
  EXPECT_EQ(change.removed, removed);
}

class AnySequence : public testing::TestWithParam<MergeLaw> {};

TEST_P(AnySequence, OfChangesEndsInWhatItsObjectsMakeFromScratch) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    std::mt19937 random(seed);
    LiveWorkspace live(kLiveGrid, GetParam());
    std::vector<Thing> things;
    std::uint16_t next_id = 1;
    for (std::uint64_t version = 1; version <= 25; ++version) {
      const workspace::Workspace before = live.workspace();
      core::Expected<WorkspaceChange> change{core::Status::not_found("")};
      const auto choice = random() % 5;
      const std::size_t which = things.empty() ? 0 : random() % things.size();
      if (things.size() < 2 || (choice < 2 && things.size() < 7)) {
        std::vector<Thing> added;
        const auto count = 1 + random() % 2;
        for (std::size_t i = 0; i < count; ++i)
          added.push_back({random_body(next_id++, random), static_cast<std::int64_t>(random() % 3)});
        std::vector<LiveBody> bodies;
        for (const Thing& thing : added) bodies.push_back({&thing.body, thing.priority});
        change = live.add(bodies, version, {.threads = 1 + static_cast<int>(random() % 2)});
        things.insert(things.end(), added.begin(), added.end());
      } else if (choice == 2) {
        change = live.remove(things[which].body.id, version);
        things.erase(things.begin() + static_cast<std::ptrdiff_t>(which));
      } else {
        Thing moved = things[which];
        moved.body = random_body(moved.body.id, random);
        change = live.move(moved.body, version);
        things.erase(things.begin() + static_cast<std::ptrdiff_t>(which));
        things.push_back(moved);  // it is the latest now
      }
      ASSERT_TRUE(change) << change.status().message();
      EXPECT_EQ(change->version, version);
      EXPECT_EQ(live.workspace().version, version);
      EXPECT_EQ(live.object_count(), things.size());
      const workspace::Workspace expected = from_scratch(things, GetParam());
      ASSERT_NO_FATAL_FAILURE(expect_same_content(live.workspace(), expected))
          << "seed " << seed << " version " << version;
      EXPECT_EQ(live.content_hash(), live.workspace().content_hash());
      EXPECT_FALSE(change->codes_changed) << "there are free codes for these viscosities";
      expect_told(before, live.workspace(), *change);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, AnySequence,
                         testing::Values(MergeLaw::kHighestViscosity, MergeLaw::kLatestObject,
                                         MergeLaw::kObjectPriority));

class Live : public testing::Test {
 protected:
  static Body ball(std::uint16_t id, const Eigen::Vector3d& at_m,
                   const workspace::LayerProfile& profile = kCell) {
    return {"ball", id, geometry::make_sphere(0.06, 3).transformed({Eigen::Matrix3d::Identity(), at_m}),
            profile};
  }
  void SetUp() override {
    const LiveBody bodies[] = {{&left_, 0}, {&right_, 0}};
    ASSERT_TRUE(live_.add(bodies, 5));
    hash_of_both_ = live_.workspace().content_hash();
    expect_same_content(live_.workspace(), from_scratch({{left_}, {right_}}, MergeLaw::kHighestViscosity));
  }
  void expect_as_before() {
    EXPECT_EQ(live_.workspace().version, 5U);
    EXPECT_EQ(live_.object_count(), 2U);
    EXPECT_EQ(live_.workspace().content_hash(), hash_of_both_);
    EXPECT_EQ(live_.content_hash(), hash_of_both_);
  }
  Body left_ = ball(1, {-0.3, 0, 0.3}), right_ = ball(2, {0.3, 0, 0.3});
  LiveWorkspace live_{kLiveGrid, MergeLaw::kHighestViscosity};
  std::uint64_t hash_of_both_ = 0;
};

TEST_F(Live, TouchesOnlyTheBricksThatTheObjectLeavesAndEnters) {
  const Body moved = ball(2, {0.3, 0.05, 0.3});
  std::vector<workspace::BrickKey> reach = activate_object(right_, kLiveGrid).value().bricks.keys();
  const auto there = activate_object(moved, kLiveGrid);
  ASSERT_TRUE(there);
  for (const workspace::BrickKey key : there->bricks.keys()) reach.push_back(key);
  const auto change = live_.move(moved, 6);
  ASSERT_TRUE(change);
  EXPECT_FALSE(change->changed.empty());
  EXPECT_LT(change->changed.size(), live_.workspace().brick_count());
  for (const workspace::BrickKey key : change->changed) EXPECT_THAT(reach, testing::Contains(key));
  for (const workspace::BrickKey key : change->removed) EXPECT_THAT(reach, testing::Contains(key));
}

TEST_F(Live, AMoveToTheSamePlaceChangesNothingButTheVersion) {
  const auto change = live_.move(right_, 6);
  ASSERT_TRUE(change);
  EXPECT_TRUE(change->changed.empty() && change->removed.empty());
  EXPECT_EQ(live_.workspace().version, 6U);
  EXPECT_EQ(live_.content_hash(), hash_of_both_);
}

TEST_F(Live, VoxelsOfTheCallersMakeWhatTheirBodyMakes) {
  std::mt19937 random(3);
  for (const MergeLaw law :
       {MergeLaw::kHighestViscosity, MergeLaw::kLatestObject, MergeLaw::kObjectPriority}) {
    LiveWorkspace live(kLiveGrid, law), twin(kLiveGrid, law);
    const Body first = random_body(1, random), second = random_body(2, random),
               moved = random_body(2, random);
    const LiveBody one[] = {{&first, 0}}, both[] = {{&first, 0}, {&moved, 0}};
    ASSERT_TRUE(live.add(one, 1));
    const auto put = [&](const Body& body, std::vector<workspace::BrickKey> touched, std::uint64_t version) {
      auto bricks = activate_object(body, kLiveGrid).value().bricks;
      touched.insert(touched.end(), bricks.keys().begin(), bricks.keys().end());
      return live.put({{2, std::move(bricks), body.profile, std::move(touched)}}, version);
    };
    ASSERT_TRUE(put(second, {}, 2));
    ASSERT_TRUE(put(moved, activate_object(second, kLiveGrid).value().bricks.keys(), 3));
    ASSERT_TRUE(twin.add(both, 1));
    expect_same_content(live.workspace(), twin.workspace());
    EXPECT_EQ(live.content_hash(), live.workspace().content_hash());
    // Nothing of it is left, though its μ keep their codes.
    ASSERT_TRUE(
        live.put({{2, {}, moved.profile, activate_object(moved, kLiveGrid).value().bricks.keys()}}, 4));
    LiveWorkspace alone(kLiveGrid, law);
    ASSERT_TRUE(alone.add(one, 1));
    expect_same_content(live.workspace(), alone.workspace());
    EXPECT_FALSE(live.put({{2, {}, moved.profile, {}}}, 4)) << "the version does not rise";
    EXPECT_FALSE(live.put({{0, {}, moved.profile, {}}}, 5));
  }
}

TEST_F(Live, VoxelsOfSeveralObjectsAreOneChangeOrNone) {
  std::mt19937 random(9);
  const Body first = random_body(1, random), second = random_body(2, random);
  const auto computed = [](const Body& body) {
    auto bricks = activate_object(body, kLiveGrid).value().bricks;
    auto touched = bricks.keys();
    return ComputedObject{body.id, std::move(bricks), body.profile, std::move(touched)};
  };
  LiveWorkspace live(kLiveGrid, MergeLaw::kHighestViscosity), twin(kLiveGrid, MergeLaw::kHighestViscosity);
  const LiveBody both[] = {{&first, 0}, {&second, 0}};
  ASSERT_TRUE(twin.add(both, 1));
  Body nobody = second;
  nobody.id = 0;
  EXPECT_FALSE(live.put({computed(first), computed(nobody)}, 1));
  EXPECT_EQ(live.object_count(), 0U);
  EXPECT_EQ(live.workspace().brick_count(), 0U);
  ASSERT_TRUE(live.put({computed(first), computed(second)}, 1));
  expect_same_content(live.workspace(), twin.workspace());
  EXPECT_EQ(live.content_hash(), live.workspace().content_hash());
}

TEST_F(Live, SolidsAreThoseOfTheObjectsThatCount) {
  std::mt19937 random(4);
  LiveWorkspace live(kLiveGrid, MergeLaw::kHighestViscosity);
  const Body first = random_body(1, random), second = random_body(2, random);
  const LiveBody both[] = {{&first, 0}, {&second, 0}};
  ASSERT_TRUE(live.add(both, 1));
  const auto bricks_1 = activate_object(first, kLiveGrid).value().bricks;
  const auto bricks_2 = activate_object(second, kLiveGrid).value().bricks;
  const workspace::BitVolume all = live.solid([](std::uint16_t) { return true; }),
                             without_second = live.solid([](std::uint16_t id) { return id != 2; });
  std::size_t wrong = 0, solids = 0;
  workspace::VoxelBox::of(kLiveGrid).for_each([&](workspace::Index3 v) {
    const bool in_1 = bricks_1.at(v) >= workspace::kOrderBoundary,
               in_2 = bricks_2.at(v) >= workspace::kOrderBoundary;
    solids += in_1 ? 1 : 0;
    wrong += (all.get(v) != (in_1 || in_2)) + (without_second.get(v) != in_1);
  });
  EXPECT_GT(solids, 100U);
  EXPECT_EQ(wrong, 0U);
}

TEST_F(Live, AViscosityOfItsOwnChangesOnlyTheBricksThatItsObjectTouches) {
  const Body odd = ball(3, {0, 0, 0.3}, kOwn);
  const auto reach = activate_object(odd, kLiveGrid).value().bricks.keys();
  const workspace::Workspace before = live_.workspace();
  const LiveBody bodies[] = {{&odd, 0}};
  const auto added = live_.add(bodies, 6);
  ASSERT_TRUE(added);
  EXPECT_FALSE(added->codes_changed);
  EXPECT_THAT(live_.workspace().palette(),
              testing::IsSupersetOf({0.F, 5.F, 20.F, 25.F, 30.F, 50.F, 100.F, 120.F}));
  EXPECT_EQ(added->changed, reach);
  EXPECT_LT(reach.size(), live_.workspace().brick_count());
  expect_same_content(live_.workspace(),
                      from_scratch({{left_}, {right_}, {odd}}, MergeLaw::kHighestViscosity));
  const auto removed = live_.remove(3, 7);
  ASSERT_TRUE(removed);
  for (const workspace::BrickKey key : removed->changed) EXPECT_THAT(reach, testing::Contains(key));
  expect_same_content(live_.workspace(), before);
}

TEST_F(Live, MoreViscositiesThanThereIsRoomBetweenOthersGiveAllCodesAnew) {
  Body graded = ball(3, {0, 0, 0.3});
  graded.profile.thickness_vox.assign(9, 1);
  graded.profile.mu_Pa_s_per_m = {29, 28, 27, 26, 25, 24, 23, 22, 21};  // between the others' 30 and 20
  const LiveBody bodies[] = {{&graded, 0}};
  const auto added = live_.add(bodies, 6);
  ASSERT_TRUE(added);
  EXPECT_TRUE(added->codes_changed);
  EXPECT_EQ(added->changed.size(), live_.workspace().brick_count());
  expect_same_content(live_.workspace(),
                      from_scratch({{left_}, {right_}, {graded}}, MergeLaw::kHighestViscosity));
}

TEST_F(Live, WithoutObjectsItIsEmpty) {
  ASSERT_TRUE(live_.remove(1, 6));
  const auto last = live_.remove(2, 7);
  ASSERT_TRUE(last);
  EXPECT_EQ(live_.workspace().brick_count(), 0U);
  EXPECT_EQ(live_.content_hash(),
            workspace::Workspace(kLiveGrid, live_.workspace().palette()).content_hash());
}

TEST_F(Live, RefusesWhatCannotBeAndStaysAsItWas) {
  const auto refusal = [](const core::Expected<WorkspaceChange>& change) {
    return change ? std::string("accepted") : change.status().message();
  };
  const Body again = ball(2, {0, 0, 0.3}), fresh = ball(3, {0, 0, 0.3});
  const Body huge{"tower", 4, geometry::make_sphere(5000, 2), kCell};
  Body zero = fresh;
  zero.id = 0;
  const LiveBody good_then_taken[] = {{&fresh, 0}, {&again, 0}}, good_then_huge[] = {{&fresh, 0}, {&huge, 0}},
                 none[] = {{&zero, 0}};
  EXPECT_THAT(refusal(live_.add(good_then_taken, 6)), HasSubstr("object 2: is there already"));
  EXPECT_THAT(refusal(live_.add(good_then_huge, 6)), HasSubstr("'tower'"));
  EXPECT_THAT(refusal(live_.add(none, 6)), HasSubstr("1 to 65534"));
  EXPECT_THAT(refusal(live_.move(fresh, 6)), HasSubstr("object 3: is not there"));
  EXPECT_THAT(refusal(live_.remove(9, 6)), HasSubstr("object 9: is not there"));
  EXPECT_THAT(refusal(live_.remove(1, 5)), HasSubstr("version 5 does not rise above 5"));
  Body rising = right_;
  rising.profile.mu_Pa_s_per_m = {20.0F, 30.0F};
  EXPECT_THAT(refusal(live_.move(rising, 6)), HasSubstr("fall"));
  expect_as_before();
}

TEST_F(Live, RefusesMoreViscositiesThanThereAreCodesAndStaysAsItWas) {
  Body many = ball(3, {0, 0, 0.3}), more = ball(4, {0, 0, 0.3}), most = ball(5, {0, 0, 0.3});
  float mu = 99.0F;
  for (Body* body : {&many, &more, &most}) {
    body->profile.thickness_vox.assign(90, 1);
    body->profile.mu_Pa_s_per_m.clear();
    for (int i = 0; i < 90; ++i) body->profile.mu_Pa_s_per_m.push_back(mu -= 0.3F);
  }
  const LiveBody all[] = {{&many, 0}, {&more, 0}, {&most, 0}};
  const auto refused = live_.add(all, 6);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.status().message(), HasSubstr("256"));
  expect_as_before();
}

TEST_F(Live, EndsWhenAskedToAndStaysAsItWas) {
  const auto ended = live_.move(ball(2, {0, 0, 0.3}), 6, {.keep_going = [] { return false; }});
  ASSERT_FALSE(ended);
  EXPECT_EQ(ended.status().code(), core::ErrorCode::kUnavailable);
  expect_as_before();
}

/// Merging, which follows activation, is asked again and again. Whenever it ends, in place or with other
/// codes, everything is as it was.
class MergingEnds : public testing::TestWithParam<workspace::LayerProfile> {};

TEST_P(MergingEnds, WheneverItIsAskedToAndStaysAsItWas) {
  const workspace::GridSpec grid{{-1.5, -1.5, -1.5}, 0.01, {300, 300, 300}};
  const Body ball{"ball", 1, geometry::make_sphere(0.5, 3), kCell};
  const Body next{"next", 2,
                  geometry::make_box({1.6, 1.6, 1.6}).transformed({Eigen::Matrix3d::Identity(), {0.3, 0, 0}}),
                  GetParam()};
  LiveWorkspace live(grid, MergeLaw::kHighestViscosity);
  const LiveBody first[] = {{&ball, 0}}, second[] = {{&next, 0}};
  ASSERT_TRUE(live.add(first, 1));
  const workspace::Workspace before = live.workspace();
  int asked = 0, until = INT_MAX;
  ActivationOptions options;
  options.keep_going = [&] { return ++asked <= until; };
  int activating = 0;
  options.on_progress = [&](double) { activating = asked; };
  LiveWorkspace whole = live;
  ASSERT_TRUE(whole.add(second, 2, options));
  const int all = asked;
  ASSERT_GE(all, activating + 4) << "merging is not asked often enough for this test";
  for (until = activating; until < all; ++until) {
    asked = 0;
    const auto ended = live.add(second, 2, options);
    ASSERT_FALSE(ended) << until;
    EXPECT_EQ(ended.status().code(), core::ErrorCode::kUnavailable);
    EXPECT_EQ(live.content_hash(), before.content_hash());
    EXPECT_EQ(live.workspace().content_hash(), before.content_hash());
    EXPECT_EQ(live.object_count(), 1U);
  }
  until = INT_MAX;
  ASSERT_TRUE(live.add(second, 2, options));
  EXPECT_EQ(live.content_hash(), whole.workspace().content_hash());
}

/// As many viscosities between kCell's as have no room there.
workspace::LayerProfile crowding() {
  workspace::LayerProfile profile{{}, {}, 100.0F, 0};
  for (int i = 1; i < 10; ++i) {
    profile.thickness_vox.push_back(1);
    profile.mu_Pa_s_per_m.push_back(30.0F - static_cast<float>(i));
  }
  return profile;
}

INSTANTIATE_TEST_SUITE_P(CodesStayOrChange, MergingEnds, testing::Values(kCell, kOwn, crowding()));

TEST_F(Live, WorkOfAChangeIsCountedAndOneStepTooFewRefusesIt) {
  const Body again = ball(1, {0.1, 0.1, 0.3}, kOwn);
  const workspace::Workspace before = live_.workspace();
  core::WorkBudget enough;
  LiveWorkspace copy = live_;
  ASSERT_TRUE(copy.move(again, 99, {.budget = &enough}));
  core::WorkBudget exact(enough.spent()), little(enough.spent() - 1);
  copy = live_;
  EXPECT_TRUE(copy.move(again, 99, {.budget = &exact}));
  const auto refused = live_.move(again, 99, {.budget = &little});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.status().message(), HasSubstr("merging its layers takes more than"));
  EXPECT_EQ(live_.workspace().content_hash(), before.content_hash());
}

TEST(MergeSteps, RiseWithBricksAndObjects) {
  const std::uint64_t million = 1'000'000;
  EXPECT_LT(LiveWorkspace::merge_steps(937, 17, 2 * 937), 10 * million);        // the shipped cell, all of it
  EXPECT_GT(LiveWorkspace::merge_steps(262'144, 1, 262'144), 1000 * million);   // the largest workspace
  EXPECT_GT(LiveWorkspace::merge_steps(64'000, 4096, 64'000), 1000 * million);  // many bricks of many objects
  EXPECT_LT(LiveWorkspace::merge_steps(27, 4096, 27 * 4096), 100 * million);    // a small one among many
}

TEST(LiveProgress, RisesOverAllBodiesAndTellsOfEach) {
  std::mt19937 random(1);
  const Body one = random_body(1, random), two = random_body(2, random), three = random_body(3, random);
  const LiveBody bodies[] = {{&one, 0}, {&two, 0}, {&three, 0}};
  std::vector<double> shares;
  std::vector<std::string> told;
  LiveWorkspace live(kLiveGrid, MergeLaw::kHighestViscosity);
  ASSERT_TRUE(live.add(bodies, 1, {.on_progress = [&](double share) { shares.push_back(share); }},
                       [&](const Body& body, const BodyReport& report, std::size_t done) {
                         told.push_back(body.name + " " + std::to_string(done));
                         EXPECT_GT(report.mesh.triangles, 0U);
                       }));
  EXPECT_THAT(told, testing::ElementsAre("thing 1 1", "thing 2 2", "thing 3 3"));
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  ASSERT_FALSE(shares.empty());
  EXPECT_GE(shares.front(), 0.0);
  EXPECT_LE(shares.back(), 1.0);
}

}  // namespace
}  // namespace phantom::layers
