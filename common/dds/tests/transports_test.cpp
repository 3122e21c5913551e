#include "common/dds/transports.hpp"

#include <fastdds/rtps/transport/TransportInterface.h>
#include <gtest/gtest.h>

#include "common/dds/serial_discovery.hpp"

namespace phantom::dds {
namespace {

core::NetworkOptions network(bool secured, bool shared_memory) {
  core::NetworkOptions made;
  made.interfaces = {"127.0.0.1"};
  made.shared_memory = shared_memory;
  if (secured) made.security = "/etc/phantom/security";
  return made;
}

TEST(Transports, SendShortMessagesAndTakeLongOnes) {
  for (const bool secured : {false, true}) {
    const auto udp = transports_of(network(secured, false)).at(0);
    EXPECT_EQ(udp->max_message_size(), 16000U);
    const std::unique_ptr<eprosima::fastdds::rtps::TransportInterface> made(udp->create_transport());
    ASSERT_TRUE(made->init());
    EXPECT_GE(made->max_recv_buffer_size(), 65000U) << "another vendor's";
  }
}

TEST(Transports, HearOfSecuredParticipantsOneAtATime) {
  const auto is_serial = [](bool secured) {
    return dynamic_cast<const SerialDiscoveryDescriptor*>(
               transports_of(network(secured, true)).at(0).get()) != nullptr;
  };
  EXPECT_TRUE(is_serial(true));
  EXPECT_FALSE(is_serial(false));
}

TEST(Transports, TakeSharedMemoryIfTheyMay) {
  for (const bool secured : {false, true}) {
    EXPECT_EQ(transports_of(network(secured, true)).size(), 2U);
    EXPECT_EQ(transports_of(network(secured, false)).size(), 1U);
  }
}

}  // namespace
}  // namespace phantom::dds
