#pragma once

#include <fastdds/rtps/attributes/RTPSParticipantAttributes.h>
#include <fastdds/rtps/attributes/ServerAttributes.h>
#include <fastrtps/attributes/LibrarySettingsAttributes.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>

#include <cstdio>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <vector>

#include "fast_dds/types.hpp"

namespace phantom::fast_dds {

/// Lets a participant announce itself to discovery servers alone; the n-th is `fast-discovery-server -i n`.
/// `whole`: it receives every endpoint, not only those that match its own.
inline void use_discovery_servers(rtps::DiscoverySettings& discovery,
                                  const std::vector<rtps::Locator_t>& servers, bool whole) {
  using Protocol = rtps::DiscoveryProtocol_t;
  discovery.discoveryProtocol = whole ? Protocol::SUPER_CLIENT : Protocol::CLIENT;
  for (std::size_t id = 0; id < servers.size(); ++id) {
    rtps::RemoteServerAttributes server;
    char prefix[64];  // the GUID prefix of a server with that number
    std::snprintf(prefix, sizeof prefix, "44.53.%02zx.5f.45.50.52.4f.53.49.4d.41", id);
    server.ReadguidPrefix(prefix);
    server.metatrafficUnicastLocatorList.push_back(servers[id]);
    discovery.m_DiscoveryServers.push_back(server);
  }
}

/// Sets whether the owners of endpoints are asked to describe their types. Version 2 never asks.
inline void ask_for_types(eprosima::fastdds::dds::DomainParticipantQos&, bool) {}

/// Whether a secured participant forgets another one that says in the clear that it leaves.
inline constexpr bool kSecuredHeedDepartures = true;

/// Whether a best-effort reader ends the process when a whole sample follows one that lacks a fragment.
inline constexpr bool kEndsByMixedSamples = false;

/// Participants of one process exchange samples as those of two do.
inline void deliver_by_transport() {
  eprosima::fastrtps::LibrarySettingsAttributes settings;
  settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
  eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
}

}  // namespace phantom::fast_dds
