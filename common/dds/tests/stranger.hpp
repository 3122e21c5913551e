#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <vector>

#include "common/dds/discovery.hpp"

namespace phantom::dds {

/// Where the participant "keeper" listens for announcements, as another one hears it.
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

}  // namespace phantom::dds
