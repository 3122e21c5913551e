// Whose workspace is in force, over a real data space.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <random>
#include <vector>

#include "common/dds/tests/test_network.hpp"
#include "components/phantom_sensing/dds_adapter.hpp"
#include "components/phantom_sensing/tests/server.hpp"
#include "tests/support/child_process.hpp"

namespace phantom::phantom_sensing {
namespace {

using rig::Server;
using testing::HasSubstr;

// Tries phantom_sensing: a second process sends a workspace
// Tries phantom_sensing: its successor comes
TEST(OverDds, TheWorkspaceIsThatOfOneServerAndASecondIsTold) {
  const core::NetworkOptions network = dds::test_network();
  const PhantomModel model = rig::suspended_model();
  const Config config;
  DdsAdapter adapter(network, model);
  std::atomic<int> refused{0};
  WorkspaceSubscriber keeper({[&](const std::string&) { ++refused; }});
  SensingLoop loop(model, config, keeper, adapter);
  adapter.start_reading(loop, keeper);
  std::atomic<bool> sound{false}, reported{false};
  dds::Participant outside("outside", network);
  dds::Reader<msg::ComponentStatus> status(
      outside, dds::kComponentStatus, [&](const msg::ComponentStatus& s, const dds::SampleInfo&) {
        const bool second = s.state() == msg::ComponentState::COMPONENT_DEGRADED &&
                            s.message().to_string().find("two processes send workspace_version") == 0;
        (second ? reported : sound) = true;
      });

  auto first = std::make_unique<Server>(network, 10, "vice");
  ASSERT_TRUE(dds::eventually([&] { return keeper.version() == 10 && adapter.objects().size() == 1; }));
  first->commit(11, std::nan(""));
  EXPECT_TRUE(dds::eventually([&] { return refused == 1; }));
  EXPECT_EQ(keeper.announced(), 10U);

  const Server second(network, 20, "lathe");
  ASSERT_TRUE(dds::eventually([&] { return keeper.contested(); }));
  EXPECT_TRUE(dds::eventually([&] {
    adapter.publish_status({});
    return reported.load();
  }));
  EXPECT_TRUE(sound) << "not told before it could be a successor";
  EXPECT_EQ(keeper.version(), 10U);
  EXPECT_EQ(keeper.announced(), 10U);
  EXPECT_EQ(adapter.objects().at(1).name, "vice");
  first.reset();
  EXPECT_TRUE(dds::eventually([&] { return keeper.version() == 20; }));
  EXPECT_TRUE(dds::eventually([&] { return adapter.objects().at(1).name == "lathe"; }));
  sound = false;
  EXPECT_TRUE(dds::eventually([&] {
    adapter.publish_status({});
    return sound.load();
  }));
  adapter.stop_reading();
}

/// A workspace whose bricks do not compress: 23 MiB, more than is kept beside one in force.
workspace::Workspace large_world() {
  constexpr std::int32_t kEdge = 9;  // bricks
  constexpr std::int32_t kSize = kEdge * workspace::kBrickEdge;
  std::vector<float> palette(256);
  std::iota(palette.begin(), palette.end(), 0.0F);
  workspace::Workspace world({{0, 0, 0}, 0.01, {kSize, kSize, kSize}}, palette);
  std::mt19937 random(7);
  const workspace::BrickLabels labels{std::make_shared<std::int8_t[]>(workspace::kBrickVoxels, 1), nullptr,
                                      1};
  for (std::int32_t i = 0; i < kEdge * kEdge * kEdge; ++i) {
    std::uint8_t* codes = world.make_brick({i % kEdge, i / kEdge % kEdge, i / kEdge / kEdge}, labels);
    std::generate_n(codes, workspace::kBrickVoxels,
                    [&] { return static_cast<std::uint8_t>(1 + random() % 255); });
  }
  return world;
}

/// A server whose workspace is too large to be kept beside the one in force succeeds it all the same.
void expect_a_large_one_succeeds(const core::NetworkOptions& network) {
  const PhantomModel model = rig::suspended_model();
  const Config config;
  DdsAdapter adapter(network, model);
  std::atomic<int> excess{0};
  WorkspaceSubscriber::Callbacks callbacks = adapter.workspace_callbacks();
  callbacks.excess = [&, pass_on = callbacks.excess](const workspace::SourceId& source) {
    ++excess;
    pass_on(source);
  };
  WorkspaceSubscriber keeper(callbacks);
  SensingLoop loop(model, config, keeper, adapter);
  adapter.start_reading(loop, keeper);
  auto first = std::make_unique<Server>(network, 10, "vice");
  ASSERT_TRUE(dds::eventually([&] { return keeper.version() == 10; }));
  const workspace::Workspace large = large_world();
  const Server second(network, 20, "hall", large);
  const bool relayed =
      !network.discovery_servers.empty();  // then Fast DDS forgets nobody until the server says so
  ASSERT_TRUE(dds::eventually([&] { return excess > 0 && (relayed || !keeper.contested()); }));
  EXPECT_EQ(keeper.version(), 10U);
  first.reset();
  EXPECT_TRUE(dds::eventually([&] { return keeper.version() == 20; }, 300.0));
  EXPECT_EQ(keeper.share()->brick_count(), large.brick_count());
  adapter.stop_reading();
}

// Tries phantom_sensing: bricks beyond `workspace.max_mib`
TEST(OverDds, AServerWhoseWorkspaceIsTooLargeToWaitSucceedsTheFirstAllTheSame) {
  expect_a_large_one_succeeds(dds::test_network());
}

TEST(OverDds, WithADiscoveryServerItSucceedsTheFirstToo) {
  core::NetworkOptions network = dds::test_network();
  const int port = 20000 + network.domain;
  network.discovery_servers = {"127.0.0.1:" + std::to_string(port)};
  const test::Process server(
      {"fast-discovery-server", "-i", "0", "-l", "127.0.0.1", "-p", std::to_string(port)},
      test::own_folder() / "server.log");
  expect_a_large_one_succeeds(network);
}

TEST(OverDds, OnASecuredSiteItSucceedsTheFirstToo) {
  core::NetworkOptions network = dds::test_network();
  network.security = test::new_folder() / "security";
  const std::string make = PHANTOM_SOURCE_DIR "/deploy/security/make site " + network.security.string();
  const auto made = test::run_line(make + " --days 1 --domain " + std::to_string(network.domain));
  ASSERT_EQ(made.exit_code, 0) << made.output;
  expect_a_large_one_succeeds(network);
}

}  // namespace
}  // namespace phantom::phantom_sensing
