#include "common/dds/admission/guarded_transport.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

#include "common/wire/tests/messages.hpp"

namespace phantom::dds {
namespace {

using fast_dds::rtps::IPLocator;
using fast_dds::rtps::Locator_t;
namespace transport = fast_dds::rtps;
using namespace std::chrono_literals;

constexpr auto kLimit = 60s;  // only bounds a failing test

/// Stays in each message until another is in, too, or for `stay`; keeps how many were in at once.
class Visitors : public transport::TransportReceiverInterface {
 public:
  std::chrono::milliseconds stay = kLimit;

  void OnDataReceived(const fast_dds::rtps::octet* /*data*/, std::uint32_t /*size*/,
                      const Locator_t& /*local*/, const Locator_t& /*remote*/) override {
    std::unique_lock lock(mutex_);
    most_ = std::max(most_, ++inside_);
    changed_.notify_all();
    changed_.wait_for(lock, stay, [&] { return most_ > 1; });
    --inside_;
    ++left_;
    changed_.notify_all();
  }

  /// How many were in at once, once `count` have left.
  int most_of(int count) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(changed_.wait_for(lock, kLimit, [&] { return left_ >= count; })) << "messages do not arrive";
    return most_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int inside_ = 0, most_ = 0, left_ = 0;
};

class GuardedTransport : public ::testing::Test {
 protected:
  GuardedTransport() {
    auto udp = std::make_shared<transport::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList = {"127.0.0.1"};
    GuardedTransportDescriptor guarded(udp);
    refused_ = guarded.refused;
    transport_.reset(guarded.create_transport());
    EXPECT_TRUE(transport_->init());
  }
  ~GuardedTransport() override {
    for (const auto& open : open_) transport_->CloseInputChannel(open);
    ::close(socket_);
  }

  /// Listens at a free port that is even or odd, as asked.
  void listen(bool even) {
    for (std::uint32_t port = 36000 + (even ? 0 : 1); port < 60000; port += 2) {
      Locator_t locator;
      locator.kind = LOCATOR_KIND_UDPv4;
      IPLocator::setIPv4(locator, "127.0.0.1");
      locator.port = port;
      if (!is_free(port) || !transport_->OpenInputChannel(locator, &visitors_, 1000)) continue;
      open_.push_back(locator);
      return;
    }
    FAIL() << "no port is free";
  }

  void send_to_all(const std::vector<std::uint8_t>& datagram = wire::test::header()) {
    for (const auto& open : open_) {
      const sockaddr_in to = address(open.port);
      ASSERT_EQ(::sendto(socket_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&to),
                         sizeof to),
                static_cast<ssize_t>(datagram.size()));
    }
  }

  Visitors visitors_;
  std::shared_ptr<RefusedDatagrams> refused_;

 private:
  static sockaddr_in address(std::uint32_t port) {
    sockaddr_in made{};
    made.sin_family = AF_INET;
    made.sin_port = htons(static_cast<std::uint16_t>(port));
    made.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return made;
  }

  static bool is_free(std::uint32_t port) {
    const int probe = ::socket(AF_INET, SOCK_DGRAM, 0);
    const sockaddr_in at = address(port);
    const bool bound = ::bind(probe, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
    ::close(probe);
    return bound;
  }

  std::unique_ptr<transport::TransportInterface> transport_;
  std::vector<Locator_t> open_;
  const int socket_ = ::socket(AF_INET, SOCK_DGRAM, 0);
};

TEST_F(GuardedTransport, PassesOnOneMessageOfDiscoveryAtATime) {
  visitors_.stay = 200ms;
  listen(true);
  listen(true);
  send_to_all();
  EXPECT_EQ(visitors_.most_of(2), 1);
}

TEST_F(GuardedTransport, LetsSamplesPassBesideDiscovery) {
  listen(true);
  listen(false);
  send_to_all();
  EXPECT_EQ(visitors_.most_of(2), 2);
}

TEST_F(GuardedTransport, LetsSamplesPassBesideEachOther) {
  listen(false);
  listen(false);
  send_to_all();
  EXPECT_EQ(visitors_.most_of(2), 2);
}

TEST_F(GuardedTransport, RefusesAndCountsWhatIsNotSound) {
  visitors_.stay = 0ms;
  listen(true);
  send_to_all({'h', 'e', 'l', 'l', 'o'});
  send_to_all(wire::test::message({wire::test::fragment_submessage({.first = 0})}));
  send_to_all();
  EXPECT_EQ(visitors_.most_of(1), 1) << "the third arrives";
  const auto refused = refused_->list();
  ASSERT_EQ(refused.size(), 2u);
  EXPECT_EQ(refused[0].fault, wire::Fault::kHeader);
  EXPECT_EQ(refused[1].fault, wire::Fault::kFragment);
  EXPECT_EQ(refused[0].last.address, 0x7f000001u);
  EXPECT_EQ(to_text(refused[0].last).substr(0, 10), "127.0.0.1:");
}

}  // namespace
}  // namespace phantom::dds
