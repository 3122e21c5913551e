#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <string>

#include "common/core/errors.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/tests/codec_cases.hpp"

namespace phantom::messages {
namespace {

using teleop::CommandKind;
using testing::HasSubstr;

static_assert(teleop::kLastCommandKind == CommandKind::kCounterbalance);

constexpr core::SampleId kStamp{3, 4, 5}, kCommandStamp{6, 7, 8};

OperatorCommand a_gain() {
  return {.stamp = kStamp,
          .kind = CommandKind::kSetPerceptGain,
          .value = 1.5,
          .joint = 3,
          .master_stop = 11,
          .slave_stop = 12,
          .issuer = "test"};
}
SensingCommand an_allowed_contact() {
  return {.stamp = kStamp,
          .requester = "test",
          .request = SensingRequest::kAllowContact,
          .object = "vice",
          .id = 4,
          .link = "gripper",
          .duration_s = 20};
}
WorkspaceCommand a_move() {
  WorkspaceCommand command;
  command.stamp = kStamp;
  command.requester = "test";
  command.object = "vice";
  command.id = 4;
  command.X_WO = {Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()).toRotationMatrix(), {1, 2, 3}};
  command.guard_vox = 5;
  return command;
}

TEST(OperatorCommandCodec, ThereAndBackItIsTheSame) {
  const auto back = from_idl(to_idl(a_gain()));
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->stamp, kStamp);
  EXPECT_EQ(back->kind, CommandKind::kSetPerceptGain);
  EXPECT_EQ(back->value, 1.5);
  EXPECT_EQ(back->joint, 3);
  EXPECT_EQ(back->master_stop, 11U);
  EXPECT_EQ(back->slave_stop, 12U);
  EXPECT_EQ(back->issuer, "test");
}

