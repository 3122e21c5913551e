#include "common/messages/status_reporter.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/host/host_interfaces.hpp"
#include "common/dds/admission/bans.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/status_codec.hpp"

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

/// Sends an octet to the ports of discovery of the domain's first participants (DDSI-RTPS 9.6.1.1); Fast DDS
/// goes on counting where those of an earlier test ended.
void send_nonsense(int domain) {
  const int out = socket(AF_INET, SOCK_DGRAM, 0);
  for (int participant = 0; participant < 8; ++participant) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * domain + 10 + 2 * participant));
    sendto(out, "?", 1, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
  close(out);
}

TEST(StatusReporter, ReportsWhatWasRefusedAndWhoSentMostOfIt) {
  const auto network = dds::test_network();
  dds::Participant there("phantom_sensing", network), here("watcher", network);
  StatusReporter reporter(there);
  dds::Waiter waiter;
  ComponentStatus got, reported;
  const dds::Reader<msg::ComponentStatus> reader(
      here, dds::kComponentStatus, [&](const msg::ComponentStatus& message, const dds::SampleInfo&) {
        waiter.change([&] {
          if (const auto status = from_idl(message)) got = *status;
        });
      });
  const auto figure = [&](std::string_view name) {
    const auto found = std::find_if(reported.figures.begin(), reported.figures.end(),
                                    [&](const core::HealthFigure& one) { return one.name == name; });
    return found == reported.figures.end() ? core::HealthFigure{} : *found;
  };
  ASSERT_TRUE(dds::eventually([&] {
    send_nonsense(network.domain);
    reporter.publish({});
    waiter.change([&] { reported = got; });
    return figure("refused: no header of RTPS 2").value >= 3;
  }));
  EXPECT_EQ(figure("refused: no header of RTPS 2").unit, "datagrams");
  EXPECT_EQ(figure("refused from: no header of RTPS 2").value, figure("refused: no header of RTPS 2").value)
      << "one address sent all";
  EXPECT_EQ(figure("refused from: no header of RTPS 2").unit, "127.0.0.1");
}

TEST(StatusReporter, TellsOfWhatWasForgottenOnceThereIsAny) {
  dds::Participant there("phantom_sensing", dds::test_network()), here("watcher", dds::test_network());
  StatusReporter reporter(there);
  dds::Waiter waiter;
  std::vector<double> forgotten;  // in each status; −1: it has no such figure
  const dds::Reader<msg::ComponentStatus> reader(
      here, dds::kComponentStatus, [&](const msg::ComponentStatus& message, const dds::SampleInfo&) {
        const auto status = from_idl(message);
        waiter.change([&] {
          forgotten.push_back(-1);
          for (const core::HealthFigure& figure : status->figures)
            if (figure.name == kForgotten) forgotten.back() = figure.value;
        });
      });
  const auto reported = [&](const core::Health& health) {
    const std::size_t before = forgotten.size();
    reporter.publish(health);
    EXPECT_TRUE(waiter.wait([&] { return forgotten.size() > before; }));
    return forgotten.back();
  };
  EXPECT_EQ(reported({}), -1);
  for (std::size_t i = 0; i < dds::Bans::kMax + 5; ++i)
    there.impl()->bans->ban({9, static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8)});
  EXPECT_EQ(reported({}), 5);
  EXPECT_EQ(reported({.figures = {{kForgotten, 2, ""}}}), 7)
      << "with what the component itself has forgotten";
}

}  // namespace
}  // namespace phantom::messages
