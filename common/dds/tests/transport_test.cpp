#include "common/dds/transport.hpp"

#include <fastdds/rtps/transport/TransportInterface.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <gtest/gtest.h>

#include "common/dds/serial_discovery.hpp"

namespace phantom::dds {
namespace {

core::NetworkOptions network(bool secured) {
  core::NetworkOptions made;
  made.interfaces = {"127.0.0.1"};
  if (secured) made.security = "/etc/phantom/security";
  return made;
}

TEST(Transport, SendsShortMessagesAndTakesLongOnes) {
  for (const bool secured : {false, true}) {
    const auto udp = transport_of(network(secured));
    EXPECT_EQ(udp->max_message_size(), 16000U);
    const std::unique_ptr<eprosima::fastdds::rtps::TransportInterface> made(udp->create_transport());
    ASSERT_TRUE(made->init());
    EXPECT_GE(made->max_recv_buffer_size(), 65000U) << "another vendor's";
  }
}

TEST(Transport, HearsOfSecuredParticipantsOneAtATime) {
  const auto is_serial = [](bool secured) {
    return dynamic_cast<const SerialDiscoveryDescriptor*>(transport_of(network(secured)).get()) != nullptr;
  };
  EXPECT_TRUE(is_serial(true));
  EXPECT_FALSE(is_serial(false));
}

TEST(Transport, HearsADiscoveryServerOfItsOwnHost) {
  const auto interfaces = [](const std::string& server) {
    core::NetworkOptions site;
    site.interfaces = {"10.30.1.2"};
    if (!server.empty()) site.discovery_servers = {server};
    using Udp = eprosima::fastdds::rtps::UDPv4TransportDescriptor;
    return std::dynamic_pointer_cast<Udp>(transport_of(site))->interfaceWhiteList;
  };
  const std::vector<std::string> own{"10.30.1.2"}, and_loopback{"10.30.1.2", "127.0.0.1"};
  EXPECT_EQ(interfaces(""), own);
  EXPECT_EQ(interfaces("10.30.2.2:11811"), own);
  EXPECT_EQ(interfaces("10.30.1.2:11811"), and_loopback);
}

}  // namespace
}  // namespace phantom::dds
