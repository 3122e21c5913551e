#include "components/workspace_survey/dds_adapter.hpp"

#include "common/dds/endpoint.hpp"
#include "common/dds/stamp.hpp"
#include "common/dds/tests/test_network.hpp"
#include "components/workspace_survey/tests/rig.hpp"

namespace phantom::workspace_survey {
namespace {

/// Stands for wva_server: accepts at once, then says what it is told to.
class Server {
 public:
  explicit Server(msg::WorkspaceOutcome outcome) : outcome_(outcome) {}
  msg::WorkspaceCommand last() {
    const std::lock_guard lock(mutex_);
    return last_;
  }

 private:
  void hear(const msg::WorkspaceCommand& command) {
    {
      const std::lock_guard lock(mutex_);
      last_ = command;
    }
    for (const auto outcome : {msg::WORKSPACE_ACCEPTED, outcome_}) {
      msg::WorkspaceReply reply;
      reply.command().session(command.stamp().session());
      reply.command().sequence_number(command.stamp().sequence_number());
      reply.outcome(outcome);
      reply.message(outcome == msg::WORKSPACE_ACCEPTED ? "wait" : "so be it");
      reply.version(outcome == msg::WORKSPACE_DONE ? 77 : 0);
      writer_.write(reply);
    }
  }

  msg::WorkspaceOutcome outcome_;
  std::mutex mutex_;
  msg::WorkspaceCommand last_;
  dds::Participant participant_{"wva_server", dds::test_network()};
  dds::Writer<msg::WorkspaceReply> writer_{participant_, dds::kWorkspaceReply};
  dds::Reader<msg::WorkspaceCommand> reader_{
      participant_, dds::kWorkspaceCommand,
      [this](const msg::WorkspaceCommand& command, const dds::SampleInfo&) { hear(command); }};
};

TEST(WorkspaceClient, AddsByTextAndMovesWithPoseAndGuard) {
  Server server(msg::WORKSPACE_DONE);
  WorkspaceClient client(dds::test_network());
  const auto added = client.add("name: a", 30.0);
  ASSERT_TRUE(added);
  EXPECT_TRUE(added->done);
  EXPECT_EQ(added->message, "so be it");
  EXPECT_EQ(added->version, 77u);
  EXPECT_EQ(server.last().operation(), msg::WORKSPACE_ADD);
  EXPECT_EQ(server.last().description(), "name: a");
  EXPECT_NE(server.last().stamp().sequence_number(), 0u);
  const geometry::Pose X_WO{geometry::rotation_from_rpy(0.1, 0.2, 3.0), {1, 2, 3}};
  ASSERT_TRUE(client.move("pump", X_WO, 3, 30.0));
  const auto moved = server.last();
  EXPECT_EQ(moved.operation(), msg::WORKSPACE_MOVE);
  EXPECT_EQ(moved.object(), "pump");
  EXPECT_TRUE(moved.sets_guard());
  EXPECT_EQ(moved.guard_vox(), 3);
  const geometry::Pose sent{
      geometry::rotation_from_quaternion(
          {moved.X_WO().qx(), moved.X_WO().qy(), moved.X_WO().qz(), moved.X_WO().qw()}),
      {moved.X_WO().position_m().x(), moved.X_WO().position_m().y(), moved.X_WO().position_m().z()}};
  EXPECT_LT((sent.rotation - X_WO.rotation).norm() + (sent.translation_m - X_WO.translation_m).norm(), 1e-12);
}

TEST(WorkspaceClient, ARefusalAndSilenceAreTold) {
  {
    Server server(msg::WORKSPACE_REFUSED);
    const auto word = WorkspaceClient(dds::test_network()).add("name: a", 30.0);
    ASSERT_TRUE(word);
    EXPECT_FALSE(word->done);
  }
  EXPECT_FALSE(WorkspaceClient(dds::test_network()).add("name: a", 0.3));
}

}  // namespace
}  // namespace phantom::workspace_survey
