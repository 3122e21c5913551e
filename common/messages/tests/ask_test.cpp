#include "common/messages/ask.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "common/dds/endpoints/topics.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/command_service.hpp"

namespace phantom::messages {
namespace {

/// Stands for wva_server: accepts at once, then answers with a given outcome, if `held` once it is released.
class Server {
 public:
  explicit Server(WorkspaceOutcome outcome, bool held = false)
      : outcome_(outcome), released_(!held), thread_([this](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            if (const auto command = service_.next(0.01)) answer(*command);
          }
        }) {}
  ~Server() { release(); }
  void release() {
    released_ = true;
    released_.notify_all();
  }
  WorkspaceCommand last() {
    const std::lock_guard lock(mutex_);
    return last_;
  }

 private:
  void answer(const WorkspaceCommand& command) {
    {
      const std::lock_guard lock(mutex_);
      last_ = command;
    }
    released_.wait(false);
    service_.complete(command.stamp, {.outcome = outcome_,
                                      .message = "so be it",
                                      .version = outcome_ == WorkspaceOutcome::kDone ? 77U : 0U});
  }

  WorkspaceOutcome outcome_;
  std::atomic<bool> released_;
  std::mutex mutex_;
  WorkspaceCommand last_;
  dds::Participant participant_{"wva_server", dds::test_network()};
  CommandService<WorkspaceCommand, WorkspaceReply> service_{
      participant_,
      dds::kWorkspaceCommand,
      dds::kWorkspaceReply,
      {.refused =
           [](const WorkspaceCommand&, const std::string& why) {
             return WorkspaceReply{.outcome = WorkspaceOutcome::kRefused, .message = why};
           },
       .accepted =
           [](const WorkspaceCommand&, std::size_t) {
             return WorkspaceReply{.outcome = WorkspaceOutcome::kAccepted, .message = "wait"};
           }}};
  std::jthread thread_;
};

std::optional<WorkspaceReply> add(double timeout_s,
                                  const std::function<void(const WorkspaceReply&)>& on_accepted = {}) {
  WorkspaceCommand command;
  command.operation = WorkspaceOperation::kAdd;
  command.description = "name: a";
  return ask(dds::test_network(), "asking", command, timeout_s, on_accepted);
}

TEST(Ask, AnObjectIsAddedByTextAndMovedWithPoseAndGuard) {
  // Acceptance is told before the end, even where its first reply came before the endpoints were matched.
  Server server(WorkspaceOutcome::kDone, true);
  std::string accepted;
  const auto added = add(30.0, [&](const WorkspaceReply& reply) {
    accepted = reply.message;
    server.release();
  });
  ASSERT_TRUE(added);
  EXPECT_EQ(added->outcome, WorkspaceOutcome::kDone);
  EXPECT_EQ(added->message, "so be it");
  EXPECT_EQ(added->version, 77U);
  EXPECT_EQ(accepted, "wait");
  EXPECT_EQ(server.last().operation, WorkspaceOperation::kAdd);
  EXPECT_EQ(server.last().description, "name: a");
  EXPECT_EQ(server.last().requester.find("asking, process "), 0U) << server.last().requester;
  EXPECT_NE(server.last().stamp.sequence_number, 0U);

  WorkspaceCommand move;
  move.object = "pump";
  move.X_WO = {geometry::rotation_from_rpy(0.1, 0.2, 3.0), {1, 2, 3}};
  move.guard_vox = 3;
  ASSERT_TRUE(ask(dds::test_network(), "asking", move, 30.0));
  const WorkspaceCommand moved = server.last();
  EXPECT_EQ(moved.operation, WorkspaceOperation::kMove);
  EXPECT_EQ(moved.object, "pump");
  EXPECT_EQ(moved.guard_vox, 3);
  EXPECT_LT((moved.X_WO.rotation - move.X_WO.rotation).norm(), 1e-12);
  EXPECT_LT((moved.X_WO.translation_m - move.X_WO.translation_m).norm(), 1e-12);
}

TEST(Ask, ARefusalIsAFinalReplyAndSilenceIsNone) {
  {
    Server server(WorkspaceOutcome::kRefused);
    const auto reply = add(30.0);
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->outcome, WorkspaceOutcome::kRefused);
  }
  EXPECT_FALSE(add(0.3));
}

}  // namespace
}  // namespace phantom::messages
