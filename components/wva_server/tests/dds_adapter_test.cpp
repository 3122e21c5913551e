#include "components/wva_server/dds_adapter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zstd.h>

#include <atomic>
#include <cmath>
#include <map>
#include <memory>
#include <thread>
#include <utility>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/ask.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/workspace/workspace_assembler.hpp"
#include "components/wva_server/dds_adapter_client.hpp"
#include "components/wva_server/mesh_chunks.hpp"
#include "components/wva_server/tests/test_cell.hpp"

namespace phantom::wva_server {
namespace {

geometry::TriangleMesh unpack(const std::vector<std::vector<std::uint8_t>>& chunks, std::uint32_t vertices,
                              std::uint32_t triangles) {
  std::vector<std::uint8_t> packed;
  for (const auto& chunk : chunks) packed.insert(packed.end(), chunk.begin(), chunk.end());
  std::vector<std::uint8_t> plain(12 * (std::size_t{vertices} + triangles));
  EXPECT_EQ(ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size()), plain.size());
  geometry::TriangleMesh mesh;
  EXPECT_TRUE(geometry::mesh_from_bytes(plain.data(), plain.size(), vertices, triangles, mesh));
  return mesh;
}

TEST(MeshChunks, AreSmallEnoughAndMakeTheMeshAgain) {
  const auto mesh = geometry::make_sphere(0.3, 5);
  const auto chunks = mesh_chunks(mesh, 4096);
  EXPECT_GT(chunks.size(), 10U);
  for (const auto& chunk : chunks) {
    EXPECT_LE(chunk.size(), 4096U);
    EXPECT_FALSE(chunk.empty());
  }
  const auto back = unpack(chunks, static_cast<std::uint32_t>(mesh.vertices_m.size()),
                           static_cast<std::uint32_t>(mesh.triangles.size()));
  EXPECT_EQ(back.content_hash(), mesh.content_hash());
}

/// What a consumer of all workspace topics ends up with.
class Consumer {
 public:
  explicit Consumer(const core::NetworkOptions& network)
      : participant_("consumer", network),
        bricks_(participant_, dds::kWorkspaceBrick,
                [this](const msg::WorkspaceBrick& message, const dds::SampleInfo&) {
                  waiter_.change([&] {
                    ++bricks_heard_;
                    const auto brick = messages::from_idl(message);
                    ASSERT_TRUE(brick) << brick.status().message();
                    EXPECT_TRUE(assembler_.put_brick(brick->key, brick->version, brick->voxels_zstd));
                  });
                }),
        versions_(participant_, dds::kWorkspaceVersion,
                  [this](const msg::WorkspaceVersion& message, const dds::SampleInfo&) {
                    waiter_.change([&] {
                      const auto version = messages::from_idl(message);
                      ASSERT_TRUE(version) << version.status().message();
                      EXPECT_TRUE(assembler_.commit(version->description));
                    });
                  }),
        objects_(participant_, dds::kWorkspaceObject,
                 [this](const msg::WorkspaceObject& message, const dds::SampleInfo&) {
                   waiter_.change([&] {
                     const auto object = messages::from_idl(message);
                     ASSERT_TRUE(object) << object.status().message();
                     seen_objects_[object->id] = *object;
                     if (object->removed()) seen_objects_.erase(object->id);
                   });
                 }),
        chunks_(participant_, dds::kMeshChunk, [this](const msg::MeshChunk& message, const dds::SampleInfo&) {
          waiter_.change([&] {
            const auto chunk = messages::from_idl(message);
            ASSERT_TRUE(chunk) << chunk.status().message();
            seen_chunks_[{chunk->mesh_hash, chunk->chunk}] = *chunk;
          });
        }) {}

  bool has_version(std::uint64_t version) {
    return waiter_.wait([&] { return assembler_.current() && assembler_.current()->version == version; });
  }
  bool has_objects(std::size_t objects, std::size_t chunks) {
    return waiter_.wait([&] { return seen_objects_.size() == objects && seen_chunks_.size() == chunks; });
  }
  const workspace::Workspace& workspace() const { return *assembler_.current(); }
  std::size_t take_bricks_heard() { return std::exchange(bricks_heard_, 0); }
  const std::map<std::uint16_t, messages::WorkspaceObject>& objects() const { return seen_objects_; }
  const std::map<std::pair<std::uint64_t, std::uint32_t>, messages::MeshChunk>& chunks() const {
    return seen_chunks_;
  }

