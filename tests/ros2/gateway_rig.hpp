#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <mutex>
#include <vector>

#include "common/dds/tests/test_network.hpp"
#include "common/messages/topic_receiver.hpp"
#include "components/ros2_gateway/dds_adapter.hpp"
#include "tests/ros2/foreign_node.hpp"
#include "tests/support/small_arms.hpp"

namespace phantom::ros2 {

/// What came on a topic of Phantom's.
template <class Message>
class Heard {
 public:
  using Sample = typename messages::TopicSubscriber<Message>::Sample;
  Heard(dds::Participant& participant, const dds::TopicSpec<Message>& topic)
      : reader_(participant, topic, {}, [this](const messages::Received<Sample>& sample) {
          const std::lock_guard lock(mutex_);
          all_.push_back(sample);
        }) {}
  std::vector<Sample> all() {
    const std::lock_guard lock(mutex_);
    return all_;
  }
  Sample last() {
    const std::lock_guard lock(mutex_);
    return all_.empty() ? Sample() : all_.back();
  }

 private:
  std::mutex mutex_;
  std::vector<Sample> all_;
  messages::TopicSubscriber<Message> reader_;
};

/// The gateway between two domains, a node of ROS 2, and a participant of Phantom's.
class GatewayData : public testing::Test {
 protected:
  GatewayData() {
    config_.node.domain = domain();
    config_.node.interfaces = config_.node.initial_peers = {"127.0.0.1"};
    config_.joint_states_topic = config_.collision_objects_topic = "";
    config_.workspace.meshes = false;
  }
  static int domain() { return phantom::test::own_domain(1); }
  void start() {
    adapter_ = std::make_unique<ros2_gateway::DdsAdapter>(
        dds::test_network(), config_, arm_, "",
        [](const ros2_gateway::JointStateMessage&, messages::SlaveState&) { return false; });
  }
  void TearDown() override { adapter_.reset(); }

  robot::SerialArm arm_ = phantom::test::one_joint();
  ros2_gateway::GatewayConfig config_;
  dds::Participant participant_{"observer", dds::test_network()};
  std::unique_ptr<ros2_gateway::DdsAdapter> adapter_;
  test::ForeignNode node_{domain(), test::Distribution::kSinceIron};
};

}  // namespace phantom::ros2
