#include "components/audio_percept/dds_adapter_convert.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>

namespace phantom::audio_percept {
namespace {

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

TEST(PerceptConverter, TakesWhatIsValid) {
  PerceptConverter converter;
  PerceptSample sample;
  ASSERT_TRUE(converter.accept(percept(1, 0.25, 0.5), 77, sample));
  EXPECT_EQ(sample.received_ns, 77);
  EXPECT_TRUE(sample.valid);
  EXPECT_DOUBLE_EQ(sample.closeness, 0.25);
  EXPECT_DOUBLE_EQ(sample.speed_m_s, 0.5);
}

TEST(PerceptConverter, WhatTheCodecRefusesLeavesTheSampleAloneAndDoesNotCountAsNewer) {
  PerceptConverter converter;
  PerceptSample sample{.received_ns = 1};
  EXPECT_FALSE(converter.accept(percept(1, kNan), 2, sample));
  EXPECT_EQ(sample.received_ns, 1);
  EXPECT_TRUE(converter.accept(percept(1), 2, sample));
}

TEST(PerceptConverter, RefusesWhatIsReorderedOrRepeatedButNotARestart) {
  PerceptConverter converter;
  PerceptSample sample;
  EXPECT_TRUE(converter.accept(percept(10), 1, sample));
  EXPECT_FALSE(converter.accept(percept(10), 2, sample));
  EXPECT_FALSE(converter.accept(percept(9), 3, sample));
  auto restarted = percept(1);
  restarted.stamp().session(6);
  EXPECT_TRUE(converter.accept(restarted, 1 + dds::SourceGuard::kHold_ns, sample));
  EXPECT_FALSE(converter.has_second(1 + dds::SourceGuard::kHold_ns)) << "it is a successor";
}

// The tone used to jump between two phantoms.
TEST(PerceptConverter, KeepsToTheFirstOfTwoSendersAndTellsOfTheSecond) {
  PerceptConverter converter;
  PerceptSample sample;
  core::Nanoseconds now_ns = core::kNsPerSecond;
  for (std::uint64_t number = 1; number <= 200; ++number, now_ns += 10 * core::kNsPerMillisecond) {
    EXPECT_TRUE(converter.accept(percept(number, 0.25), now_ns, sample));
    auto second = percept(number, 0.75);
    second.stamp().session(6);
    EXPECT_FALSE(converter.accept(second, now_ns + core::kNsPerMillisecond, sample));
    EXPECT_EQ(sample.closeness, 0.25);
  }
  EXPECT_TRUE(converter.has_second(now_ns));
  EXPECT_FALSE(converter.has_second(now_ns + 10 * core::kNsPerSecond));
}

TEST(AlertConverter, TakesTheAlertsOfThePhantomThatIsHeard) {
  PerceptConverter phantom;
  PerceptSample heard;
  ASSERT_TRUE(phantom.accept(percept(1), core::kNsPerSecond, heard));
  AlertConverter converter(&phantom.followed());
  AlertSample sample;
  auto alert = stamped<msg::HitAlert>(1, 6);
  alert.alert(1);
  EXPECT_FALSE(converter.accept(alert, core::kNsPerSecond + 1, sample));
  EXPECT_TRUE(converter.accept(alert, 10 * core::kNsPerSecond, sample)) << "that phantom has gone";
  alert = stamped<msg::HitAlert>(1, 5);
  alert.alert(2);
  EXPECT_TRUE(converter.accept(alert, core::kNsPerSecond + 2, sample));
}

TEST(PerceptConverter, TakesPlaceModelAndWhatIsMuted) {
  PerceptConverter converter;
  PerceptSample sample;
  auto message = percept(1);
  message.position_m().x(1.0);
  message.position_m().y(-2.0);
  message.position_m().z(0.5);
  message.muted_sensors(3);
  message.condition(msg::PerceptCondition::PERCEPT_WORKSPACE_BEHIND);
  ASSERT_TRUE(converter.accept(message, 7, sample));
  EXPECT_EQ(sample.position_m, (Vector3{1.0, -2.0, 0.5}));
  EXPECT_TRUE(sample.muted);
  EXPECT_EQ(sample.condition, messages::PerceptCondition::kWorkspaceBehind);
}

TEST(PerceptConverter, CountsFromTheStampOnlyWhereItsClockIsOurs) {
  PerceptConverter converter;
  PerceptSample sample;
  std::uint64_t number = 0;
  for (const auto& [stamp_ns, sent_ns] :
       {std::pair{9'998 * core::kNsPerMillisecond, 9'998 * core::kNsPerMillisecond},  // 2 ms ago
        {10'001 * core::kNsPerMillisecond,
         10'000 * core::kNsPerMillisecond},                                   // another host's: in the future
        {1'000 * core::kNsPerMillisecond, 10'000 * core::kNsPerMillisecond},  // another host's: long ago
        {std::numeric_limits<core::Nanoseconds>::min(), 10'000 * core::kNsPerMillisecond}}) {
    auto message = percept(++number);
    message.stamp().monotonic_ns(stamp_ns);
    ASSERT_TRUE(converter.accept(message, 10'000 * core::kNsPerMillisecond, sample));
    EXPECT_EQ(sample.sent_ns, sent_ns);
  }
}

TEST(CommandConverter, KeepsTheViewAndTheResetAndRefusesWhatIsNoNode) {
  CommandConverter converter;
  CommandSample sample;
  const auto command = [&](msg::CommandKind kind, double value, core::Nanoseconds at_ns) {
    msg::OperatorCommand message;
    message.stamp().sequence_number(1);
    message.kind(kind);
    message.value(value);
    return converter.accept(message, at_ns, sample);
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

TEST(ViewConverter, TakesTheCamerasAxesAndRefusesWhatIsNoPose) {
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
  ViewConverter converter;
  ViewSample sample;
  ASSERT_TRUE(converter.accept(message(1), 77, sample));
  EXPECT_EQ(sample.received_ns, 77);
  const ListenerAxes expected = listener_axes(listener, percept::ViewNode::kCorner3);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(sample.axes[i][k], expected[i][k], 1e-12);
  }
  msg::ViewPose no_pose = message(2);
  no_pose.X_WC().qx(kNan);
  EXPECT_FALSE(converter.accept(no_pose, 88, sample));
  EXPECT_FALSE(converter.accept(message(1), 88, sample)) << "it came before";
  EXPECT_EQ(sample.received_ns, 77);
}

TEST(LinkConverter, TellsTheStatesAndTheirCausesApart) {
  LinkConverter converter;
  LinkSample sample;
  std::uint64_t number = 0;
  const auto state = [&](msg::LinkState value, msg::StopCause cause = msg::StopCause::STOP_EMERGENCY) {
    auto message = stamped<msg::SlaveState>(++number);
    message.joint_count(7);
    message.state(value);
    message.stop_cause(cause);
    return converter.accept(message, 1, sample);
  };
  EXPECT_TRUE(state(msg::LinkState::LINK_INIT));
  EXPECT_EQ(sample.state, teleop::LinkState::kInit);
  EXPECT_TRUE(state(msg::LinkState::LINK_COUPLED));
  EXPECT_EQ(sample.state, teleop::LinkState::kCoupled);
  EXPECT_TRUE(state(msg::LinkState::LINK_DEGRADED));
  EXPECT_EQ(sample.state, teleop::LinkState::kDegraded);
  EXPECT_TRUE(state(msg::LinkState::LINK_STOPPED));
  EXPECT_EQ(sample.state, teleop::LinkState::kStopped);
  EXPECT_EQ(sample.cause, teleop::StopCause::kEmergency);
  EXPECT_TRUE(state(msg::LinkState::LINK_STOPPED, msg::StopCause::STOP_DRIVE_FAULT));
  EXPECT_EQ(sample.state, teleop::LinkState::kStopped);
  EXPECT_EQ(sample.cause, teleop::StopCause::kDriveFault);
}

TEST(LinkConverter, TheMasterSaysWhetherTheToneMaySound) {
  LinkConverter converter;
  LinkSample sample;
  for (const bool on : {true, false}) {
    auto message = stamped<msg::MasterState>(on ? 1 : 2);
    message.joint_count(7);
    message.tone_enabled(on);
    ASSERT_TRUE(converter.accept(message, 1, sample));
    EXPECT_EQ(sample.tone_enabled, on);
  }
}

msg::HitAlert alert(std::uint64_t number, std::uint32_t which, bool cleared, std::uint64_t session = 5) {
  auto message = stamped<msg::HitAlert>(number, session);
  message.alert(which);
  message.cleared(cleared);
  return message;
}

TEST(AlertConverter, CountsTheAlertsThatAreNotOver) {
  AlertConverter converter;
  AlertSample sample;
  ASSERT_TRUE(converter.accept(alert(1, 1, false), 10, sample));
  ASSERT_TRUE(converter.accept(alert(2, 2, false), 20, sample));
  EXPECT_EQ(sample.active, 2U);
  EXPECT_EQ(sample.raised_ns, 20);
  ASSERT_TRUE(converter.accept(alert(3, 1, true), 30, sample));
  EXPECT_EQ(sample.active, 1U);
  EXPECT_EQ(sample.raised_ns, 20);
}

TEST(AlertConverter, ARestartedSenderForgetsItsAlerts) {
  AlertConverter converter;
  AlertSample sample;
  ASSERT_TRUE(converter.accept(alert(1, 7, false), 10, sample));
  ASSERT_TRUE(converter.accept(alert(1, 1, false, 6), 20, sample));
  EXPECT_EQ(sample.active, 1U);
}

TEST(AlertConverter, StaysBoundedWhenNothingIsCleared) {
  AlertConverter converter;
  AlertSample sample;
  for (std::uint32_t i = 1; i < 5000; ++i) ASSERT_TRUE(converter.accept(alert(i, i, false), 1, sample));
  EXPECT_LE(sample.active, 1000U);
}

}  // namespace
}  // namespace phantom::audio_percept