TEST(OperatorCommandCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::OperatorCommand> refusal{to_idl(a_gain())};
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& m) { m.joint(16); }), "joint is 16; allowed: -1 (all) to 15");
  EXPECT_EQ(refusal([](auto& m) { m.joint(-2); }), "joint is -2; allowed: -1 (all) to 15");
  const auto value = [&](msg::CommandKind kind, double number) {
    return refusal([&](auto& m) {
      m.kind(kind);
      m.value(number);
    });
  };
  for (std::uint32_t kind = 0; kind < teleop::kCommandKinds; ++kind) {
    for (const double bad : kNoNumbers)
      EXPECT_THAT(value(static_cast<msg::CommandKind>(kind), bad), HasSubstr("finite")) << kind;
  }
  EXPECT_EQ(value(msg::CommandKind::COMMAND_SET_PERCEPT_GAIN, 1001),
            "set_percept_gain: value is 1001; allowed: 0 to 1000");
  EXPECT_THAT(value(msg::CommandKind::COMMAND_SET_PERCEPT_GAIN, -0.1), HasSubstr("value is -0.1"));
  EXPECT_THAT(value(msg::CommandKind::COMMAND_SET_FEEDBACK_GAIN, 10.5), HasSubstr("allowed: 0 to 10"));
  EXPECT_THAT(value(msg::CommandKind::COMMAND_ENABLE_PERCEPT, 2),
              HasSubstr("allowed: a whole number from 0 to 1"));
  EXPECT_THAT(value(msg::CommandKind::COMMAND_VIEW_HOLD, 0.5),
              HasSubstr("allowed: a whole number from 0 to 1"));
  for (const double node : {-1.0, 2.5, 15.0})
    EXPECT_THAT(value(msg::CommandKind::COMMAND_VIEW_NODE, node),
                HasSubstr("allowed: a whole number from 0 to 14"));
  EXPECT_THAT(value(msg::CommandKind::COMMAND_SET_PERCEPTS, 9),
              HasSubstr("allowed: a whole number from 0 to 8"));
  EXPECT_THAT(value(msg::CommandKind::COMMAND_COUNTERBALANCE, 2),
              HasSubstr("allowed: a whole number from 0 to 1"));
  EXPECT_THAT(value(msg::CommandKind::COMMAND_SET_LAW, 5), HasSubstr("allowed: a whole number from 0 to 4"));
  EXPECT_EQ(value(msg::CommandKind::COMMAND_GRIPPER_WIDTH, 1.01),
            "gripper_width: value is 1.01; allowed: 0 to 1");
  EXPECT_THAT(value(msg::CommandKind::COMMAND_GRIPPER_WIDTH, -0.001), HasSubstr("allowed: 0 to 1"));
  EXPECT_THAT(value(msg::CommandKind::COMMAND_GRIPPER_FORCE, 10'001), HasSubstr("allowed: 0 to 10000"));
}

TEST(OperatorCommandCodec, AStopAndAResetAreTakenWhateverTheFieldsAreThatTheyDoNotUse) {
  msg::OperatorCommand message = to_idl(a_gain());
  message.value(1e9);
  message.joint(99);
  for (const auto kind : {msg::CommandKind::COMMAND_EMERGENCY_STOP, msg::CommandKind::COMMAND_RESET}) {
    message.kind(kind);
    EXPECT_TRUE(from_idl(message));
  }
}

TEST(OperatorReplyCodec, ThereAndBackItIsTheSameAndWhatCannotBeTrueIsRefused) {
  const OperatorReply reply{kStamp, kCommandStamp, "slave_io", CommandKind::kReset, true, "released"};
  expect_same_after_round_trip(reply);
  const Refusals<msg::OperatorReply> refusal{to_idl(reply)};
}

TEST(SensingCommandCodec, ThereAndBackItIsTheSame) {
  const auto back = from_idl(to_idl(an_allowed_contact()));
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->stamp, kStamp);
  EXPECT_EQ(back->requester, "test");
  EXPECT_EQ(back->request, SensingRequest::kAllowContact);
  EXPECT_EQ(back->object, "vice");
  EXPECT_EQ(back->id, 4);
  EXPECT_EQ(back->link, "gripper");
  EXPECT_EQ(back->duration_s, 20);
}

TEST(SensingCommandCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::SensingCommand> refusal{to_idl(an_allowed_contact())};
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& m) { m.id(65535); }), "id is 65535; allowed: 0 to 65534");
  EXPECT_EQ(refusal([](auto& m) { m.duration_s(-1); }), "duration_s is -1; allowed: 0 to 86400");
  EXPECT_EQ(refusal([](auto& m) { m.duration_s(86401); }), "duration_s is 86401; allowed: 0 to 86400");
  const auto no_object = [](auto& m) {
    m.object("");
    m.id(0);
  };
  EXPECT_THAT(refusal(no_object), HasSubstr("object is empty and id is 0; allowed: a name"));
  EXPECT_EQ(refusal([&](auto& m) {
              no_object(m);
              m.request(msg::SensingRequest::SENSING_FORBID_CONTACT);
            }),
            "")
      << "forbids all contacts";
}

TEST(SensingReplyCodec, ThereAndBackItIsTheSameAndWhatCannotBeTrueIsRefused) {
  const SensingReply reply{kStamp, kCommandStamp, "test", SensingRequest::kListContacts, true, "none"};
  expect_same_after_round_trip(reply);
  const Refusals<msg::SensingReply> refusal{to_idl(reply)};
}

