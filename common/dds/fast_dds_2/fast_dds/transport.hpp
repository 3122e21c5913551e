#pragma once

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>
#include <fastdds/rtps/transport/TransportReceiverInterface.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <chrono>
#include <span>
#include <vector>

#include "fast_dds/types.hpp"

namespace phantom::fast_dds {

/// A message on its way out, for the duration of one call.
class OutgoingMessage {
 public:
  using Deadline = std::chrono::steady_clock::time_point;

  OutgoingMessage(std::span<const std::uint8_t> octets, rtps::LocatorsIterator* first,
                  rtps::LocatorsIterator* last, Deadline deadline)
      : octets_(octets), first_(first), last_(last), deadline_(deadline) {}
  /// Sends it, as far as that is possible before the deadline.
  bool send_by(rtps::SenderResource& sender) const {
    return sender.send(octets_.data(), static_cast<std::uint32_t>(octets_.size()), first_, last_, deadline_);
  }
  std::vector<std::uint8_t> octets() const { return {octets_.begin(), octets_.end()}; }

 private:
  std::span<const std::uint8_t> octets_;
  rtps::LocatorsIterator *first_, *last_;
  Deadline deadline_;
};

/// A transport in front of another one.
class MessageTransport : public eprosima::fastdds::rtps::ChainingTransport {
 public:
  using ChainingTransport::ChainingTransport;

 protected:
  /// Sends a message by a sender of the transport below.
  virtual bool send_on(rtps::SenderResource& below, const OutgoingMessage& message) = 0;

 private:
  bool send(rtps::SenderResource* below, const rtps::octet* message, std::uint32_t size,
            rtps::LocatorsIterator* first, rtps::LocatorsIterator* last,
            const OutgoingMessage::Deadline& deadline) final {
    return send_on(*below, OutgoingMessage({message, size}, first, last, deadline));
  }
};

}  // namespace phantom::fast_dds
