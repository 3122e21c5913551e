#include "common/workspace/workspace_sources.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "common/workspace/tests/random_workspace.hpp"

namespace phantom::workspace::workspace_sources_test {
namespace {

constexpr SourceId kFirst{1}, kSecond{2}, kThird{3}, kFourth{4};

void put(WorkspaceSources& sources, const SourceId& from, const Workspace& workspace) {
  for (const BrickKey key : workspace.bricks())
    ASSERT_TRUE(sources.put_brick(from, key, workspace.version, encode_brick(workspace.brick(key))));
}
void send(WorkspaceSources& sources, const SourceId& from, const Workspace& workspace) {
  put(sources, from, workspace);
  ASSERT_TRUE(sources.commit(from, describe(workspace)));
}

/// Another content each, with versions 10, 20, ….
Workspace world(unsigned number) {
  Workspace made = random_workspace(4 + number);
  made.version = 10 * number;
  return made;
}

void expect_in_force(const WorkspaceSources& sources, const SourceId& source, const Workspace& workspace) {
  EXPECT_EQ(sources.in_force(), source);
  ASSERT_TRUE(sources.current());
  EXPECT_EQ(sources.current()->version, workspace.version);
  EXPECT_EQ(sources.current()->content_hash(), workspace.content_hash());
}

TEST(WorkspaceSources, BricksAndVersionsOfASecondServerReplaceNone) {
  const Workspace ours = world(1), next = world(3), theirs = world(2);
  WorkspaceSources sources;
  send(sources, kFirst, ours);
  expect_in_force(sources, kFirst, ours);
  EXPECT_FALSE(sources.contested());
  put(sources, kSecond, theirs);
  EXPECT_TRUE(sources.contested());
  ASSERT_TRUE(sources.commit(kSecond, describe(theirs)));
  expect_in_force(sources, kFirst, ours);
  EXPECT_EQ(sources.announced(), ours.version) << "what another announces is not waited for";
  // The first goes on with a change; bricks of the second come between.
  const auto keys = next.bricks();
  for (const BrickKey key : keys) {
    ASSERT_TRUE(sources.put_brick(kFirst, key, next.version, encode_brick(next.brick(key))));
    for (const BrickKey other : theirs.bricks())
      ASSERT_TRUE(sources.put_brick(kSecond, other, 99, encode_brick(theirs.brick(other))));
  }
  for (const BrickKey key : ours.bricks()) {
    if (next.has_brick(key)) continue;
    ASSERT_TRUE(sources.put_brick(kFirst, key, next.version, {}));
  }
  ASSERT_TRUE(sources.commit(kFirst, describe(next)));
  expect_in_force(sources, kFirst, next);
}

TEST(WorkspaceSources, ASuccessorIsInForceOnceItsWorkspaceIsWhole) {
  const Workspace ours = world(3), theirs = world(2);
  WorkspaceSources sources;
  send(sources, kFirst, ours);
  sources.gone(kFirst);
  expect_in_force(sources, kFirst, ours);
  EXPECT_EQ(sources.announced(), ours.version);
  ASSERT_TRUE(sources.commit(kSecond, describe(theirs)));
  EXPECT_EQ(sources.announced(), theirs.version) << "lower than the one before: its host's clock went back";
  expect_in_force(sources, kFirst, ours);
  put(sources, kSecond, theirs);
  expect_in_force(sources, kSecond, theirs);
  EXPECT_FALSE(sources.contested());
}

TEST(WorkspaceSources, WhoCameSecondTakesOverWhenTheFirstEnds) {
  const Workspace ours = world(1), theirs = world(2);
  WorkspaceSources sources;
  send(sources, kFirst, ours);
  send(sources, kSecond, theirs);
  expect_in_force(sources, kFirst, ours);
  sources.gone(kFirst);
  expect_in_force(sources, kSecond, theirs);
}

// Two hosts' servers change over: what was kept of either is neither lost nor mixed.
TEST(WorkspaceSources, OneThatComesBackBeforeItsSuccessorIsWholeStays) {
  const Workspace ours = world(1), theirs = world(2);
  WorkspaceSources sources;
  send(sources, kFirst, ours);
  sources.gone(kFirst);
  ASSERT_TRUE(sources.commit(kSecond, describe(theirs)));
  const auto bricks = theirs.bricks();
  const auto put_half = [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i)
      ASSERT_TRUE(
          sources.put_brick(kSecond, bricks[i], theirs.version, encode_brick(theirs.brick(bricks[i]))));
  };
  put_half(0, bricks.size() / 2);
  send(sources, kFirst, ours);
  put_half(bricks.size() / 2, bricks.size());
  expect_in_force(sources, kFirst, ours);
  sources.gone(kFirst);
  expect_in_force(sources, kSecond, theirs);
}

TEST(WorkspaceSources, ASecondThatEndsLeavesNothingBehind) {
  const Workspace ours = world(1), theirs = world(2);
  WorkspaceSources sources;
  send(sources, kFirst, ours);
  send(sources, kSecond, theirs);
  sources.gone(kSecond);
  EXPECT_FALSE(sources.contested());
  sources.gone(kFirst);
  expect_in_force(sources, kFirst, ours);
}

TEST(WorkspaceSources, OneThatWasOnlyCutOffIsInForceStill) {
  const Workspace ours = world(1), next = world(2);
  WorkspaceSources sources;
  send(sources, kFirst, ours);
  sources.gone(kFirst);
  send(sources, kFirst, ours);  // durable: all comes again
  expect_in_force(sources, kFirst, ours);
  send(sources, kSecond, next);
  expect_in_force(sources, kFirst, ours);
}

// Tries phantom_sensing: that cannot be one (voxel size … other content
TEST(WorkspaceSources, WhatIsNoVersionIsRefusedAndChangesNothing) {
  const Workspace ours = world(2);
  WorkspaceSources sources;
  send(sources, kFirst, ours);
  const auto refused = [&](auto spoil) {
    VersionDescription bad = describe(ours);
    bad.version += 5;
    spoil(bad);
    EXPECT_FALSE(sources.commit(kFirst, bad));
    EXPECT_EQ(sources.announced(), ours.version) << "judged before it is believed";
    expect_in_force(sources, kFirst, ours);
  };
  refused([](auto& bad) { bad.grid.voxel_size_m = std::numeric_limits<double>::quiet_NaN(); });
  refused([](auto& bad) { bad.grid.voxel_size_m = 0.0; });
  refused([](auto& bad) { bad.grid.origin_m.x() = std::numeric_limits<double>::infinity(); });
  refused([](auto& bad) { bad.grid.size_vox[1] = 0; });
  refused([](auto& bad) { bad.palette_Pa_s_per_m.clear(); });
  refused([](auto& bad) { bad.version = 0; });
  refused([&](auto& bad) { bad.version = ours.version - 1; });
  refused([&](auto& bad) { bad.version = ours.version, bad.content_hash ^= 1; });
  const Workspace next = world(3);
  for (const BrickKey key : ours.bricks()) ASSERT_TRUE(sources.put_brick(kFirst, key, next.version, {}));
  send(sources, kFirst, next);
  expect_in_force(sources, kFirst, next);
}

TEST(WorkspaceSources, OneWhoseVersionIsRefusedFromTheStartBindsNobody) {
  const Workspace theirs = world(2);
  WorkspaceSources sources;
  VersionDescription bad = describe(theirs);
  bad.grid.voxel_size_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(sources.commit(kFirst, bad));
  EXPECT_EQ(sources.announced(), 0U);
  send(sources, kSecond, theirs);
  expect_in_force(sources, kSecond, theirs);
}

TEST(WorkspaceSources, AFourthSourceIsRefusedUntilThereIsRoom) {
  const Workspace ours = world(1);
  WorkspaceSources sources;
  for (const SourceId& source : {kFirst, kSecond, kThird}) send(sources, source, ours);
  const BrickKey key = ours.bricks().front();
  EXPECT_FALSE(sources.put_brick(kFourth, key, 1, encode_brick(ours.brick(key))));
  EXPECT_FALSE(sources.commit(kFourth, describe(ours)));
  sources.gone(kSecond);
  send(sources, kFourth, ours);
  expect_in_force(sources, kFirst, ours);
}

TEST(WorkspaceSources, BesidesTheOneInForceBricksTakeALimitedAmountOfMemory) {
  WorkspaceSources sources;
  const Workspace ours = world(1);
  send(sources, kFirst, ours);
  const auto brick = encode_brick(ours.brick(ours.bricks().front()));
  const auto most = static_cast<std::int32_t>(WorkspaceSources::kMinReceivedBytes / brick.size());
  ASSERT_LT(most, 65536) << "the places below are distinct";
  std::int32_t taken = 0;
  while (taken <= most && sources.put_brick(kSecond, {taken % 256, taken / 256, 0}, 1, brick)) ++taken;
  EXPECT_LE(taken, most);
  EXPECT_GT(taken, most / 2);
  EXPECT_TRUE(sources.put_brick(kSecond, {0, 0, 0}, 2, brick)) << "in place of one that is held";
  sources.gone(kSecond);
  EXPECT_TRUE(sources.put_brick(kThird, {0, 0, 0}, 1, brick))
      << "what a source took is free once it has ended";
  expect_in_force(sources, kFirst, ours);
}

TEST(WorkspaceSources, WhoSendsMoreThanIsKeptBesideTheOneInForceIsForgotten) {
  WorkspaceSources sources;
  const Workspace ours = world(1), theirs = world(2);
  send(sources, kFirst, ours);
  const auto brick = encode_brick(ours.brick(ours.bricks().front()));
  core::Status status = core::Status::ok();
  for (std::int32_t i = 0; status; ++i)
    status = sources.put_brick(kSecond, {i % 256, i / 256 % 256, i / 65536}, 1, brick);
  EXPECT_EQ(status.code(), core::ErrorCode::kResourceExhausted);
  EXPECT_FALSE(sources.contested());
  sources.gone(kFirst);
  EXPECT_FALSE(sources.attended());
  send(sources, kSecond, theirs);  // nothing of what it sent before stands in its way
  expect_in_force(sources, kSecond, theirs);
}

}  // namespace
}  // namespace phantom::workspace::workspace_sources_test