TEST(WorkspaceCommandCodec, ThereAndBackItIsTheSame) {
  const WorkspaceCommand command = a_move();
  const auto back = from_idl(to_idl(command));
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->stamp, kStamp);
  EXPECT_EQ(back->requester, "test");
  EXPECT_EQ(back->operation, WorkspaceOperation::kMove);
  EXPECT_EQ(back->object, "vice");
  EXPECT_EQ(back->id, 4);
  EXPECT_TRUE(back->X_WO.rotation.isApprox(command.X_WO.rotation, 1e-12));
  EXPECT_EQ(back->X_WO.translation_m, command.X_WO.translation_m);
  EXPECT_EQ(back->guard_vox, 5);
  WorkspaceCommand as_before = command;
  as_before.guard_vox.reset();
  EXPECT_EQ(from_idl(to_idl(as_before))->guard_vox, std::nullopt);
  WorkspaceCommand added;
  added.stamp = kStamp;
  added.operation = WorkspaceOperation::kAdd;
  added.description = "{name: vice}";
  EXPECT_EQ(from_idl(to_idl(added))->description, "{name: vice}");
}

TEST(WorkspaceCommandCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::WorkspaceCommand> refusal{to_idl(a_move())};
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& m) { m.id(65535); }), "id is 65535; allowed: 0 to 65534");
  EXPECT_EQ(refusal([](auto& m) { m.guard_vox(101); }), "guard_vox is 101; allowed: 0 to 100");
  EXPECT_EQ(refusal([](auto& m) {
              m.sets_guard(false);
              m.guard_vox(101);
            }),
            "")
      << "not used";
  EXPECT_THAT(refusal([](auto& m) { m.X_WO(msg::Pose()); }), HasSubstr("X_WO's quaternion has length 0"));
  EXPECT_THAT(refusal([](auto& m) { m.X_WO().qx(kNoNumbers[0]); }), HasSubstr("X_WO's quaternion"));
  EXPECT_THAT(refusal([](auto& m) {
                m.object("");
                m.id(0);
              }),
              HasSubstr("object is empty and id is 0; allowed: a name, or an id"));
  EXPECT_THAT(refusal([](auto& m) {
                m.operation(msg::WorkspaceOperation::WORKSPACE_ADD);
                m.description("");
              }),
              HasSubstr("description is empty; allowed: an object as in a cell file"));
}

TEST(WorkspaceCommandCodec, AnAttachAndAReleaseHaveAPoseOnlyIfTheySaySo) {
  WorkspaceCommand attach = a_move();
  attach.operation = WorkspaceOperation::kAttach;
  attach.guard_vox.reset();
  attach.arm = "left";
  attach.frame = "hand";
  attach.X_FO.translation_m = {0.0, 0.1, 0.2};
  auto back = from_idl(to_idl(attach));
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->operation, WorkspaceOperation::kAttach);
  EXPECT_EQ(back->object, "vice");
  EXPECT_EQ(back->arm, "left");
  EXPECT_EQ(back->frame, "hand");
  EXPECT_FALSE(back->sets_pose);
  EXPECT_EQ(back->X_FO.translation_m, Eigen::Vector3d::Zero()) << "not sent";
  attach.sets_pose = true;
  back = from_idl(to_idl(attach));
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_TRUE(back->sets_pose);
  EXPECT_EQ(back->X_FO.translation_m, attach.X_FO.translation_m);
  const Refusals<msg::WorkspaceCommand> refusal{to_idl(attach)};
  EXPECT_THAT(refusal([](auto& m) { m.X_FO().qw(kNoNumbers[0]); }), HasSubstr("X_FO's quaternion"));
  EXPECT_EQ(refusal([](auto& m) { m.X_WO(msg::Pose()); }), "") << "not used";
  EXPECT_EQ(refusal([](auto& m) { m.sets_pose(false), m.X_FO(msg::Pose()); }), "") << "not used";

  WorkspaceCommand release = a_move();
  release.operation = WorkspaceOperation::kRelease;
  release.sets_pose = true;
  back = from_idl(to_idl(release));
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->X_WO.translation_m, release.X_WO.translation_m);
  EXPECT_EQ(back->guard_vox, release.guard_vox);
  const Refusals<msg::WorkspaceCommand> refused{to_idl(release)};
  EXPECT_THAT(refused([](auto& m) { m.X_WO(msg::Pose()); }), HasSubstr("X_WO's quaternion"));
  EXPECT_EQ(refused([](auto& m) { m.sets_pose(false), m.X_WO(msg::Pose()); }), "") << "not used";
}

