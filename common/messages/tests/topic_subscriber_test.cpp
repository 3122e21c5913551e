#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/topic_receiver.hpp"

namespace phantom::messages::topic_subscriber_test {
namespace {

/// A model of two joints; `elbow`: what is different.
robot::ModelIdentity model(std::uint32_t elbow) {
  robot::ModelIdentity made;
  made.arm_file = "arm.urdf";
  made.joints = {1, elbow};
  made.joint_names = made.joint_texts = {"shoulder", "elbow"};
  return made;
}

core::NetworkOptions labelled(std::uint32_t elbow) {
  core::NetworkOptions network = dds::test_network();
  network.model_label = robot::label_of(model(elbow));
  return network;
}

/// Publishes states until `seen()`; fails after a while.
template <class Seen>
void publish_until(dds::Participant& participant, Seen&& seen) {
  Publisher<SlaveState> publisher(participant, dds::kSlaveState);
  SlaveState state;
  state.joint_count = 2;
  EXPECT_TRUE(dds::eventually([&] {
    publisher.publish(state);
    return seen();
  }));
}

TEST(TopicSubscriber, SR21_WhatAnotherModelsProcessSendsIsRefusedOrMarked) {
  ArmBounds bounds;
  bounds.joint_count = 2;
  bounds.identity = std::make_shared<const robot::ModelIdentity>(model(7));
  dds::Participant here("master_io", dds::test_network());
  std::atomic<int> passed{0}, marked{0}, unmarked{0};
  const TopicSubscriber<msg::SlaveState> refusing(here, dds::kSlaveState, bounds,
                                                  [&](const Received<SlaveState>&) { ++passed; });
  std::unique_ptr<TopicSubscriber<msg::SlaveState>> marking;
  marking = std::make_unique<TopicSubscriber<msg::SlaveState>>(
      here, dds::kSlaveState, TopicReceiver<msg::SlaveState>(bounds, {.other_model = OtherModel::kMarked}),
      [&](const Received<SlaveState>&) {
        if (marking) ++(marking->of_other_model() ? marked : unmarked);
      });
  {
    dds::Participant other("slave_io", labelled(8));
    publish_until(other, [&] { return marked > 0 && !refusing.model_difference().empty(); });
  }
  EXPECT_EQ(passed, 0);
  EXPECT_EQ(unmarked, 0);
  EXPECT_THAT(refusing.model_difference(),
              testing::HasSubstr("another joint elbow (arm.urdf here, arm.urdf there)"));
  dds::Participant same("slave_io", labelled(7));
  publish_until(same, [&] { return passed > 0 && unmarked > 0 && refusing.model_difference().empty(); });
  ASSERT_TRUE(refusing.clock_difference_s());
  EXPECT_LT(std::abs(*refusing.clock_difference_s()), 30.0) << "the same clock";
}

}  // namespace
}  // namespace phantom::messages::topic_subscriber_test
