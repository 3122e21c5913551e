#include "common/dds/endpoints/transport.hpp"

#include <gtest/gtest.h>

namespace phantom::dds::transport_test {
namespace {

core::NetworkOptions network(bool secured, const std::vector<std::string>& interfaces) {
  core::NetworkOptions made;
  made.interfaces = interfaces;
  if (secured) made.security = "/etc/phantom/security";
  return made;
}

TEST(Transport, SendsMessagesThatHoldAllAnnouncementsAndTakesLongerOnes) {
  for (const bool secured : {false, true}) {
    EXPECT_EQ(transport_of(network(secured, {"10.30.1.2"}), false)->max_message_size(), 16000U);
    const auto udp = transport_of(network(secured, {"127.0.0.1"}), false);
    EXPECT_EQ(udp->max_message_size(), 16000U);
    const std::unique_ptr<fast_dds::rtps::TransportInterface> made(udp->create_transport());
    ASSERT_TRUE(made->init());
    EXPECT_GE(made->max_recv_buffer_size(), 65000U) << "another vendor's";
  }
}

TEST(Transport, HearsADiscoveryServerOfItsOwnHost) {
  const auto interfaces = [](const std::string& server) {
    core::NetworkOptions site;
    site.interfaces = {"10.30.1.2"};
    if (!server.empty()) site.discovery_servers = {server};
    using Udp = fast_dds::rtps::UDPv4TransportDescriptor;
    return std::dynamic_pointer_cast<Udp>(transport_of(site, false)->low_level_descriptor)
        ->interfaceWhiteList;
  };
  const std::vector<std::string> own{"10.30.1.2"}, and_loopback{"10.30.1.2", "127.0.0.1"};
  EXPECT_EQ(interfaces(""), own);
  EXPECT_EQ(interfaces("10.30.2.2:11811"), own);
  EXPECT_EQ(interfaces("10.30.1.2:11811"), and_loopback);
}

TEST(Transport, HearsThePeersNetworksOnlyWhereTheyAreNamed) {
  core::NetworkOptions site;
  EXPECT_TRUE(transport_of(site, false)->guard.networks.empty());
  site.initial_peers = {"10.30.1.2", "10.30.2.2"};
  const wire::Guard guard(transport_of(site, false)->guard);
  EXPECT_TRUE(guard.admits({0x0a1e0109, 1}));
  EXPECT_TRUE(guard.admits({0x0a1e0202, 1}));
  EXPECT_TRUE(guard.admits({0x7f000001, 1}));
  EXPECT_FALSE(guard.admits({0x0a1e0302, 1}));
}

}  // namespace
}  // namespace phantom::dds::transport_test
