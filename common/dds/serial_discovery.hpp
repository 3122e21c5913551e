#pragma once

#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>

namespace phantom::dds {

/// Describes a transport that passes on messages of discovery and handshakes one at a time, from however many
/// sockets they come, and samples as they come. For secured participants: if two threads of Fast DDS 2.9.1,
/// one at a multicast and one at a unicast socket, discover two participants at once, they overwrite each
/// other's state (SecurityManager::match_builtin_endpoints), and one of the two participants is admitted only
/// when its handshake restarts (Readmission).
///
/// Discovery is distinguished from samples by the port, which is even for discovery and odd for samples (OMG
/// DDSI-RTPS 2.3, 9.6.1.1, with the standard's offsets).
///
/// Private to common/dds.
struct SerialDiscoveryDescriptor : eprosima::fastdds::rtps::ChainingTransportDescriptor {
  using eprosima::fastdds::rtps::ChainingTransportDescriptor::ChainingTransportDescriptor;
  /// The caller owns the transport.
  [[nodiscard]] eprosima::fastdds::rtps::TransportInterface* create_transport() const override;
};

}  // namespace phantom::dds
