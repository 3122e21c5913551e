#include "common/dds/endpoints/transport.hpp"

#include <arpa/inet.h>

#include <algorithm>

#include "common/core/host/host_interfaces.hpp"
#include "fast_dds/participants.hpp"

namespace phantom::dds {
namespace {

constexpr std::uint32_t kSocketBufferBytes = 4 << 20;  // a late joiner receives the workspace as one burst
constexpr const char* kLoopback = "127.0.0.1";

// Sends messages of kMessageBytes at most, and accepts larger ones. Fast DDS asks the descriptor for the
// first limit, and the transport's copy of the descriptor's members for the second.
struct UdpDescriptor : fast_dds::rtps::UDPv4TransportDescriptor {
  [[nodiscard]] std::uint32_t max_message_size() const override { return kMessageBytes; }
};

// A discovery server on this host treats participants of its own host as local and sends to their loopback
// address, whatever interfaces they name.
std::vector<std::string> interfaces_of(const core::NetworkOptions& network) {
  std::vector<std::string> interfaces = network.interfaces;
  const auto names = [&interfaces](const std::string& address) {
    return std::find(interfaces.begin(), interfaces.end(), address) != interfaces.end();
  };
  const bool serves =
      std::any_of(network.discovery_servers.begin(), network.discovery_servers.end(),
                  [&names](const std::string& server) { return names(server.substr(0, server.rfind(':'))); });
  if (serves && !names(kLoopback)) interfaces.emplace_back(kLoopback);
  return interfaces;
}

// Larger than any sample of this product's topics: a chunk of a mesh has 256 kB, a brick without compression
// 160.
constexpr std::uint32_t kLargestSample = 1 << 20;
constexpr std::uint32_t kLargestForeignSample = 64 << 20;

/// Adds the /24 network of an address in dotted form.
void add_network(const std::string& dotted, std::vector<wire::Network>& networks) {
  in_addr address{};
  if (inet_pton(AF_INET, dotted.c_str(), &address) == 1)
    networks.push_back({ntohl(address.s_addr), 0xffffff00});
}

std::vector<wire::Network> networks_of(const core::NetworkOptions& network) {
  std::vector<wire::Network> networks;
  if (network.initial_peers.empty()) return networks;
  networks.push_back({0x7f000000, 0xff000000});
  for (const std::string& peer : network.initial_peers) add_network(peer, networks);
  for (const core::HostInterface& own : core::host_interfaces()) add_network(own.address, networks);
  return networks;
}

}  // namespace

std::shared_ptr<GuardedTransportDescriptor> transport_of(const core::NetworkOptions& network, bool observes,
                                                         bool asks_for_types) {
  auto udp = std::make_shared<UdpDescriptor>();
  udp->interfaceWhiteList = interfaces_of(network);
  udp->sendBufferSize = kSocketBufferBytes;
  udp->receiveBufferSize = kSocketBufferBytes;
  udp->maxInitialPeersRange = static_cast<std::uint32_t>(network.participants_per_host);
  auto guarded = std::make_shared<GuardedTransportDescriptor>(udp);
  guarded->guard.receiver.secured = !network.security.empty();
  if (guarded->guard.receiver.secured && !fast_dds::kSecuredHeedDepartures) {
    guarded->guard.forgets_by_silence = true;
    guarded->announcements = std::make_shared<Announcements>();
  }
  guarded->guard.crashes_on_interleaved_fragments = fast_dds::kEndsByMixedSamples;
  guarded->guard.receiver.asks_for_types = asks_for_types;
  guarded->guard.relayed = !network.discovery_servers.empty();
  if (!guarded->guard.relayed && !guarded->guard.receiver.secured)
    guarded->gaps = std::make_shared<DiscoveryGaps>();
  // Servers judge the leases of those whom they announce.
  if (!guarded->guard.relayed && !guarded->guard.forgets_by_silence) {
    guarded->guard.receiver.unchecked_leases = true;
    guarded->leases = std::make_shared<LeaseMonitor>();
  }
  guarded->guard.networks = networks_of(network);
  guarded->guard.participants_per_source = std::max(guarded->guard.participants_per_source,
                                                    static_cast<std::size_t>(network.participants_per_host));
  guarded->guard.sample_bytes = observes ? kLargestForeignSample : kLargestSample;
  return guarded;
}

}  // namespace phantom::dds
