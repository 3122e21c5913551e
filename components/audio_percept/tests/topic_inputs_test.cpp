#include "components/audio_percept/topic_inputs.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>

#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/topic_receiver.hpp"

namespace phantom::audio_percept {
namespace {

using PerceptReceiver = messages::TopicReceiver<msg::Percept>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <class Message>
Message stamped(std::uint64_t number, std::uint64_t session = 5) {
  Message message;
  message.stamp().sequence_number(number);
  message.stamp().session(session);
  return message;
}

msg::Percept percept(std::uint64_t number, double closeness = 0.5, double speed_m_s = 0.1) {
  auto message = stamped<msg::Percept>(number);
  message.valid(true);
  message.closeness(closeness);
  message.speed_m_s(speed_m_s);
  message.joint_count(7);
  return message;
}

TEST(ReceivedPercept, TakesWhatIsValid) {
  PerceptReceiver receiver;
  const auto sample = receiver.take(percept(1, 0.25, 0.5), 77);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->received_ns, 77);
  EXPECT_TRUE(sample->valid);
  EXPECT_DOUBLE_EQ(sample->closeness, 0.25);
  EXPECT_DOUBLE_EQ(sample->speed_m_s, 0.5);
}

TEST(ReceivedPercept, WhatTheCodecRefusesDoesNotCountAsNewer) {
  PerceptReceiver receiver;
  EXPECT_FALSE(receiver.take(percept(1, kNan), 2));
  EXPECT_TRUE(receiver.take(percept(1), 2));
}

TEST(ReceivedPercept, RefusesWhatIsReorderedOrRepeatedButNotARestart) {
  PerceptReceiver receiver;
  EXPECT_TRUE(receiver.take(percept(10), 1));
  EXPECT_FALSE(receiver.take(percept(10), 2));
  EXPECT_FALSE(receiver.take(percept(9), 3));
  auto restarted = percept(1);
  restarted.stamp().session(6);
  EXPECT_TRUE(receiver.take(restarted, 1 + dds::SourceGuard::kHold_ns));
  EXPECT_FALSE(receiver.source().has_second(1 + dds::SourceGuard::kHold_ns)) << "it is a successor";
}

// The tone used to jump between two phantoms.
TEST(ReceivedPercept, KeepsToTheFirstOfTwoSendersAndTellsOfTheSecond) {
  PerceptReceiver receiver;
  core::Nanoseconds now_ns = core::kNsPerSecond;
  for (std::uint64_t number = 1; number <= 200; ++number, now_ns += 10 * core::kNsPerMillisecond) {
    const auto sample = receiver.take(percept(number, 0.25), now_ns);
    ASSERT_TRUE(sample);
    EXPECT_EQ(sample->closeness, 0.25);
    auto second = percept(number, 0.75);
    second.stamp().session(6);
    EXPECT_FALSE(receiver.take(second, now_ns + core::kNsPerMillisecond));
  }
  EXPECT_TRUE(receiver.source().has_second(now_ns));
  EXPECT_FALSE(receiver.source().has_second(now_ns + 10 * core::kNsPerSecond));
}

TEST(ReceivedAlert, IsTakenFromThePhantomThatIsHeard) {
  PerceptReceiver phantom;
  ASSERT_TRUE(phantom.take(percept(1), core::kNsPerSecond));
  messages::TopicReceiver<msg::HitAlert> receiver;
  auto alert = stamped<msg::HitAlert>(1, 6);
  alert.alert(1);
  EXPECT_FALSE(receiver.take(alert, core::kNsPerSecond + 1, phantom.source()));
  EXPECT_TRUE(receiver.take(alert, 10 * core::kNsPerSecond, phantom.source())) << "that phantom has gone";
  alert = stamped<msg::HitAlert>(1, 5);
  alert.alert(2);
  EXPECT_TRUE(receiver.take(alert, core::kNsPerSecond + 2, phantom.source()));
}

TEST(ReceivedPercept, TakesPlaceModelAndWhatIsMuted) {
  PerceptReceiver receiver;
  auto message = percept(1);
  message.position_m().x(1.0);
  message.position_m().y(-2.0);
  message.position_m().z(0.5);
  message.muted_sensors(3);
  message.condition(msg::PerceptCondition::PERCEPT_WORKSPACE_BEHIND);
  const auto sample = receiver.take(message, 7);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->position_m, (Vector3{1.0, -2.0, 0.5}));
  EXPECT_EQ(sample->muted_sensors, 3U);
  EXPECT_EQ(sample->condition, messages::PerceptCondition::kWorkspaceBehind);
}