TEST(WorkspaceCommandCodec, ANewNameIsThereAndFits) {
  WorkspaceCommand call = a_move();
  call.operation = WorkspaceOperation::kName;
  call.description = "bucket";
  const auto back = from_idl(to_idl(call));
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->operation, WorkspaceOperation::kName);
  EXPECT_EQ(back->description, "bucket");
  const Refusals<msg::WorkspaceCommand> refusal{to_idl(call)};
  EXPECT_THAT(refusal([](auto& m) { m.description(""); }), HasSubstr("a name of 1 to 64"));
  EXPECT_THAT(refusal([](auto& m) { m.description(std::string(65, 'a').c_str()); }),
              HasSubstr("has 65 bytes"));
  EXPECT_THAT(refusal([](auto& m) { m.object(""), m.id(0); }), HasSubstr("a name, or an id"));
}

TEST(WorkspaceReplyCodec, ThereAndBackItIsTheSameAndWhatCannotBeTrueIsRefused) {
  const WorkspaceReply reply{kStamp,
                             kCommandStamp,
                             "test",
                             WorkspaceOperation::kRemove,
                             "vice",
                             4,
                             WorkspaceOutcome::kDone,
                             "gone",
                             9,
                             10,
                             11,
                             0.5};
  expect_same_after_round_trip(reply);
  const Refusals<msg::WorkspaceReply> refusal{to_idl(reply)};
  EXPECT_THAT(refusal([](auto& m) { m.seconds(-1); }), HasSubstr("seconds is -1"));
}

// What answers an invalid command still names its sender and what was asked for.
TEST(CommandCodecs, ReadLeavesWhatCouldBeRead) {
  msg::WorkspaceCommand message = to_idl(a_move());
  message.guard_vox(101);
  WorkspaceCommand command;
  EXPECT_FALSE(read(message, command));
  EXPECT_EQ(command.stamp, kStamp);
  EXPECT_EQ(command.requester, "test");
  EXPECT_EQ(command.object, "vice");
}

TEST(CommandCodecs, ATextThatNamesSomethingIsNeverCut) {
  WorkspaceCommand move = a_move();
  move.object = std::string(65, 'x');
  EXPECT_THROW(to_idl(move), core::ConfigError);
  move.object = std::string(64, 'x');
  EXPECT_EQ(from_idl(to_idl(move))->object, move.object);
  move.description = std::string(16385, 'x');
  EXPECT_THROW(to_idl(move), core::ConfigError);
  SensingCommand contact = an_allowed_contact();
  contact.link = std::string(65, 'x');
  try {
    to_idl(contact);
    FAIL() << "a cut name was sent";
  } catch (const core::ConfigError& error) {
    EXPECT_STREQ(error.what(), "link has 65 bytes; allowed: at most 64");
  }
  contact = an_allowed_contact();
  contact.requester = std::string(100, 'x');
  EXPECT_EQ(from_idl(to_idl(contact))->requester, std::string(64, 'x')) << "for the log only";
}

TEST(OperatorCommandCodec, AnIssuerThatForgesALogIsRefusedButNeverItsStop) {
  msg::OperatorCommand message = to_idl(a_gain());
  for (const char* issuer : {"me\nslave_io: reset by you", "\x1b[2J", "\u202egnp", "\xff"}) {
    message.issuer(issuer);
    message.kind(msg::CommandKind::COMMAND_EMERGENCY_STOP);
    EXPECT_TRUE(from_idl(message)) << issuer;
    message.kind(msg::CommandKind::COMMAND_RESET);
    EXPECT_FALSE(from_idl(message)) << issuer;
  }
}

}  // namespace
}  // namespace phantom::messages
