#include "components/phantom_session/dds_adapter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/core/host/host_interfaces.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"

namespace phantom::phantom_session {
namespace {

/// A master that makes one reach after the other, as its own process would.
struct Master {
  explicit Master(const core::NetworkOptions& network) : participant("master_io", network) {}
  dds::Participant participant;
  dds::Writer<msg::MasterState> state{participant, dds::kMasterState};
  dds::Writer<msg::ComponentStatus> status{participant, dds::kComponentStatus};
  dds::Stamper state_stamp{participant}, status_stamp{participant};

  void send(int reach) {
    msg::MasterState message;
    message.stamp(state_stamp.next());
    message.joint_count(7);
    message.reach(reach);
    state.write(message);
  }
  void introduce(const std::string& host) {
    msg::ComponentStatus message;
    message.stamp(status_stamp.next());
    message.component_name("master_io");
    message.host(host);
    status.write(message);
  }
};

// Tries phantom_session: a second process writes
TEST(DdsAdapter, TheReportFollowsTheFirstOfTwoMastersAndNamesTheSecond) {
  const core::NetworkOptions network = dds::test_network();
  Collector collector(0.1, 0.1, {});
  JointLog joints(0.1);
  DdsAdapter adapter(network, collector, joints);
  Master first(network), second(network);
  const auto reaches = [&] {
    const auto lock = adapter.lock();
    return collector.reaches().size();
  };
  ASSERT_TRUE(dds::eventually([&] {
    first.send(1);
    return reaches() == 1;
  }));
  ASSERT_TRUE(dds::eventually([&] {
    first.send(1);
    second.introduce("console");
    const auto lock = adapter.lock();
    return collector.statuses().contains("master_io");
  }));
  ASSERT_TRUE(dds::eventually([&] {
    first.send(1);
    second.send(9);
    second.introduce("console");  // reports go with a status
    const auto lock = adapter.lock();
    return !collector.foreign_writers().empty() && collector.foreign_writers().front().samples > 3;
  }));
  const auto lock = adapter.lock();
  EXPECT_EQ(collector.reaches().size(), 1u) << "no reach of the second";
  EXPECT_EQ(collector.reaches().front().number, 1);
  ASSERT_EQ(collector.foreign_writers().size(), 1u);
  EXPECT_EQ(collector.foreign_writers().front().topic, "master_state");
  EXPECT_EQ(collector.foreign_writers().front().process, "master_io on console");
}

/// Publishes percepts and alerts, as a phantom_sensing would.
struct Phantom {
  explicit Phantom(const core::NetworkOptions& network) : participant("phantom_sensing", network) {}
  dds::Participant participant;
  dds::Writer<msg::Percept> percept{participant, dds::kPercept};
  dds::Writer<msg::HitAlert> alert{participant, dds::kHitAlert};
  dds::Writer<msg::ComponentStatus> status{participant, dds::kComponentStatus};
  dds::Stamper percept_stamp{participant}, alert_stamp{participant}, status_stamp{participant};

  void send(const std::string& link) {
    msg::Percept felt;
    felt.stamp(percept_stamp.next());
    felt.joint_count(7);
    percept.write(felt);
    msg::HitAlert hit;
    hit.stamp(alert_stamp.next());
    hit.alert(1);
    hit.link_name(link);
    alert.write(hit);
  }
  void introduce(const std::string& host) {
    msg::ComponentStatus message;
    message.stamp(status_stamp.next());
    message.component_name("phantom_sensing");
    message.host(host);
    status.write(message);
  }
};

// Tries phantom_session: a second process writes
TEST(DdsAdapter, TheReportHasTheHitsOfTheFirstOfTwoPhantomsAndNamesTheSecond) {
  const core::NetworkOptions network = dds::test_network();
  Collector collector(0.1, 0.1, {});
  JointLog joints(0.1);
  DdsAdapter adapter(network, collector, joints);
  Phantom first(network), second(network);
  const auto foreign = [&] {
    const auto lock = adapter.lock();
    return collector.foreign_writers();
  };
  ASSERT_TRUE(dds::eventually([&] {
    first.send("forearm");
    second.introduce("console");
    const auto lock = adapter.lock();
    return !collector.hits().empty() && collector.statuses().contains("phantom_sensing");
  }));
  ASSERT_TRUE(dds::eventually([&] {
    first.send("forearm");
    second.send("gripper");
    second.introduce("console");  // reports go with a status
    return foreign().size() == 2 && foreign()[0].samples > 3;
  }));
  const auto lock = adapter.lock();
  for (const HitSample& hit : collector.hits()) EXPECT_EQ(hit.link, "forearm");
  for (const ForeignWriter& writer : collector.foreign_writers()) {
    EXPECT_TRUE(writer.topic == "percept" || writer.topic == "hit_alert") << writer.topic;
    EXPECT_EQ(writer.process, "phantom_sensing on console");
  }
}

}  // namespace
}  // namespace phantom::phantom_session
