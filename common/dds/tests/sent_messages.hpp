#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <functional>
#include <memory>
#include <span>

#include "common/core/network.hpp"
#include "fast_dds/transport.hpp"

namespace phantom::test {

/// Looks at each RTPS message that a participant sends; false: it is lost on its way.
using MessageFilter = std::function<bool(std::span<const std::uint8_t>)>;

/// Calls `visit(kind, fields)` for each submessage of a user's endpoint in an RTPS message (OMG
/// DDSI-RTPS 2.3, 8.3.3 and 9.4.5). Its fields begin with the flags and the length; the writer's entity id is
/// at 12 of a DATA or DATA_FRAG and at 8 of a HEARTBEAT.
template <class Visit>
void for_each_submessage(std::span<const std::uint8_t> message, const Visit& visit) {
  for (std::size_t at = 20; at + 4 <= message.size();) {
    const bool little = (message[at + 1] & 1) != 0;
    const std::size_t length =
        little ? message[at + 2] + 256U * message[at + 3] : 256U * message[at + 2] + message[at + 3];
    const std::size_t whole = length == 0 ? message.size() - at : std::min(4 + length, message.size() - at);
    visit(message[at], message.subspan(at, whole));
    at += whole;
  }
}

/// UDP as the shipped participants have it, whose messages go through a filter.
struct FilteredDescriptor : fast_dds::rtps::ChainingTransportDescriptor {
  using ChainingTransportDescriptor::ChainingTransportDescriptor;
  [[nodiscard]] fast_dds::rtps::TransportInterface* create_transport() const override;
  MessageFilter passes;
};

class FilteredTransport final : public fast_dds::MessageTransport {
 public:
  explicit FilteredTransport(const FilteredDescriptor& descriptor)
      : MessageTransport(descriptor), descriptor_(descriptor) {}
  fast_dds::rtps::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }
  bool send_on(fast_dds::rtps::SenderResource& below, const fast_dds::OutgoingMessage& message) override {
    return !descriptor_.passes(message.octets()) || message.send_by(below);
  }
  void receive(fast_dds::rtps::TransportReceiverInterface* above, const fast_dds::rtps::octet* message,
               std::uint32_t size, const fast_dds::rtps::Locator_t& local,
               const fast_dds::rtps::Locator_t& remote) override {
    above->OnDataReceived(message, size, local, remote);
  }

 private:
  FilteredDescriptor descriptor_;
};

inline fast_dds::rtps::TransportInterface* FilteredDescriptor::create_transport() const {
  return new FilteredTransport(*this);
}

/// Quality of service of a participant whose messages go through `passes`; none is longer than
/// `message_bytes`.
inline eprosima::fastdds::dds::DomainParticipantQos filtered_participant(
    const core::NetworkOptions& network, MessageFilter passes, std::uint32_t message_bytes = 65500) {
  eprosima::fastdds::dds::DomainParticipantQos qos;
  qos.transport().use_builtin_transports = false;
  auto udp = std::make_shared<fast_dds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = network.interfaces;
  udp->receiveBufferSize = udp->sendBufferSize = 4 << 20;
  udp->maxMessageSize = message_bytes;
  auto filtered = std::make_shared<FilteredDescriptor>(udp);
  filtered->passes = std::move(passes);
  qos.transport().user_transports.push_back(filtered);
  return qos;
}

}  // namespace phantom::test
