#include "common/dds/departure.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>

#include "common/dds/endpoint.hpp"
#include "common/dds/participant_impl.hpp"
#include "common/dds/tests/test_network.hpp"

namespace phantom::dds {
namespace {

namespace edds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

TEST(Departure, IsTheDisposalOfAnAnnouncementByRtps) {
  const GuidPrefix own{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  const GuidPrefix peer{21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32};
  const auto message = departure(own, peer, 0x01020304);
  ASSERT_EQ(message.size(), 20u + 16u + 4u + 52u);
  EXPECT_EQ(std::string(message.begin(), message.begin() + 4), "RTPS");
  EXPECT_TRUE(std::equal(own.begin(), own.end(), message.begin() + 8));
  EXPECT_TRUE(std::equal(peer.begin(), peer.end(), message.begin() + 24));
  // The lengths that the submessages' heads tell lead exactly to the end.
  const auto length = [&](std::size_t head) { return message[head + 2] | message[head + 3] << 8; };
  EXPECT_EQ(message[20], 0x0e);
  EXPECT_EQ(20 + 4 + length(20), 36);
  EXPECT_EQ(message[36], 0x15);
  EXPECT_EQ(36 + 4 + length(36), static_cast<int>(message.size()));
  const std::vector<std::uint8_t> number(message.begin() + 52, message.begin() + 60);
  EXPECT_EQ(number, (std::vector<std::uint8_t>{0, 0, 0, 0, 4, 3, 2, 1}));
}

struct Doorkeeper : edds::DomainParticipantListener {
  std::atomic<int> came{0}, left{0}, dropped{0};

  void on_participant_discovery(edds::DomainParticipant*, rtps::ParticipantDiscoveryInfo&& info) override {
    using Status = rtps::ParticipantDiscoveryInfo;
    if (info.info.m_participantName.to_string() != "leaver") return;
    came += info.status == Status::DISCOVERED_PARTICIPANT ? 1 : 0;
    left += info.status == Status::REMOVED_PARTICIPANT ? 1 : 0;
    dropped += info.status == Status::DROPPED_PARTICIPANT ? 1 : 0;
  }
};

// Where a participant listens for announcements, as another hears it.
struct PortFinder : edds::DomainParticipantListener {
  std::atomic<int> port{0};
  void on_participant_discovery(edds::DomainParticipant*, rtps::ParticipantDiscoveryInfo&& info) override {
    if (info.info.m_participantName.to_string() != "keeper") return;
    for (const auto& locator : info.info.metatraffic_locators.unicast) {
      if (locator.kind == LOCATOR_KIND_UDPv4) port = static_cast<int>(locator.port);
    }
  }
};

// Fast DDS itself is the judge: the peer lets the leaver go, discovers it anew with its next announcement, as
// often as one likes, and nobody else notices.
TEST(Departure, ThePeerForgetsTheSenderAndDiscoversItAnew) {
  const auto keeper_ear = std::make_shared<Doorkeeper>(), other_ear = std::make_shared<Doorkeeper>();
  const auto asker = std::make_shared<PortFinder>();
  Participant keeper("keeper", test_network(), keeper_ear), other("other", test_network(), other_ear);
  Participant leaver("leaver", test_network(), asker);
  ASSERT_TRUE(eventually([&] { return keeper_ear->came == 1 && other_ear->came == 1 && asker->port > 0; }));

  const int out = socket(AF_INET, SOCK_DGRAM, 0);
  ASSERT_GE(out, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(asker->port));
  const auto message = departure(prefix_of(leaver), prefix_of(keeper), 1 << 20);
  for (int round = 1; round <= 3; ++round) {
    ASSERT_EQ(sendto(out, message.data(), message.size(), 0, reinterpret_cast<const sockaddr*>(&address),
                     sizeof address),
              static_cast<ssize_t>(message.size()));
    ASSERT_TRUE(eventually([&] { return keeper_ear->left == round && keeper_ear->came == round + 1; }));
  }
  close(out);
  EXPECT_EQ(keeper_ear->dropped, 0);
  EXPECT_EQ(other_ear->came, 1);
  EXPECT_EQ(other_ear->left, 0);
}

}  // namespace
}  // namespace phantom::dds
