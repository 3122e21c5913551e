#include <gtest/gtest.h>

#include "common/dds/endpoints/stamp.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/tests/stand_in_side.hpp"
#include "components/synthetic_viewer/topics/tests/adapter_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

using dds::eventually;
using dds::test_network;

TEST_F(Adapter, ItsViewCommandsReachOthersAndItselfAndWaitForNobody) {
  dds::Waiter waiter;
  std::vector<msg::OperatorCommand> heard;
  dds::Reader<msg::OperatorCommand> reader(other_, dds::kOperatorCommand,
                                           [&](const msg::OperatorCommand& command, const dds::SampleInfo&) {
                                             waiter.change([&] { heard.push_back(command); });
                                           });
  ASSERT_TRUE(eventually([&] { return reader.matched() >= 1; }));
  ASSERT_TRUE(eventually([&] {
    EXPECT_EQ(adapter_.ask({.kind = CommandKind::kViewNode, .value = 13}).kind, CommandOutcome::Kind::kDone);
    return waiter.wait([&] { return !heard.empty(); }, std::chrono::seconds(1));
  }));
  EXPECT_EQ(heard[0].kind(), msg::CommandKind::COMMAND_VIEW_NODE);
  EXPECT_EQ(heard[0].value(), 13);
  EXPECT_GT(heard[0].stamp().sequence_number(), 0U);
  ASSERT_TRUE(eventually([&] { return !got<Command>().empty(); }));
  EXPECT_EQ(got<Command>()[0].value, 13);
}

// It used to say "done" though nobody had heard it.
TEST_F(Adapter, AStopThatNobodyConfirmsIsNotDone) {
  const CommandOutcome outcome = adapter_.ask({.kind = CommandKind::kEmergencyStop});
  EXPECT_EQ(outcome.kind, CommandOutcome::Kind::kUnanswered);
  EXPECT_EQ(outcome.message, "NOT CONFIRMED by master_io, slave_io");
  EXPECT_TRUE(inbox_.stops.at(core::monotonic_ns()).alarm) << "after the third of a second that ask() waited";
}

TEST_F(Adapter, WhatIsToBeTakenIsAskedOfTheServerWhoseWordsAreGivenBack) {
  using Kind = CommandOutcome::Kind;
  const CommandOutcome alone = adapter_.carry({"pump", true});
  EXPECT_EQ(alone.kind, Kind::kUnanswered);
  EXPECT_EQ(alone.message, "NOT CONFIRMED by wva_server");
  dds::Stamper stamper(other_);
  dds::Writer<msg::WorkspaceReply> replies(other_, dds::kWorkspaceReply);
  dds::Reader<msg::WorkspaceCommand> commands(
      other_, dds::kWorkspaceCommand, [&](const msg::WorkspaceCommand& message, const dds::SampleInfo&) {
        const auto command = messages::from_idl(message);
        if (!command) return;
        const bool attach = command->operation == messages::WorkspaceOperation::kAttach;
        messages::WorkspaceReply reply;
        reply.command = command->stamp;
        reply.operation = command->operation;
        reply.object = command->object;
        reply.outcome = attach ? messages::WorkspaceOutcome::kDone : messages::WorkspaceOutcome::kRefused;
        reply.message = attach ? "taken: " + command->object : "nobody carries it";
        msg::WorkspaceReply answer = messages::to_idl(reply);
        answer.stamp(stamper.next());
        replies.write(answer);
      });
  ASSERT_TRUE(eventually([&] { return adapter_.carry({"pump", true}).kind == Kind::kDone; }));
  EXPECT_EQ(adapter_.carry({"vice", true}).message, "taken: vice");
  const CommandOutcome refused = adapter_.carry({"pump", false});
  EXPECT_EQ(refused.kind, Kind::kRefused);
  EXPECT_EQ(refused.message, "nobody carries it");
}

class AskingCell : public Adapter {
 protected:
  dds::Participant slave_host_{"slave_io", test_network()};
  messages::StandInSide master_{other_, teleop::Side::kMaster}, slave_{slave_host_, teleop::Side::kSlave};
  dds::Writer<msg::MasterState> master_states_{other_, dds::kMasterState};
  dds::Writer<msg::SlaveState> slave_states_{slave_host_, dds::kSlaveState};
  dds::Stamper master_stamps_{other_}, slave_stamps_{slave_host_};

  void SetUp() override {
    ASSERT_TRUE(eventually([&] {
      return master_.matched() && slave_.matched() && master_states_.matched() > 0 &&
             slave_states_.matched() > 0;
    }));
  }
  void send_states() {
    msg::MasterState master;
    master.stamp(master_stamps_.next());
    master.joint_count(static_cast<std::uint32_t>(kShape.joint_count));
    master.stop(master_.stop);
    master.state(master_.stop != 0 ? msg::LinkState::LINK_STOPPED : msg::LinkState::LINK_READY);
    master_states_.write(master);
    msg::SlaveState slave = slave_state();
    slave.stamp(slave_stamps_.next());
    slave.stop(slave_.stop);
    slave.state(slave_.stop != 0 ? msg::LinkState::LINK_STOPPED : msg::LinkState::LINK_READY);
    slave_states_.write(slave);
  }
};

TEST_F(AskingCell, AStopIsDoneByTheWordOfBothSides) {
  EXPECT_TRUE(eventually([&] {
    const CommandOutcome outcome = adapter_.ask({.kind = CommandKind::kEmergencyStop});
    return outcome.kind == CommandOutcome::Kind::kDone && outcome.message == "stopped: master_io, slave_io";
  }));
}

TEST_F(AskingCell, ASendDoesNotWaitAndItsStopShowsOnTheBoard) {
  slave_.answers = false;
  adapter_.send({.kind = CommandKind::kEmergencyStop});
  ASSERT_TRUE(eventually([&] {
    send_states();
    const StopView view = inbox_.stops.at(core::monotonic_ns());
    return view.alarm && view.sides[0].level == SideView::Level::kStopped &&
           view.sides[1].text == "HAS NOT CONFIRMED THE STOP";
  }));
  slave_.answers = true;
  ASSERT_TRUE(eventually([&] {
    send_states();
    const StopView view = inbox_.stops.at(core::monotonic_ns());
    return !view.alarm && view.sides[1].level == SideView::Level::kStopped;
  }));
}

TEST_F(AskingCell, AResetNamesTheStopsThatTheNewestStatesName) {
  adapter_.send({.kind = CommandKind::kEmergencyStop});
  ASSERT_TRUE(eventually([&] { return master_.stop != 0 && slave_.stop != 0; }));
  const std::uint64_t stop = slave_.stop;
  ASSERT_TRUE(eventually([&] {
    send_states();
    return inbox_.stops.stop_of(teleop::Side::kMaster) == stop &&
           inbox_.stops.stop_of(teleop::Side::kSlave) == stop;
  }));
  ASSERT_TRUE(eventually(
      [&] { return adapter_.ask({.kind = CommandKind::kReset}).kind == CommandOutcome::Kind::kDone; }));
  EXPECT_EQ(slave_.stop, 0U);
}

TEST_F(AskingCell, ARefusalComesWithTheWordsOfTheOneWhoRefused) {
  master_.refuses = true;
  ASSERT_TRUE(eventually([&] {
    const CommandOutcome outcome = adapter_.ask({.kind = CommandKind::kSetFeedbackGain, .value = 10});
    return outcome.kind == CommandOutcome::Kind::kRefused &&
           outcome.message == "master_io: not now; allowed is later";
  }));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
