#include "common/dds/transport.hpp"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <algorithm>

#include "common/dds/serial_discovery.hpp"

namespace phantom::dds {
namespace {

namespace transport = eprosima::fastdds::rtps;

constexpr std::uint32_t kSocketBufferBytes = 4 << 20;  // a late joiner receives the workspace as one burst
// A message of many Ethernet frames is lost if any one of them is lost, and the frames that did arrive hold
// memory for 30 s (Linux: ipfrag_time, 4 MiB): on a bad link that is soon full, and then no message of
// several frames arrives. Not smaller: the announcement of all endpoints of a participant must fit into one
// message (with 8000 bytes, some endpoints stayed unknown to others after the participant had not run
// for a while).
constexpr std::uint32_t kMessageBytes = 16000;
constexpr const char* kLoopback = "127.0.0.1";

// Sends messages of kMessageBytes at most, and accepts larger ones. Fast DDS asks the descriptor for the
// first limit, and the transport's copy of the descriptor's members for the second.
struct UdpDescriptor : transport::UDPv4TransportDescriptor {
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

}  // namespace

std::shared_ptr<transport::TransportDescriptorInterface> transport_of(const core::NetworkOptions& network) {
  auto udp = std::make_shared<UdpDescriptor>();
  udp->interfaceWhiteList = interfaces_of(network);
  udp->sendBufferSize = kSocketBufferBytes;
  udp->receiveBufferSize = kSocketBufferBytes;
  udp->maxInitialPeersRange = static_cast<std::uint32_t>(network.participants_per_host);
  if (network.security.empty()) return udp;
  return std::make_shared<SerialDiscoveryDescriptor>(udp);
}

}  // namespace phantom::dds
