// A stranger on the network: for some seconds it answers each participant's announcement that it hears by
// multicast on loopback with departures in that participant's name, from a socket of its own, to every
// participant's port of discovery. Prints how many participants it has sent away, and how often in all.
//
//   forger DOMAIN SECONDS
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <set>

#include "common/dds/recovery/departure.hpp"

namespace {

using phantom::dds::GuidPrefix;
using std::chrono::steady_clock;

constexpr int kMaxParticipants = 8;
constexpr std::chrono::milliseconds kBetween{100};

sockaddr_in at(std::uint32_t address, int port) {
  sockaddr_in made{};
  made.sin_family = AF_INET;
  made.sin_addr.s_addr = htonl(address);
  made.sin_port = htons(static_cast<std::uint16_t>(port));
  return made;
}

/// A socket that hears the domain's announcements by multicast, beside the participants of this host.
int listener(int port) {
  constexpr std::uint32_t kAnnouncements = 0xefff0001;  // 239.255.0.1
  const int in = socket(AF_INET, SOCK_DGRAM, 0);
  const int yes = 1;
  setsockopt(in, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const sockaddr_in here = at(kAnnouncements, port);
  const ip_mreq group{{htonl(kAnnouncements)}, {htonl(INADDR_LOOPBACK)}};
  const bool good = bind(in, reinterpret_cast<const sockaddr*>(&here), sizeof here) == 0 &&
                    setsockopt(in, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) == 0;
  return good ? in : -1;
}

/// Adds whoever is heard before `end`.
void listen_until(steady_clock::time_point end, int in, std::set<GuidPrefix>& heard) {
  for (;;) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(end - steady_clock::now()).count();
    pollfd one{in, POLLIN, 0};
    if (left <= 0 || poll(&one, 1, static_cast<int>(left)) <= 0) return;
    std::array<std::uint8_t, 65536> message;
    if (recv(in, message.data(), message.size(), 0) < 20) continue;
    GuidPrefix sender;
    std::copy_n(message.begin() + 8, sender.size(), sender.begin());
    heard.insert(sender);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: forger DOMAIN SECONDS\n");
    return 2;
  }
  const int base = 7400 + 250 * std::atoi(argv[1]);  // DDSI-RTPS 9.6.1.1
  const int in = listener(base), out = socket(AF_INET, SOCK_DGRAM, 0);
  if (in < 0) {
    std::perror("forger");
    return 1;
  }
  const auto end = steady_clock::now() + std::chrono::seconds(std::atoi(argv[2]));
  std::set<GuidPrefix> heard;
  long sent = 0;
  while (steady_clock::now() < end) {
    listen_until(steady_clock::now() + kBetween, in, heard);
    for (const GuidPrefix& named : heard) {
      for (int number = 0; number < kMaxParticipants; ++number) {
        const auto message = phantom::dds::departure(named, GuidPrefix{}, phantom::dds::kDepartureSequence);
        const sockaddr_in to = at(INADDR_LOOPBACK, base + 10 + 2 * number);
        sent += sendto(out, message.data(), message.size(), 0, reinterpret_cast<const sockaddr*>(&to),
                       sizeof to) > 0
                    ? 1
                    : 0;
      }
    }
  }
  std::printf("%zu %ld\n", heard.size(), sent);
  return 0;
}
