#pragma once

#include <fastdds/rtps/transport/TransportDescriptorInterface.h>

#include <memory>
#include <vector>

#include "common/core/network.hpp"

namespace phantom::dds {

/// What a participant of that network sends and hears by: UDP on the interfaces that may be used, and shared
/// memory if it may be. Messages are of 16 kB at most; larger ones of others are taken. If the network is
/// secured, discovery by UDP is heard one message at a time (SerialDiscoveryDescriptor).
///
/// Private to common/dds.
std::vector<std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface>> transports_of(
    const core::NetworkOptions& network);

}  // namespace phantom::dds
