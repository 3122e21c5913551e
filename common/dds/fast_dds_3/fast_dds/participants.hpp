#pragma once

#include <fastdds/LibrarySettings.hpp>
#include <fastdds/dds/core/policy/ParameterTypes.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/rtps/attributes/RTPSParticipantAttributes.hpp>
#include <vector>

#include "fast_dds/types.hpp"

namespace phantom::fast_dds {

/// Lets a participant announce itself to discovery servers alone. `whole`: it receives every endpoint, not
/// only those that match its own.
inline void use_discovery_servers(rtps::DiscoverySettings& discovery,
                                  const std::vector<rtps::Locator_t>& servers, bool whole) {
  using Protocol = rtps::DiscoveryProtocol;
  discovery.discoveryProtocol = whole ? Protocol::SUPER_CLIENT : Protocol::CLIENT;
  for (const rtps::Locator_t& server : servers) discovery.m_DiscoveryServers.push_back(server);
}

/// Sets whether the owners of endpoints are asked to describe their types. Version 3 asks everybody unless it
/// is told not to, reads what strangers answer, and leaves an endpoint out until its owner has answered.
inline void ask_for_types(eprosima::fastdds::dds::DomainParticipantQos& qos, bool ask) {
  qos.properties().properties().emplace_back(eprosima::fastdds::dds::parameter_policy_type_propagation,
                                             ask ? "enabled" : "disabled");
}

/// Whether a secured participant forgets another one that says in the clear that it leaves. Only its lease,
/// or a departure by the secured writer of discovery, ends it (PDPListener).
inline constexpr bool kSecuredHeedDepartures = false;

/// Whether a best-effort reader ends the process when a whole sample follows one that lacks a fragment
/// (StatelessReader::process_data_frag_msg, an assertion that Debian compiles in).
inline constexpr bool kEndsByMixedSamples = true;

/// Participants of one process exchange samples as those of two do.
inline void deliver_by_transport() {
  eprosima::fastdds::LibrarySettings settings;
  settings.intraprocess_delivery = eprosima::fastdds::INTRAPROCESS_OFF;
  eprosima::fastdds::dds::DomainParticipantFactory::get_instance()->set_library_settings(settings);
}

}  // namespace phantom::fast_dds
