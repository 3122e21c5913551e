// What may wait at the keeper, and whose bricks are taken.
#include "components/phantom_sensing/workspace/workspace_subscriber.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <limits>
#include <memory>
#include <semaphore>
#include <thread>

#include "common/workspace/brick_codec.hpp"
#include "components/phantom_sensing/tests/rig.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::phantom_sensing {
namespace {

using phantom::test::eventually;
using rig::send;

// Tries phantom_sensing: bricks beyond `workspace.max_mib`
TEST(WorkspaceKeeperBounds, BricksBeyondItsMemoryAreRefusedAndCounted) {
  std::atomic<int> refused = 0;
  WorkspaceSubscriber keeper({[&](const std::string&) { ++refused; }}, std::size_t{1} << 20);
  const workspace::Workspace world = rig::wall();
  const auto brick = workspace::encode_brick(world.brick(world.bricks().front()));
  for (std::int32_t i = 0; i < 100'000; ++i)
    keeper.put_brick({1}, {i % 256, i / 256 % 256, i / 65536}, 1, brick);
  EXPECT_TRUE(eventually([&] { return refused > 0; }));
}

// Tries phantom_sensing: bricks beyond `workspace.max_mib`
TEST(WorkspaceKeeperBounds, WhoSendsTooMuchBesideTheServerInUseIsNamedAndMaySendOnceItHasGone) {
  std::atomic<int> excess = 0, of_server = 0, unattended = 0;
  const workspace::SourceId server{1}, other{2};
  WorkspaceSubscriber keeper({.refused = [](const std::string&) {},
                              .excess = [&](const auto& source) { ++(source == other ? excess : of_server); },
                              .unattended = [&] { ++unattended; }});
  const workspace::Workspace& world = rig::wall();
  for (const workspace::BrickKey key : world.bricks())
    keeper.put_brick(server, key, 1, workspace::encode_brick(world.brick(key)));
  workspace::VersionDescription version = workspace::description_of(world, world.content_hash());
  version.version = 1;
  keeper.commit(server, version);
  ASSERT_TRUE(eventually([&] { return keeper.version() == 1; }));
  const auto brick = workspace::encode_brick(world.brick(world.bricks().front()));
  for (std::int32_t i = 0; i < 60'000; ++i)  // of 320 octets and more each
    keeper.put_brick(other, {i % 256, i / 256 % 256, 0}, 1, brick);
  EXPECT_TRUE(eventually([&] { return excess > 0; }));
  keeper.gone(other);
  EXPECT_TRUE(eventually([&] { return !keeper.contested(); }));
  EXPECT_EQ(unattended, 0);
  keeper.gone(server);
  EXPECT_TRUE(eventually([&] { return unattended == 1; }));
  EXPECT_EQ(of_server, 0);
}

// Tries phantom_sensing: faster than they can be taken
TEST(WorkspaceKeeperBounds, WhatWaitsOfOthersIsBoundedAndTheServerInUseIsHeardAllTheSame) {
  std::atomic<bool> held = false, is_held = false;  // the keeper's thread, as if it got no processor
  std::atomic<int> excess = 0, of_server = 0;
  const workspace::SourceId server{1}, other{2};
  WorkspaceSubscriber keeper(
      {.refused =
           [&](const std::string&) {
             is_held = held.load();
             held.wait(true);
           },
       .excess = [&](const auto& source) { ++(source == other ? excess : of_server); }});
  const auto let_go = [&] {
    held = false;
    held.notify_all();
  };
  const struct AtTheEnd {  // or the keeper's thread would never end
    const std::function<void()> then;
    ~AtTheEnd() { then(); }
  } at_the_end{let_go};
  const workspace::Workspace& world = rig::wall();
  send(world, 1, keeper, server);
  ASSERT_TRUE(eventually([&] { return keeper.version() == 1; }));
  const auto from_other = [&](std::size_t bytes) {
    is_held = false;
    held = true;
    keeper.put_brick(server, {0, 0, 0}, 2, {1, 2, 3});  // no brick: refused
    ASSERT_TRUE(eventually([&] { return is_held.load(); }));
    constexpr std::size_t kEach = std::size_t{64} << 10;
    for (std::size_t sent = 0; sent < bytes; sent += kEach)
      keeper.put_brick(other, {static_cast<std::int32_t>(sent / kEach), 0, 0}, 1,
                       std::vector<std::uint8_t>(kEach));
  };
  const auto goes_on = [&](std::uint64_t version) {
    send(world, version, keeper, server);
    let_go();
    ASSERT_TRUE(eventually([&] { return keeper.version() == version; }));
  };
  from_other(WorkspaceSubscriber::kMaxOfOthers / 2);
  goes_on(2);
  EXPECT_EQ(excess, 0);
  from_other(WorkspaceSubscriber::kMaxOfOthers * 2);
  goes_on(3);
  EXPECT_EQ(excess, 1) << "is named once each time";
  EXPECT_EQ(of_server, 0);
}

// What it lost while the keeper was busy with that departure must be sent again: it is in excess first.
// Tries phantom_sensing: faster than they can be taken
TEST(WorkspaceKeeperBounds, WhoLosesSomethingAsTheServerInUseGoesMaySendItAnew) {
  std::counting_semaphore<> goes_on(0);  // the keeper's thread, once for each sample that is refused
  std::atomic<int> refused = 0, unattended = 0;
  std::string calls;  // by the keeper's thread
  const workspace::SourceId server{1}, other{2};
  {
    WorkspaceSubscriber keeper(
        {.refused =
             [&](const std::string&) {
               ++refused;
               goes_on.acquire();
             },
         .excess = [&](const auto& source) { calls += source == other ? "excess " : "? "; },
         .unattended =
             [&] {
               calls += "unattended ";
               ++unattended;
             }});
    send(rig::wall(), 1, keeper, server);
    EXPECT_TRUE(eventually([&] { return keeper.version() == 1; }));
    const auto refused_one = [&] { keeper.put_brick(server, {0, 0, 0}, 2, {1, 2, 3}); };
    refused_one();
    EXPECT_TRUE(eventually([&] { return refused == 1; }));
    refused_one();  // in one batch with the departure
    keeper.gone(server);
    goes_on.release();
    EXPECT_TRUE(eventually([&] { return refused == 2; }));
    constexpr std::size_t kEach = std::size_t{64} << 10;
    for (std::size_t sent = 0; sent < 2 * WorkspaceSubscriber::kMaxOfOthers; sent += kEach)
      keeper.put_brick(other, {static_cast<std::int32_t>(sent / kEach), 0, 0}, 1,
                       std::vector<std::uint8_t>(kEach));
    goes_on.release(1000);
    EXPECT_TRUE(eventually([&] { return unattended == 1; }));
  }
  EXPECT_EQ(calls, "excess unattended ");
}

// A process must end within seconds, however many versions wait.
TEST(WorkspaceKeeperEnd, DoesNotWaitForWhatIsQueued) {
  constexpr int kQueued = 10'000;
  const core::Status late = core::Status::invalid_argument("too late");
  std::counting_semaphore<> goes_on(0);  // the keeper's thread, once for each sample that is refused
  std::atomic<int> refused = 0;
  auto keeper = std::make_unique<WorkspaceSubscriber>(WorkspaceSubscriber::Callbacks{[&](const std::string&) {
    ++refused;
    goes_on.acquire();
  }});
  keeper->refuse(late);
  EXPECT_TRUE(eventually([&] { return refused == 1; }));
  for (int i = 0; i < kQueued; ++i) keeper->refuse(late);
  goes_on.release();
  EXPECT_TRUE(eventually([&] { return refused == 2; }));  // of the batch of all the others
  std::atomic<bool> ended = false;
  std::jthread end([&] {
    keeper.reset();
    ended = true;
  });
  for (int i = 0; i <= kQueued && !ended; ++i) {
    goes_on.release();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  end.join();
  EXPECT_LT(refused, kQueued) << "each was looked at";
}

}  // namespace
}  // namespace phantom::phantom_sensing
