#pragma once

#include <fastdds/rtps/transport/TransportDescriptorInterface.h>

#include <memory>

#include "common/core/network.hpp"

namespace phantom::dds {

/// What a participant of that network sends and hears by: UDP on the interfaces that may be used, also
/// between processes of one host. Messages are of 16 kB at most; larger ones of others are taken. If the
/// network is secured, discovery is heard one message at a time (SerialDiscoveryDescriptor). On the host of a
/// discovery server the loopback interface is used beside those that are named.
///
/// Not by shared memory. Fast DDS 2.9.1 keeps a queue in it for each port, and a restarted process has the
/// port of the one before: it makes a new queue, while whoever has the old one open goes on filling that,
/// unless the process was killed while it waited for a message (SharedMemGlobal.hpp,
/// update_status_all_listeners). Nor is a queue's lock given back by who is killed or stands still with it:
/// others' writes wait for it a second.
///
/// Private to common/dds.
std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> transport_of(
    const core::NetworkOptions& network);

}  // namespace phantom::dds
