#include "components/audio_percept/dds_adapter.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"

namespace phantom::audio_percept {
namespace {

/// What the rest of the system sends, and what it hears from the component.
struct System {
  core::NetworkOptions network = dds::test_network();
  dds::Participant participant{"system", network};
  dds::Writer<msg::Percept> percept{participant, dds::kPercept};
  dds::Writer<msg::SlaveState> slave{participant, dds::kSlaveState};
  dds::Writer<msg::HitAlert> alert{participant, dds::kHitAlert};
  dds::Writer<msg::OperatorCommand> command{participant, dds::kOperatorCommand};
  dds::Writer<msg::ViewPose> view{participant, dds::kViewPose};
  dds::Stamper view_stamp{participant};
  dds::Stamper percept_stamp{participant}, slave_stamp{participant}, alert_stamp{participant};

  void send_percept(double closeness) {
    msg::Percept message;
    message.stamp(percept_stamp.next());
    message.joint_count(7);
    message.valid(true);
    message.closeness(closeness);
    percept.write(message);
  }
};

TEST(DdsAdapter, BringsTheSamplesOfEveryTopicToTheInbox) {
  System system;
  Inbox inbox;
  DdsAdapter adapter(system.network, inbox);
  Inputs inputs;
  EXPECT_TRUE(dds::eventually([&] {
    system.send_percept(0.75);
    msg::SlaveState state;
    state.stamp(system.slave_stamp.next());
    state.joint_count(7);
    state.state(msg::LinkState::LINK_STOPPED);
    system.slave.write(state);
    msg::HitAlert alert;
    alert.stamp(system.alert_stamp.next());
    alert.alert(3);
    system.alert.write(alert);
    msg::OperatorCommand view;
    view.kind(msg::CommandKind::COMMAND_VIEW_NODE);
    view.value(11);
    view.stamp().sequence_number(1);
    system.command.write(view);
    msg::ViewPose pose;
    pose.stamp(system.view_stamp.next());
    pose.X_WC().qw(1);
    system.view.write(pose);
    inbox.collect(inputs);
    return inputs.view.received_ns > 0 && inputs.percept.valid &&
           inputs.slave.state == teleop::LinkState::kStopped && inputs.alerts.active == 1 &&
           inputs.command.view == percept::ViewNode::kEast;
  }));
  EXPECT_DOUBLE_EQ(inputs.percept.closeness, 0.75);
  EXPECT_GT(inputs.percept.received_ns, 0);
  EXPECT_EQ(inputs.master.received_ns, 0) << "nobody sent one";
}

TEST(DdsAdapter, CountsWhatItRefusesAndKeepsTheLastGoodSample) {
  System system;
  Inbox inbox;
  DdsAdapter adapter(system.network, inbox);
  std::atomic<std::uint64_t> refused{0};
  dds::Reader<msg::ComponentStatus> status(system.participant, dds::kComponentStatus,
                                           [&](const msg::ComponentStatus& sample, const dds::SampleInfo&) {
                                             for (const auto& topic : sample.topics()) {
                                               if (topic.topic() == "percept" && !topic.writer())
                                                 refused = topic.refused();
                                             }
                                           });
  Inputs inputs;
  EXPECT_TRUE(dds::eventually([&] {
    system.send_percept(0.5);
    inbox.collect(inputs);
    return inputs.percept.valid;
  }));
  EXPECT_TRUE(dds::eventually([&] {
    system.send_percept(std::numeric_limits<double>::quiet_NaN());
    adapter.report({});
    return refused > 0;
  }));
  inbox.collect(inputs);
  EXPECT_DOUBLE_EQ(inputs.percept.closeness, 0.5);
}

}  // namespace
}  // namespace phantom::audio_percept