 private:
  dds::Waiter waiter_;
  workspace::WorkspaceAssembler assembler_;
  std::size_t bricks_heard_ = 0;
  std::map<std::uint16_t, messages::WorkspaceObject> seen_objects_;
  std::map<std::pair<std::uint64_t, std::uint32_t>, messages::MeshChunk> seen_chunks_;
  dds::Participant participant_;  // the readers below end before what they write to
  dds::Reader<msg::WorkspaceBrick> bricks_;
  dds::Reader<msg::WorkspaceVersion> versions_;
  dds::Reader<msg::WorkspaceObject> objects_;
  dds::Reader<msg::MeshChunk> chunks_;
};

/// A served cell and what it says.
class DdsAdapterTest : public TestCell {
 protected:
  /// Everything of a cell that was just activated.
  static void publish(DdsAdapter& adapter, const LiveCell& cell, std::size_t chunk_bytes = 1024) {
    for (const auto& [id, object] : cell.objects()) adapter.publish_object(object, chunk_bytes);
    layers::WorkspaceChange all;
    all.version = cell.workspace().version;
    all.changed = cell.workspace().bricks();
    adapter.publish_change(cell, all, 2);
  }
  static std::size_t chunk_count(const ServedObject& object) {
    return mesh_chunks(object.mesh_O, 1024).size();
  }
};

// Tries wva_server: a consumer joins late
TEST_F(DdsAdapterTest, EarlyAndLateConsumersHaveTheWholeCell) {
  const LiveCell cell_41 = activated(cell(), 41);
  Consumer early(dds::test_network());
  DdsAdapter adapter(dds::test_network(), "");
  publish(adapter, cell_41);
  Consumer late(dds::test_network());

  const auto& ball = cell_41.objects().at(1);
  const std::size_t chunks =
      chunk_count(ball) + chunk_count(cell_41.objects().at(2));  // both posts share one mesh
  for (Consumer* consumer : {&early, &late}) {
    ASSERT_TRUE(consumer->has_version(41));
    EXPECT_EQ(consumer->workspace().content_hash(), cell_41.content_hash());
    EXPECT_EQ(consumer->workspace().bricks(), cell_41.workspace().bricks());
    ASSERT_TRUE(consumer->has_objects(3, chunks));
  }
  const messages::WorkspaceObject& left = late.objects().at(2);
  EXPECT_EQ(left.name, "left post");
  EXPECT_DOUBLE_EQ(left.X_WO.translation_m.x(), -0.2);
  EXPECT_NEAR(geometry::quaternion_xyzw(left.X_WO.rotation)[2], std::sin(15 * M_PI / 180), 1e-9);
  EXPECT_EQ(left.mesh_hash, late.objects().at(3).mesh_hash);
  EXPECT_EQ(late.objects().at(1).colour[0], 1.0F);

  std::vector<std::vector<std::uint8_t>> pieces;
  messages::MeshChunk last;
  for (const auto& [key, chunk] : late.chunks()) {
    if (key.first != ball.mesh_hash) continue;
    pieces.push_back(chunk.data);
    last = chunk;
  }
  ASSERT_EQ(pieces.size(), last.chunk_count);
  EXPECT_EQ(unpack(pieces, last.vertex_count, last.triangle_count).content_hash(), ball.mesh_hash);
}

// Tries wva_server: a consumer joins late
TEST_F(DdsAdapterTest, AChangeSendsItsBricksOnlyAndEndsRightForEarlyAndLateConsumers) {
  LiveCell live = activated(cell(), 41);
  Consumer early(dds::test_network());
  DdsAdapter adapter(dds::test_network(), "");
  publish(adapter, live);
  ASSERT_TRUE(early.has_version(41));
  early.take_bricks_heard();

  const auto moved = live.apply(
      make_command(WorkspaceOperation::kMove, "ball", 0, {Eigen::Matrix3d::Identity(), {0.1, -0.2, 0.3}}), 42,
      {});
  ASSERT_TRUE(moved);
  adapter.publish_change(live, moved->workspace, 2);
  adapter.publish_object(live.objects().at(1), 1024);
  ASSERT_TRUE(early.has_version(42));
  EXPECT_EQ(early.take_bricks_heard(), moved->workspace.changed.size() + moved->workspace.removed.size());
  EXPECT_LT(moved->workspace.changed.size(), live.workspace().brick_count());

  const auto removed = live.apply(make_command(WorkspaceOperation::kRemove, "right post"), 43, {});
  ASSERT_TRUE(removed);
  EXPECT_FALSE(removed->workspace.removed.empty());
  adapter.publish_change(live, removed->workspace, 2);
  adapter.withdraw_object(removed->id);

  Consumer late(dds::test_network());  // hears of bricks that are gone, and never saw them
  const std::size_t chunks = chunk_count(live.objects().at(1)) + chunk_count(live.objects().at(2));
  for (Consumer* consumer : {&early, &late}) {
    ASSERT_TRUE(consumer->has_version(43));
    EXPECT_EQ(consumer->workspace().content_hash(), live.content_hash());
    EXPECT_EQ(consumer->workspace().bricks(), live.workspace().bricks());
    ASSERT_TRUE(consumer->has_objects(2, chunks));  // the left post still has the mesh
    EXPECT_DOUBLE_EQ(consumer->objects().at(1).X_WO.translation_m.y(), -0.2);
  }
}

TEST_F(DdsAdapterTest, ASuccessorsCellReplacesThatOfAServerThatDied) {
  LiveCell live = activated(cell(), 41);
  Consumer consumer(dds::test_network());
  {
    DdsAdapter first(dds::test_network(), "");
    publish(first, live);
    const auto moved = live.apply(
        make_command(WorkspaceOperation::kMove, "ball", 0, {Eigen::Matrix3d::Identity(), {0.1, -0.2, 0.3}}),
        42, {});
    ASSERT_TRUE(moved);
    first.publish_change(live, moved->workspace, 2);
    ASSERT_TRUE(consumer.has_version(42));
  }
  const LiveCell fewer = activated(cell_with("xyz_m: [0.2, 0.1, 0.15]", "xyz_m: [0.25, -0.2, 0.15]"), 50);
  DdsAdapter second(dds::test_network(), "");
  publish(second, fewer);
  ASSERT_TRUE(consumer.has_version(50));
  EXPECT_EQ(consumer.workspace().content_hash(), fewer.content_hash());
}

/// Who sends commands byte by byte, right and wrong ones.
class Asker {
 public:
  explicit Asker(const core::NetworkOptions& network) : participant_("asker", network) {
    EXPECT_TRUE(dds::eventually([this] { return writer_.matched() > 0 && reader_.matched() > 0; }));
  }
  /// Sends it until something is said about it, as a volatile topic asks for.
  msg::WorkspaceReply ask(msg::WorkspaceCommand command) {
    if (command.stamp().sequence_number() == 0 && !unstamped) command.stamp(stamper_.next());
    EXPECT_TRUE(dds::eventually([&] {
      writer_.write(command);
      return waiter_.wait([&] { return replies_.contains(command.stamp().sequence_number()); },
                          std::chrono::seconds(1));
    }));
    return replies_[command.stamp().sequence_number()];
  }
  bool unstamped = false;