TEST(ReceivedPercept, CountsFromTheStampOnlyWhereItsClockIsOurs) {
  PerceptReceiver receiver;
  std::uint64_t number = 0;
  for (const auto& [stamp_ns, expected_ns] :
       {std::pair{9'998 * core::kNsPerMillisecond, 9'998 * core::kNsPerMillisecond},  // 2 ms ago
        {10'001 * core::kNsPerMillisecond,
         10'000 * core::kNsPerMillisecond},                                   // another host's: in the future
        {1'000 * core::kNsPerMillisecond, 10'000 * core::kNsPerMillisecond},  // another host's: long ago
        {std::numeric_limits<core::Nanoseconds>::min(), 10'000 * core::kNsPerMillisecond}}) {
    auto message = percept(++number);
    message.stamp().monotonic_ns(stamp_ns);
    const auto sample = receiver.take(message, 10'000 * core::kNsPerMillisecond);
    ASSERT_TRUE(sample);
    EXPECT_EQ(sent_ns(*sample), expected_ns);
  }
}

TEST(Commands, TheViewAndTheResetAreKeptAndWhatIsNoNodeIsRefused) {
  CommandSample sample;
  const auto command = [&](msg::CommandKind kind, double value, core::Nanoseconds at_ns) {
    msg::OperatorCommand message;
    message.stamp().sequence_number(1);
    message.kind(kind);
    message.value(value);
    const auto taken = messages::from_idl(message);
    if (taken) take(*taken, at_ns, sample);
    return taken.has_value();
  };
  EXPECT_TRUE(command(msg::CommandKind::COMMAND_VIEW_NODE, 9.0, 10));
  EXPECT_EQ(sample.view, percept::ViewNode::kNorth);
  EXPECT_TRUE(command(msg::CommandKind::COMMAND_RESET, 0.0, 20));
  EXPECT_EQ(sample.view, percept::ViewNode::kNorth);
  EXPECT_EQ(sample.reset_ns, 20);
  EXPECT_FALSE(command(msg::CommandKind::COMMAND_VIEW_NODE, 15.0, 30));
  EXPECT_EQ(sample.view, percept::ViewNode::kNorth);
  EXPECT_TRUE(command(msg::CommandKind::COMMAND_SET_PERCEPT_GAIN, 2.0, 40));
  EXPECT_EQ(sample.reset_ns, 20);
  EXPECT_TRUE(command(msg::CommandKind::COMMAND_VIEW_NODE, 0.0, 50)) << "automatic again";
  EXPECT_FALSE(sample.view);
}

TEST(ReceivedView, TakesTheCamerasAxesAndRefusesWhatIsNoPose) {
  const ListenerConfig listener;
  const Eigen::Matrix3d rows = percept::view_axes(percept::node_direction(percept::ViewNode::kCorner3));
  const Eigen::Quaterniond q(Eigen::Matrix3d(rows.transpose()));
  const auto message = [&](std::uint64_t number) {
    msg::ViewPose made;
    made.stamp().sequence_number(number);
    made.stamp().session(3);
    made.view(msg::ViewKind::VIEW_HIT);
    made.node(3);
    made.X_WC().qw(q.w());
    made.X_WC().qx(q.x());
    made.X_WC().qy(q.y());
    made.X_WC().qz(q.z());
    return made;
  };
  messages::TopicReceiver<msg::ViewPose> receiver;
  const auto taken = receiver.take(message(1), 77);
  ASSERT_TRUE(taken);
  const ViewSample sample = view_of(*taken);
  EXPECT_EQ(sample.received_ns, 77);
  const ListenerAxes expected = listener_axes(listener, percept::ViewNode::kCorner3);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(sample.axes[i][k], expected[i][k], 1e-12);
  }
  msg::ViewPose no_pose = message(2);
  no_pose.X_WC().qx(kNan);
  EXPECT_FALSE(receiver.take(no_pose, 88));
  EXPECT_FALSE(receiver.take(message(1), 88)) << "it came before";
}

TEST(ReceivedLink, TellsTheStatesAndTheirCausesApart) {
  messages::TopicReceiver<msg::SlaveState> receiver;
  messages::Received<messages::SlaveState> sample;
  std::uint64_t number = 0;
  const auto state = [&](msg::LinkState value, msg::StopCause cause = msg::StopCause::STOP_EMERGENCY) {
    auto message = stamped<msg::SlaveState>(++number);
    message.joint_count(7);
    message.state(value);
    message.stop_cause(cause);
    const auto taken = receiver.take(message, 1);
    if (taken) sample = *taken;
    return taken.has_value();
  };
  EXPECT_TRUE(state(msg::LinkState::LINK_INIT));
  EXPECT_EQ(sample.state, teleop::LinkState::kInit);
  EXPECT_TRUE(state(msg::LinkState::LINK_COUPLED));
  EXPECT_EQ(sample.state, teleop::LinkState::kCoupled);
  EXPECT_TRUE(state(msg::LinkState::LINK_DEGRADED));
  EXPECT_EQ(sample.state, teleop::LinkState::kDegraded);
  EXPECT_TRUE(state(msg::LinkState::LINK_STOPPED));
  EXPECT_EQ(sample.state, teleop::LinkState::kStopped);
  EXPECT_EQ(sample.stop.cause, teleop::StopCause::kEmergency);
  EXPECT_TRUE(state(msg::LinkState::LINK_STOPPED, msg::StopCause::STOP_DRIVE_FAULT));
  EXPECT_EQ(sample.state, teleop::LinkState::kStopped);
  EXPECT_EQ(sample.stop.cause, teleop::StopCause::kDriveFault);
}

TEST(ReceivedLink, TheMasterSaysWhetherTheToneMaySound) {
  messages::TopicReceiver<msg::MasterState> receiver;
  for (const bool on : {true, false}) {
    auto message = stamped<msg::MasterState>(on ? 1 : 2);
    message.joint_count(7);
    message.tone_enabled(on);
    const auto sample = receiver.take(message, 1);
    ASSERT_TRUE(sample);
    EXPECT_EQ(sample->tone_enabled, on);
  }
}

messages::Received<messages::HitAlert> alert(std::uint32_t which, bool cleared, core::Nanoseconds at_ns,
                                             std::uint64_t session = 5) {
  messages::HitAlert made;
  made.stamp.session = session;
  made.alert = which;
  made.cleared = cleared;
  return {made, at_ns};
}

TEST(AlertCount, CountsTheAlertsThatAreNotOver) {
  AlertCount count;
  count.take(alert(1, false, 10));
  AlertSample sample = count.take(alert(2, false, 20));
  EXPECT_EQ(sample.active, 2U);
  EXPECT_EQ(sample.raised_ns, 20);
  sample = count.take(alert(1, true, 30));
  EXPECT_EQ(sample.active, 1U);
  EXPECT_EQ(sample.raised_ns, 20);
}

TEST(AlertCount, ARestartedSenderForgetsItsAlerts) {
  AlertCount count;
  count.take(alert(7, false, 10));
  EXPECT_EQ(count.take(alert(1, false, 20, 6)).active, 1U);
}

TEST(AlertCount, StaysBoundedWhenNothingIsCleared) {
  AlertCount count;
  AlertSample sample;
  for (std::uint32_t i = 1; i < 5000; ++i) sample = count.take(alert(i, false, 1));
  EXPECT_LE(sample.active, 1000U);
}

}  // namespace
}  // namespace phantom::audio_percept
