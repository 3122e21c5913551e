#include "common/messages/status_reporter.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "common/core/host_interfaces.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/status_codec.hpp"

namespace phantom::messages {
namespace {

TEST(StatusReporter, PublishesHealthLoopsAndEndpoints) {
  dds::Participant there("phantom_sensing", dds::test_network()), here("watcher", dds::test_network());
  StatusReporter reporter(there);
  dds::Waiter waiter;
  std::vector<ComponentStatus> got;
  const dds::Reader<msg::ComponentStatus> reader(
      here, dds::kComponentStatus, [&](const msg::ComponentStatus& message, const dds::SampleInfo&) {
        const auto status = from_idl(message);
        waiter.change([&] {
          ASSERT_TRUE(status) << status.status().message();
          got.push_back(*status);
        });
      });
  core::Health health;
  health.state = core::ComponentState::kDegraded;
  health.message = std::string(400, 'x');
  health.loops.push_back({.name = "servo", .period_s = 0.001, .rate_hz = 999.5, .ticks = 10, .slips = 2});
  health.figures.push_back({"sensors", 8000, ""});
  health.page = "http://127.0.0.1:8080/";
  reporter.publish(health);
  ASSERT_TRUE(waiter.wait([&] { return !got.empty(); }));
  EXPECT_EQ(got[0].component, "phantom_sensing");
  EXPECT_EQ(got[0].state, core::ComponentState::kDegraded);
  EXPECT_EQ(got[0].message.size(), 256U) << "cut to the bound of the type, not refused";
  ASSERT_EQ(got[0].loops.size(), 1U);
  EXPECT_EQ(got[0].loops[0].slips, 2U);
  ASSERT_EQ(got[0].topics.size(), 1U);
  EXPECT_EQ(got[0].topics[0].topic, "component_status");
  EXPECT_EQ(got[0].figures[0].value, 8000);
  EXPECT_EQ(got[0].page, "http://127.0.0.1:8080/");
  EXPECT_EQ(got[0].host, core::host_name());
}

}  // namespace
}  // namespace phantom::messages
