#include <gtest/gtest.h>

#include <mutex>

#include "common/dds/endpoints/stamp.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/living.hpp"
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
  const CommandOutcome alone = adapter_.change(CarryRequest{"pump", true});
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
  ASSERT_TRUE(eventually([&] { return adapter_.change(CarryRequest{"pump", true}).kind == Kind::kDone; }));
  EXPECT_EQ(adapter_.change(CarryRequest{"vice", true}).message, "taken: vice");
  const CommandOutcome refused = adapter_.change(CarryRequest{"pump", false});
  EXPECT_EQ(refused.kind, Kind::kRefused);
  EXPECT_EQ(refused.message, "nobody carries it");
}

/// A server of one object, which carries out requests to move it, beside a phantom that doubts the model.
class CorrectedModel : public Adapter {
 protected:
  void announce(double x_m) {
    messages::WorkspaceObject object;
    object.id = 7;
    object.name = "gauge";
    object.mesh_hash = 5;
    object.X_WO.translation_m = {x_m, 0.2, 0.3};
    objects_.write(messages::to_idl(object));
  }
  void doubt(const messages::Vector3& shift_m, std::uint16_t object = 7) {
    messages::ModelDoubt doubt;
    doubt.place = 3;
    doubt.doubt = ++doubts_raised_;
    doubt.workspace_version = 1;
    doubt.object = object;
    doubt.shift_m = shift_m;
    doubts_.publish(doubt);
  }
  std::size_t objects_seen() { return got<ObjectSample>().size(); }
  std::size_t doubts_seen() { return got<DoubtSample>().size(); }

  dds::Writer<msg::WorkspaceObject> objects_{other_, dds::kWorkspaceObject};
  messages::Publisher<messages::ModelDoubt> doubts_{other_, dds::kModelDoubt};
  std::uint32_t doubts_raised_ = 0;
  dds::Stamper replier_{other_};
  dds::Writer<msg::WorkspaceReply> replies_{other_, dds::kWorkspaceReply};
  std::vector<messages::WorkspaceCommand> commands_seen_;
  std::mutex commands_mutex_;
  dds::Reader<msg::WorkspaceCommand> commands_{
      other_, dds::kWorkspaceCommand, [this](const msg::WorkspaceCommand& message, const dds::SampleInfo&) {
        const auto command = messages::from_idl(message);
        if (!command) return;
        messages::WorkspaceReply reply;
        reply.command = command->stamp;
        reply.operation = command->operation;
        reply.outcome = messages::WorkspaceOutcome::kDone;
        reply.message = "moved";
        msg::WorkspaceReply answer = messages::to_idl(reply);
        answer.stamp(replier_.next());
        const std::lock_guard lock(commands_mutex_);
        if (commands_seen_.empty() || commands_seen_.back().stamp != command->stamp)
          commands_seen_.push_back(*command);
        replies_.write(answer);
      }};
};

TEST_F(CorrectedModel, SR28_AnObjectIsPutWhereACameraHasFoundItOnlyWhenAPersonAsks) {
  using Kind = CommandOutcome::Kind;
  announce(0.1);
  messages::PoseFinding finding{.id = 7, .verdict = messages::PoseVerdict::kElsewhere, .camera = "above"};
  finding.X_WO.translation_m = {0.1, 0.2, 0.3};
  finding.corrected_WO.translation_m = {0.0, 0.2, 0.3};
  finding.shift_m = 0.1;
  dds::Writer<msg::PoseFinding> findings(other_, dds::kPoseFinding);
  findings.write(messages::to_idl(finding));
  ASSERT_TRUE(eventually([&] { return objects_seen() == 1 && got<FindingSample>().size() == 1; }));
  {
    const std::lock_guard lock(commands_mutex_);
    EXPECT_TRUE(commands_seen_.empty()) << "nothing moves by itself";
  }
  EXPECT_EQ(adapter_.change(CorrectionRequest{.found = "vice"}).kind, Kind::kRefused);
  ASSERT_TRUE(
      eventually([&] { return adapter_.change(CorrectionRequest{.found = "gauge"}).kind == Kind::kDone; }));
  const std::lock_guard lock(commands_mutex_);
  EXPECT_EQ(commands_seen_.back().id, 7);
  EXPECT_TRUE(commands_seen_.back().X_WO.translation_m.isApprox(Eigen::Vector3d(0.0, 0.2, 0.3)));
}

TEST_F(CorrectedModel, WhatIsDecidedAboutAThingThatCamerasSeeIsAskedOfTheServer) {
  dds::Writer<msg::LiveObject> things(other_, dds::kLiveObject);
  things.write(messages::to_idl(
      messages::LiveObject{messages::kFirstLiveObjectId, messages::LiveStanding::kTracked, "x"}));
  ASSERT_TRUE(eventually([&] { return got<LiveObjectSample>().size() == 1; }));
  ASSERT_TRUE(eventually([&] {
    return adapter_
               .change(CorrectionRequest{
                   .live = "x", .decision = messages::WorkspaceOperation::kName, .name = "bucket"})
               .kind == CommandOutcome::Kind::kDone;
  }));
  const std::lock_guard lock(commands_mutex_);
  EXPECT_EQ(commands_seen_.back().operation, messages::WorkspaceOperation::kName);
  EXPECT_EQ(commands_seen_.back().object, "x");
  EXPECT_EQ(commands_seen_.back().description, "bucket");
}

TEST_F(CorrectedModel, SR23_ADoubtIsCorrectedByItsShiftAndThatIsUndone) {
  using Kind = CommandOutcome::Kind;
  EXPECT_EQ(adapter_.change(CorrectionRequest{.doubt = 1}).message,
            "doubt 1 of the model is not kept any more");
  EXPECT_EQ(adapter_.change(CorrectionRequest{.undo = "gauge"}).kind, Kind::kRefused);
  announce(0.1);
  ASSERT_TRUE(eventually([&] { return objects_seen() == 1; }));
  doubt({});
  ASSERT_TRUE(eventually([&] { return doubts_seen() == 1; }));
  EXPECT_EQ(adapter_.change(CorrectionRequest{.doubt = 1}).kind, Kind::kRefused) << "no shift explains it";
  doubt({0.02, 0.0, -0.01});
  ASSERT_TRUE(eventually([&] { return doubts_seen() == 2; }));
  ASSERT_TRUE(eventually([&] { return adapter_.change(CorrectionRequest{.doubt = 2}).kind == Kind::kDone; }));
  {
    const std::lock_guard lock(commands_mutex_);
    ASSERT_FALSE(commands_seen_.empty());
    EXPECT_EQ(commands_seen_.back().operation, messages::WorkspaceOperation::kMove);
    EXPECT_EQ(commands_seen_.back().id, 7);
    EXPECT_TRUE(commands_seen_.back().X_WO.translation_m.isApprox(Eigen::Vector3d(0.12, 0.2, 0.29)));
    EXPECT_FALSE(commands_seen_.back().guard_vox) << "the guard stays";
  }
  announce(0.12);
  ASSERT_TRUE(eventually([&] { return objects_seen() == 2; }));
  EXPECT_EQ(adapter_.change(CorrectionRequest{.doubt = 2}).kind, Kind::kRefused) << "it would be moved twice";
  EXPECT_EQ(adapter_.change(CorrectionRequest{.undo = "gauge"}).kind, Kind::kDone);
  const std::lock_guard lock(commands_mutex_);
  EXPECT_TRUE(commands_seen_.back().X_WO.translation_m.isApprox(Eigen::Vector3d(0.1, 0.2, 0.3)));
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
