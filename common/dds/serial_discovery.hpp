#pragma once

#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>

namespace phantom::dds {

/// Describes a transport that passes on what it hears of discovery and handshakes one message at a time,
/// however many sockets that comes by, and samples as they come. For secured participants: if two threads of
/// Fast DDS 2.9.1, one at a multicast and one at a unicast socket, hear of two participants at once, they
/// overwrite each other's notes (SecurityManager::match_builtin_endpoints), and one of the two is admitted
/// only when its handshake is begun anew (Readmission).
///
/// Discovery is told from samples by the port, which is even for the one and odd for the other (OMG
/// DDSI-RTPS 2.3, 9.6.1.1, with the standard's offsets).
///
/// Private to common/dds.
struct SerialDiscoveryDescriptor : eprosima::fastdds::rtps::ChainingTransportDescriptor {
  using eprosima::fastdds::rtps::ChainingTransportDescriptor::ChainingTransportDescriptor;
  /// The caller owns it.
  [[nodiscard]] eprosima::fastdds::rtps::TransportInterface* create_transport() const override;
};

}  // namespace phantom::dds
