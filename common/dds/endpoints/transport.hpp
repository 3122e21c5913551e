#pragma once

#include <cstdint>
#include <memory>

#include "common/core/network.hpp"
#include "common/dds/admission/guarded_transport.hpp"

namespace phantom::dds {

/// Greatest messages that are sent over a network. IP never fragments them: many firewalls and tunnels drop
/// fragments. Every path that carries IPv6 carries packets of 1280 bytes, of which 48 are headers of IPv6 and
/// UDP. Fast DDS divides longer samples itself (DATA_FRAG) and repeats single lost fragments of reliable
/// topics.
inline constexpr std::uint32_t kNetworkMessageBytes = 1232;
/// Greatest messages where all traffic stays on the host, because its loopback carries them whole, and on
/// secured sites: Fast DDS 2.9.1 writes a handshake into the room of one message and has no handshake without
/// certificates and permissions in it ("Cannot serialize ParticipantGenericMessage"). So IP fragments
/// messages of secured sites; phantom-doctor tries whether fragments pass.
inline constexpr std::uint32_t kLongMessageBytes = 16000;

/// Returns the greatest message that a participant of that network sends.
std::uint32_t message_bytes_of(const core::NetworkOptions& network);

/// Returns the transport of a participant of that network: UDP on the interfaces that may be used, also
/// between processes of one host. It sends messages of message_bytes_of() at most and accepts larger ones.
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
