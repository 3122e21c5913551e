#include "common/dds/transports.hpp"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>

#include "common/dds/serial_discovery.hpp"

namespace phantom::dds {
namespace {

namespace rtps = eprosima::fastdds::rtps;

// A late joiner's workspace comes as one burst. Fast DDS writes to all of a segment when it makes it: each
// MiB costs a process a millisecond at its start.
constexpr std::uint32_t kSocketBufferBytes = 4 << 20, kSharedSegmentBytes = 4 << 20;
// A message of many Ethernet frames is lost with any one of them, and what came of it holds memory for 30 s
// (Linux: ipfrag_time, 4 MiB): on a bad link that is soon full, and then nothing of several frames arrives.
// Not smaller: what a participant says of all its endpoints must fit into one (with 8000 bytes, some stayed
// unknown to others after it had stood still).
constexpr std::uint32_t kMessageBytes = 16000;

// Sends messages of kMessageBytes at most, and takes whole ones from those who send larger: Fast DDS asks the
// descriptor for the one, and the transport's copy of its members for the other.
struct UdpDescriptor : rtps::UDPv4TransportDescriptor {
  [[nodiscard]] std::uint32_t max_message_size() const override { return kMessageBytes; }
};

}  // namespace

std::vector<std::shared_ptr<rtps::TransportDescriptorInterface>> transports_of(
    const core::NetworkOptions& network) {
  auto udp = std::make_shared<UdpDescriptor>();
  udp->interfaceWhiteList = network.interfaces;
  udp->sendBufferSize = kSocketBufferBytes;
  udp->receiveBufferSize = kSocketBufferBytes;
  udp->maxInitialPeersRange = static_cast<std::uint32_t>(network.participants_per_host);
  std::vector<std::shared_ptr<rtps::TransportDescriptorInterface>> transports{udp};
  if (!network.security.empty()) transports = {std::make_shared<SerialDiscoveryDescriptor>(udp)};
  if (network.shared_memory) {
    auto shared = std::make_shared<rtps::SharedMemTransportDescriptor>();
    shared->segment_size(kSharedSegmentBytes);
    transports.push_back(shared);
  }
  return transports;
}

}  // namespace phantom::dds
