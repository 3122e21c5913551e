#include "common/messages/topic_receiver.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"

namespace phantom::messages {
namespace {

using testing::HasSubstr;
constexpr core::Nanoseconds kMs = core::kNsPerMillisecond;

msg::WristWrench wrench(std::uint64_t session, std::uint64_t number, double force_N = 1.0) {
  msg::WristWrench message;
  message.stamp().session(session);
  message.stamp().sequence_number(number);
  message.valid(true);
  message.force_N().x(force_N);
  return message;
}

msg::HitAlert alert(std::uint64_t session, std::uint64_t number) {
  msg::HitAlert message;
  message.stamp().session(session);
  message.stamp().sequence_number(number);
  message.alert(1);
  return message;
}

TEST(TopicReceiver, SR11_TakesWhatIsNewerAndOfTheFollowedProcessAndSaysWhyElse) {
  TopicReceiver<msg::WristWrench> receiver;
  const auto first = receiver.take(wrench(1, 5, 2.5), 1000 * kMs);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->received_ns, 1000 * kMs);
  EXPECT_EQ(first->force_N[0], 2.5);
  const auto repeated = receiver.take(wrench(1, 5), 1001 * kMs);
  ASSERT_FALSE(repeated);
  EXPECT_THAT(repeated.status().message(), HasSubstr("older"));
  const auto foreign = receiver.take(wrench(2, 1), 1002 * kMs);
  ASSERT_FALSE(foreign);
  EXPECT_THAT(foreign.status().message(), HasSubstr("another process"));
  EXPECT_TRUE(receiver.take(wrench(1, 9), 1003 * kMs));
  EXPECT_EQ(receiver.source().lost(), 3U);
  EXPECT_EQ(receiver.source().rival_session(), 2U);
}

TEST(TopicReceiver, WhatTheCodecOrTheRuleRefusesBindsNobody) {
  TopicReceiver<msg::WristWrench> receiver(ArmBounds(), {.refusal = [](const WristWrench& w) {
                                             return w.force_N[0] > 9.0 ? "too strong; allowed: 9" : "";
                                           }});
  EXPECT_FALSE(receiver.take(wrench(1, 1, std::numeric_limits<double>::quiet_NaN()), 1000 * kMs));
  const auto strong = receiver.take(wrench(1, 2, 10.0), 1001 * kMs);
  ASSERT_FALSE(strong);
  EXPECT_EQ(strong.status().message(), "too strong; allowed: 9");
  EXPECT_TRUE(receiver.take(wrench(2, 1), 1002 * kMs)) << "the first was never followed";
}

TEST(TopicReceiver, ASlowTopicsWriterMayBeSilentLonger) {
  TopicReceiver<msg::WristWrench> receiver(ArmBounds(), {.hold_ns = 2000 * kMs});
  ASSERT_TRUE(receiver.take(wrench(1, 1), 1000 * kMs));
  EXPECT_FALSE(receiver.take(wrench(2, 1), 2900 * kMs));
  EXPECT_TRUE(receiver.take(wrench(2, 2), 3000 * kMs));
}

TEST(TopicReceiver, ACopyGoesOnByItself) {
  TopicReceiver<msg::WristWrench> receiver;
  ASSERT_TRUE(receiver.take(wrench(1, 5), 1000 * kMs));
  TopicReceiver<msg::WristWrench> copy = receiver;
  EXPECT_FALSE(copy.take(wrench(1, 5), 1001 * kMs));
  EXPECT_TRUE(copy.take(wrench(1, 6), 1002 * kMs));
  EXPECT_TRUE(receiver.take(wrench(1, 6), 1002 * kMs));
}

TEST(TopicReceiver, EventsAreTakenFromTheProcessOfThePeriodicTopic) {
  TopicReceiver<msg::WristWrench> periodic;
  TopicReceiver<msg::HitAlert> events;
  ASSERT_TRUE(periodic.take(wrench(1, 1), 1000 * kMs));
  EXPECT_FALSE(events.take(alert(2, 1), 1001 * kMs, periodic.source()));
  EXPECT_TRUE(events.take(alert(1, 1), 1002 * kMs, periodic.source()));
  EXPECT_TRUE(events.take(alert(2, 2), 9000 * kMs, periodic.source())) << "the first has gone";
}

TEST(TopicSubscriber, WritesItsTopicToASnapshotOfSeveralReaders) {
  const core::NetworkOptions network = dds::test_network();
  dds::Participant own("own", network), other("other", network);
  core::Snapshot<Received<WristWrench>, 2> newest;
  TopicSubscriber<msg::WristWrench> subscriber(own, dds::kWristWrench, {}, newest);
  dds::Writer<msg::WristWrench> writer(other, dds::kWristWrench);
  std::uint64_t number = 0;
  Received<WristWrench> first, second;
  ASSERT_TRUE(dds::eventually([&] {
    writer.write(wrench(1, ++number, 3.5));
    return newest.read<0>(first);
  }));
  EXPECT_TRUE(newest.read<1>(second));
  EXPECT_EQ(first.force_N[0], 3.5);
  EXPECT_EQ(second.force_N[0], 3.5);
  EXPECT_GT(first.received_ns, 0);
  EXPECT_EQ(subscriber.source().session(), 1U);
}

}  // namespace
}  // namespace phantom::messages
