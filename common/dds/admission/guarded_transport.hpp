#pragma once

#include <memory>

#include "common/dds/admission/bans.hpp"
#include "common/dds/admission/refused_datagrams.hpp"
#include "common/dds/arbitration/announcements.hpp"
#include "common/dds/arbitration/discovery_gaps.hpp"
#include "common/dds/endpoints/outbox.hpp"
#include "common/dds/recovery/lease_monitor.hpp"
#include "common/wire/guard.hpp"
#include "fast_dds/transport.hpp"

namespace phantom::dds {

/// Describes a transport that checks every datagram before Fast DDS parses it (common/wire), counts what it
/// refuses, and sends what RediscoveryManager leaves in the outbox. Nothing of a banned participant passes;
/// Fast DDS forgets it at once.
///
/// It passes on messages of discovery and handshakes one at a time, from however many sockets they come, and
/// samples as they come. If two threads of Fast DDS 2.9.1, one at a multicast and one at a unicast socket,
/// discover two secured participants at once, they overwrite each other's state
/// (SecurityManager::match_builtin_endpoints), and one of the two participants is admitted only when its
/// handshake restarts (RediscoveryManager); and many that come and go at once make threads wait for each
/// other.
///
/// Discovery is distinguished from samples by the port, which is even for discovery and odd for samples (OMG
/// DDSI-RTPS 2.3, 9.6.1.1, with the standard's offsets), and by what a message holds.
///
/// Private to common/dds.
struct GuardedTransportDescriptor : fast_dds::rtps::ChainingTransportDescriptor {
  using fast_dds::rtps::ChainingTransportDescriptor::ChainingTransportDescriptor;
  /// The caller owns the transport.
  [[nodiscard]] fast_dds::rtps::TransportInterface* create_transport() const override;

  wire::GuardOptions guard;
  std::shared_ptr<RefusedDatagrams> refused = std::make_shared<RefusedDatagrams>();
  std::shared_ptr<Outbox> outbox = std::make_shared<Outbox>();
  std::shared_ptr<Bans> bans = std::make_shared<Bans>();
  std::shared_ptr<Announcements> announcements;  ///< null: nobody asks for them
  std::shared_ptr<DiscoveryGaps> gaps;           ///< null: nobody asks for them
  std::shared_ptr<LeaseMonitor> leases;          ///< null: Fast DDS judges leases
};

}  // namespace phantom::dds
