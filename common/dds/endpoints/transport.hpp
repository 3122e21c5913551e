#pragma once

#include <cstdint>
#include <memory>

#include "common/core/network.hpp"
#include "common/dds/admission/guarded_transport.hpp"

namespace phantom::dds {

/// Greatest messages that are sent. IP fragments those of a network whose frames are shorter; phantom-doctor
/// tries whether fragments pass. Not smaller: what a participant announces of its endpoints must fit into one
/// message. With 8000 bytes some endpoints stayed unknown after a process had stood still; with 1232, on a
/// bad link, an observer did not hear a topic for minutes. On secured sites Fast DDS 2.9.1 also writes a
/// handshake into the room of one message ("Cannot serialize ParticipantGenericMessage"). Not larger: a
/// message of many frames is lost if one of them is lost.
inline constexpr std::uint32_t kMessageBytes = 16000;

/// Returns the transport of a participant of that network: UDP on the interfaces that may be used, also
/// between processes of one host. It sends messages of kMessageBytes at most and accepts larger ones.
/// Each datagram is checked before Fast DDS parses it (GuardedTransportDescriptor). If the network names its
/// peers, only senders in the networks (/24) of these, of this host's interfaces and of the loopback are
/// heard. `observes`: the participant reads topics of others, too, whose samples may be large.
/// `asks_for_types`: it asks them to describe the types. On the host of a discovery server it also uses the
/// loopback interface.
///
/// It does not use shared memory. Fast DDS 2.9.1 keeps a shared-memory queue for each port, and a restarted
/// process has the port of the one before. It creates a new queue, while a process that has the old queue
/// open goes on filling that, unless the previous process was killed while it waited for a message
/// (SharedMemGlobal.hpp, update_status_all_listeners). Also, a process that is killed or suspended while it
/// holds a queue's lock does not release it: the writes of others wait for it for a second.
///
/// Private to common/dds.
std::shared_ptr<GuardedTransportDescriptor> transport_of(const core::NetworkOptions& network, bool observes,
                                                         bool asks_for_types = false);

}  // namespace phantom::dds