 private:
  dds::Waiter waiter_;
  std::map<std::uint64_t, msg::WorkspaceReply> replies_;  // the newest
  dds::Participant participant_;
  dds::Stamper stamper_{participant_};
  dds::Writer<msg::WorkspaceCommand> writer_{participant_, dds::kWorkspaceCommand};
  dds::Reader<msg::WorkspaceReply> reader_{
      participant_, dds::kWorkspaceReply, [this](const msg::WorkspaceReply& reply, const dds::SampleInfo&) {
        waiter_.change([&] { replies_[reply.command().sequence_number()] = reply; });
      }};
};

msg::WorkspaceCommand move_command() {
  msg::WorkspaceCommand command;
  command.operation(msg::WorkspaceOperation::WORKSPACE_MOVE);
  command.object("ball");
  command.X_WO().position_m().x(0.1);
  command.X_WO().qw(1.0);
  command.requester("test");
  return command;
}

TEST(WorkspaceCommands, ComeInOrderAndAreAnswered) {
  DdsAdapter adapter(dds::test_network(), "");
  Asker asker(dds::test_network());
  const auto accepted = asker.ask(move_command());
  EXPECT_EQ(accepted.outcome(), msg::WorkspaceOutcome::WORKSPACE_ACCEPTED);
  EXPECT_EQ(accepted.requester(), "test");
  const auto command = adapter.next_command(10.0);
  ASSERT_TRUE(command);
  EXPECT_EQ(command->operation, WorkspaceOperation::kMove);
  EXPECT_EQ(command->object, "ball");
  EXPECT_EQ(command->X_WO.translation_m.x(), 0.1);
  EXPECT_FALSE(command->guard_vox) << "who says nothing of the guard leaves it alone";
  adapter.reply(*command, {.outcome = messages::WorkspaceOutcome::kDone, .version = 77, .changed_bricks = 5});
  msg::WorkspaceCommand again = move_command();
  again.stamp().session(command->stamp.session);
  again.stamp().sequence_number(command->stamp.sequence_number);
  EXPECT_TRUE(
      dds::eventually([&] { return asker.ask(again).outcome() == msg::WorkspaceOutcome::WORKSPACE_DONE; }));
  EXPECT_EQ(asker.ask(again).version(), 77U);
  EXPECT_FALSE(adapter.next_command(0.0)) << "what is sent again is not carried out again";
}

// Tries wva_server: a pose that is not finite
TEST(WorkspaceCommands, WhatCannotBeUsedIsRefusedAtOnceWithTheField) {
  DdsAdapter adapter(dds::test_network(), "");
  Asker asker(dds::test_network());
  const auto refused = [&](auto change) {
    msg::WorkspaceCommand command = move_command();
    change(command);
    const auto reply = asker.ask(command);
    EXPECT_EQ(reply.outcome(), msg::WorkspaceOutcome::WORKSPACE_REFUSED);
    return reply.message().to_string();
  };
  EXPECT_THAT(refused([](auto& c) { c.X_WO().position_m().y(std::nan("")); }),
              testing::HasSubstr("X_WO.position_m"));
  asker.unstamped = true;
  EXPECT_THAT(refused([](auto&) {}), testing::HasSubstr("stamp.sequence_number is 0"));
  EXPECT_FALSE(adapter.next_command(0.0));
}

TEST(WorkspaceCommands, AServerThatTakesNoneSaysSo) {
  DdsAdapter adapter(dds::test_network(), "this wva_server takes no commands (accept_commands is false)");
  Asker asker(dds::test_network());
  const auto reply = asker.ask(move_command());
  EXPECT_EQ(reply.outcome(), msg::WorkspaceOutcome::WORKSPACE_REFUSED);
  EXPECT_THAT(reply.message().to_string(), testing::HasSubstr("accept_commands"));
  EXPECT_FALSE(adapter.next_command(0.0));
}

// Tries wva_server: a second wva_server publishes
TEST_F(DdsAdapterTest, ASecondServerIsNoticedByBoth) {
  const LiveCell live = activated(cell(), 41);
  auto first = std::make_unique<DdsAdapter>(dds::test_network(), "");
  publish(*first, live);
  DdsAdapter second(dds::test_network(), "");
  EXPECT_TRUE(dds::eventually([&] { return second.has_rival(); }));
  EXPECT_FALSE(first->has_rival()) << "the second has published nothing yet, and its own does not count";
  publish(second, live);
  EXPECT_TRUE(dds::eventually([&] { return first->has_rival(); }));

  dds::Participant outside("outside", dds::test_network());
  std::atomic<bool> told{false}, sound{false};
  dds::Reader<msg::ComponentStatus> statuses(
      outside, dds::kComponentStatus, [&](const msg::ComponentStatus& status, const dds::SampleInfo&) {
        const bool rival = status.state() == msg::ComponentState::COMPONENT_DEGRADED &&
                           status.message().to_string().find("two processes send workspace_version") == 0;
        (rival ? told : sound) = true;
      });
  EXPECT_TRUE(dds::eventually([&] {
    second.report({core::ComponentState::kRunning, "", {}, {}});
    return told.load();
  }));
  first.reset();
  EXPECT_TRUE(dds::eventually([&] { return !second.has_rival(); }));
  sound = false;
  EXPECT_TRUE(dds::eventually([&] {
    second.report({core::ComponentState::kRunning, "", {}, {}});
    return sound.load();
  }));
}

TEST_F(DdsAdapterTest, TheClientHearsTheLastWordAndListsWhatIsServed) {
  LiveCell live = activated(cell(), 41);
  DdsAdapter adapter(dds::test_network(), "");
  publish(adapter, live);
  adapter.withdraw_object(2);
  std::thread server([&] {
    const auto command = adapter.next_command(30.0);
    ASSERT_TRUE(command);
    adapter.reply(*command, {.outcome = messages::WorkspaceOutcome::kDone, .message = "done so"});
  });
  std::vector<std::string> accepted;
  const WorkspaceCommand remove = make_command(WorkspaceOperation::kRemove, "ball");
  const auto reply =
      messages::ask(dds::test_network(), "asking", remove, 30.0,
                    [&](const messages::WorkspaceReply& early) { accepted.push_back(early.message); });
  server.join();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->message, "done so");
  EXPECT_FALSE(messages::ask(dds::test_network(), "asking", remove, 0.5)) << "nobody replies";

  adapter.report({core::ComponentState::kRunning, "", {}, {{"version", 41, ""}, {"objects", 2, ""}}});
  const auto listing = list_objects(dds::test_network(), 30.0);
  ASSERT_TRUE(listing);
  EXPECT_EQ(listing->cell, "desk");
  EXPECT_EQ(listing->version, 41U);
  ASSERT_EQ(listing->objects.size(), 2U);
  EXPECT_EQ(listing->objects[1].name, "right post");
  EXPECT_EQ(listing->objects[1].X_WO.translation_m.x(), 0.2);
}

}  // namespace
}  // namespace phantom::wva_server
