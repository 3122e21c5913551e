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

}  // namespace
}  // namespace phantom::phantom_session
