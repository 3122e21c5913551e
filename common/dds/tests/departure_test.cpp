#include "common/dds/recovery/departure.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/outbox.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/tests/test_network.hpp"

namespace phantom::dds {
namespace {

namespace rtps = fast_dds::rtps;

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

struct Doorkeeper : DiscoveryEvents {
  std::atomic<int> came{0}, left{0}, dropped{0};

  void on_participant(const FoundParticipant& found) override {
    if (found.name != "leaver") return;
    came += found.event == Discovered::kFound ? 1 : 0;
    left += found.event == Discovered::kLeft ? 1 : 0;
    dropped += found.event == Discovered::kLost ? 1 : 0;
  }
};

// Where a participant listens for announcements, as another hears it.
struct PortFinder : DiscoveryEvents {
  std::atomic<int> port{0};
  void on_participant(const FoundParticipant& found) override {
    if (found.name != "keeper") return;
    for (const auto& locator : found.announcements) {
      if (locator.kind == LOCATOR_KIND_UDPv4) port = static_cast<int>(locator.port);
    }
  }
};

/// A socket of somebody else on this host.
class Stranger {
 public:
  ~Stranger() { close(socket_); }
  void send(const std::vector<std::uint8_t>& message, int port) const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    ASSERT_EQ(sendto(socket_, message.data(), message.size(), 0, reinterpret_cast<const sockaddr*>(&address),
                     sizeof address),
              static_cast<ssize_t>(message.size()));
  }

 private:
  const int socket_ = socket(AF_INET, SOCK_DGRAM, 0);
};

struct DepartureOfOne : ::testing::Test {
  std::shared_ptr<Doorkeeper> keeper_ear = std::make_shared<Doorkeeper>(),
                              other_ear = std::make_shared<Doorkeeper>();
  std::shared_ptr<PortFinder> asker = std::make_shared<PortFinder>();
  Participant keeper{"keeper", test_network(), keeper_ear}, other{"other", test_network(), other_ear};
  Participant leaver{"leaver", test_network(), asker};
  std::vector<std::uint8_t> message = departure(prefix_of(leaver), prefix_of(keeper), 1 << 20);

  void SetUp() override {
    ASSERT_TRUE(eventually([&] { return keeper_ear->came == 1 && other_ear->came == 1 && asker->port > 0; }));
  }
};

// Fast DDS decides: the peer lets the leaver go, discovers it anew with its next announcement, as often as
// one likes, and nobody else notices.
TEST_F(DepartureOfOne, ThePeerForgetsTheSenderAndDiscoversItAnew) {
  rtps::Locator_t where;
  where.kind = LOCATOR_KIND_UDPv4;
  rtps::IPLocator::setIPv4(where, "127.0.0.1");
  where.port = static_cast<std::uint32_t>(asker->port);
  rtps::LocatorList_t to;
  to.push_back(where);
  for (int round = 1; round <= 3; ++round) {
    leaver.impl()->outbox->put(message, to);
    ASSERT_TRUE(eventually([&] { return keeper_ear->left == round && keeper_ear->came == round + 1; }));
  }
  EXPECT_EQ(keeper_ear->dropped, 0);
  EXPECT_EQ(other_ear->came, 1);
  EXPECT_EQ(other_ear->left, 0);
}

TEST_F(DepartureOfOne, NobodyElseCanSayThatItLeaves) {
  const Stranger stranger;
  const auto refused = [&] {
    std::uint64_t count = 0;
    for (const Refused& one : keeper.refused_datagrams())
      if (one.fault == wire::Fault::kDeparture) count += one.count;
    return count;
  };
  for (std::uint64_t round = 1; round <= 3; ++round) {
    stranger.send(message, asker->port);
    ASSERT_TRUE(eventually([&] { return refused() >= round; }));
  }
  EXPECT_EQ(keeper_ear->left, 0);
  EXPECT_EQ(keeper_ear->came, 1);
}

}  // namespace
}  // namespace phantom::dds
