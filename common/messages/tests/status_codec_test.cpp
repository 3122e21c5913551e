#include "common/messages/codecs/status_codec.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "common/messages/tests/codec_cases.hpp"

namespace phantom::messages {
namespace {

using core::ComponentState;
using testing::HasSubstr;

ComponentStatus a_status() {
  ComponentStatus status;
  status.state = ComponentState::kDegraded;
  status.message = "slave_state is stale";
  status.loops = {{"servo", 0.001, 999.5, 10, 20, 30, 40, 50, 60, 70, 0.25, 0.0}};
  status.figures = {{"temperature", std::nan(""), "K"}};
  status.page = "http://127.0.0.1:8080/";
  status.stamp = {3, 4, 5};
  status.component = "master_io";
  status.host = "desk";
  status.process_id = 4711;
  status.topics = {{"slave_state", true, 1, 2, 3, 4, 5, 6, 0.0}};
  return status;
}

TEST(ComponentStatusCodec, ThereAndBackItIsTheSame) {
  const auto back = from_idl(to_idl(a_status()));
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->state, ComponentState::kDegraded);
  EXPECT_EQ(back->message, "slave_state is stale");
  ASSERT_EQ(back->loops.size(), 1U);
  const core::LoopStatistics& loop = back->loops[0];
  EXPECT_EQ(loop.name, "servo");
  EXPECT_EQ(loop.period_s, 0.001);
  EXPECT_EQ(loop.rate_hz, 999.5);
  EXPECT_EQ(loop.wakeup_p50_us, 10);
  EXPECT_EQ(loop.wakeup_p99_us, 20);
  EXPECT_EQ(loop.wakeup_max_us, 30);
  EXPECT_EQ(loop.work_p50_us, 40);
  EXPECT_EQ(loop.work_max_us, 50);
  EXPECT_EQ(loop.ticks, 60U);
  EXPECT_EQ(loop.slips, 70U);
  EXPECT_EQ(loop.idle_s, 0.25);
  ASSERT_EQ(back->figures.size(), 1U);
  EXPECT_EQ(back->figures[0].name, "temperature");
  EXPECT_TRUE(std::isnan(back->figures[0].value)) << "one unknown figure does not hide a component";
  EXPECT_EQ(back->figures[0].unit, "K");
  EXPECT_EQ(back->page, "http://127.0.0.1:8080/");
  EXPECT_EQ(back->stamp, (core::SampleId{3, 4, 5}));
  EXPECT_EQ(back->component, "master_io");
  EXPECT_EQ(back->host, "desk");
  EXPECT_EQ(back->process_id, 4711U);
  ASSERT_EQ(back->topics.size(), 1U);
  const core::EndpointStatistics& topic = back->topics[0];
  EXPECT_EQ(topic.topic, "slave_state");
  EXPECT_TRUE(topic.writer);
  EXPECT_EQ(topic.matched, 1U);
  EXPECT_EQ(topic.samples, 2U);
  EXPECT_EQ(topic.refused, 3U);
  EXPECT_EQ(topic.deadline_missed, 4U);
  EXPECT_EQ(topic.liveliness_lost, 5U);
  EXPECT_EQ(topic.incompatible_qos, 6U);
}

TEST(ComponentStatusCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::ComponentStatus> refusal{to_idl(a_status())};
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_THAT(refusal([](auto& m) { m.component_name(""); }), HasSubstr("component_name is empty"));
}

TEST(ComponentStatusCodec, WhatTheTopicCannotTakeIsLeftOut) {
  ComponentStatus status = a_status();
  status.message = std::string(300, 'm');
  status.page = "http://" + std::string(128, 'p');
  status.loops.resize(20, status.loops[0]);
  status.topics.resize(40, status.topics[0]);
  status.figures.resize(40, status.figures[0]);
  const auto back = from_idl(to_idl(status));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->message, std::string(256, 'm'));
  EXPECT_EQ(back->page, "") << "a cut address leads nowhere";
  EXPECT_EQ(back->loops.size(), 8U);
  EXPECT_EQ(back->topics.size(), 32U);
  EXPECT_EQ(back->figures.size(), 32U);
}

}  // namespace
}  // namespace phantom::messages
