// A workspace that comes by topics, as whoever asks for it now and then gets it.
#include "common/messages/workspace_follower.hpp"

#include <gtest/gtest.h>

#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/workspace/brick_codec.hpp"

namespace phantom::messages {
namespace {

using test::eventually;
using workspace::BrickKey;

constexpr std::size_t kRoom = std::size_t{64} << 20;

/// Sends a workspace as wva_server does.
class StandInServer {
 public:
  void send(const workspace::Workspace& workspace) {
    for (const BrickKey& key : workspace.bricks()) {
      const std::vector<std::uint8_t> voxels = workspace::encode_brick(workspace.brick(key));
      bricks_.write(to_idl(WorkspaceBrick{key, workspace.version, voxels}));
    }
    versions_.write(
        to_idl(WorkspaceVersion{"cell", workspace::description_of(workspace, workspace.content_hash())}));
  }

 private:
  dds::Participant participant_{"wva_server", dds::test_network()};
  dds::Writer<msg::WorkspaceBrick> bricks_{participant_, dds::kWorkspaceBrick};
  dds::Writer<msg::WorkspaceVersion> versions_{participant_, dds::kWorkspaceVersion};
};

/// A version whose first so many bricks have a layer.
workspace::Workspace version_of(std::uint64_t version, std::int32_t bricks) {
  workspace::Workspace made({{0, 0, 0}, 0.01, {32 * 64, 32, 32}}, {0.0F, 9.0F});
  made.version = version;
  for (std::int32_t x = 0; x < bricks; ++x) made.fill_brick(BrickKey{{x, 0, 0}}, 1, 1, 3);
  return made;
}

class Following : public ::testing::Test {
 protected:
  /// Waits until the newest whole version is this one.
  static bool has(WorkspaceFollower& follower, const workspace::Workspace& expected) {
    return eventually([&] {
      const auto newest = follower.take();
      return newest && newest->version == expected.version &&
             newest->content_hash() == expected.content_hash();
    });
  }
  dds::Participant own_{"follower", dds::test_network()};
  std::optional<StandInServer> server_{std::in_place};
};

TEST_F(Following, WhoComesLateGetsTheNewestVersionAndThenEachFurther) {
  server_->send(version_of(1, 3));
  server_->send(version_of(2, 5));
  WorkspaceFollower follower(own_, kRoom);
  ASSERT_TRUE(has(follower, version_of(2, 5)));
  const auto kept = follower.take();
  server_->send(version_of(3, 9));
  EXPECT_TRUE(has(follower, version_of(3, 9)));
  EXPECT_EQ(kept->content_hash(), version_of(2, 5).content_hash())
      << "what somebody looks at stays as it was";
}

// Whoever does not ask for a while must not make the process grow: what waits is dropped, and comes again.
TEST_F(Following, WhatWaitsIsBoundedAndIsAskedForAnew) {
  const auto large = version_of(1, 60), small = version_of(1, 3);
  WorkspaceFollower attentive(own_, kRoom), inattentive(own_, kRoom, 4000);
  server_->send(large);
  ASSERT_TRUE(has(attentive, large));
  EXPECT_EQ(inattentive.take(), nullptr);
  // Readers are made anew while nobody sends: Fast DDS now and then never matches one that is made while the
  // sender is being discovered.
  server_.reset();
  EXPECT_EQ(inattentive.take(), nullptr);
  server_.emplace();
  server_->send(small);
  EXPECT_TRUE(has(inattentive, small));
}

}  // namespace
}  // namespace phantom::messages
