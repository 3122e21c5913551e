#pragma once

#include <chrono>
#include <fastdds/rtps/transport/ChainingTransport.hpp>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.hpp>
#include <fastdds/rtps/transport/NetworkBuffer.hpp>
#include <fastdds/rtps/transport/SenderResource.hpp>
#include <fastdds/rtps/transport/TransportReceiverInterface.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <span>
#include <vector>

#include "fast_dds/types.hpp"

namespace phantom::fast_dds {

/// A message on its way out, for the duration of one call.
class OutgoingMessage {
 public:
  using Deadline = std::chrono::steady_clock::time_point;
  using Buffers = std::vector<rtps::NetworkBuffer>;

  OutgoingMessage(const Buffers& buffers, std::uint32_t size, rtps::LocatorsIterator* first,
                  rtps::LocatorsIterator* last, Deadline deadline)
      : buffers_(buffers), size_(size), first_(first), last_(last), deadline_(deadline) {}
  OutgoingMessage(std::span<const std::uint8_t> octets, rtps::LocatorsIterator* first,
                  rtps::LocatorsIterator* last, Deadline deadline)
      : own_{{octets.data(), static_cast<std::uint32_t>(octets.size())}},
        buffers_(own_),
        size_(static_cast<std::uint32_t>(octets.size())),
        first_(first),
        last_(last),
        deadline_(deadline) {}
  OutgoingMessage(const OutgoingMessage&) = delete;
  OutgoingMessage& operator=(const OutgoingMessage&) = delete;

  /// Sends it, as far as that is possible before the deadline.
  bool send_by(rtps::SenderResource& sender) const {
    return sender.send(buffers_, size_, first_, last_, deadline_);
  }
  std::vector<std::uint8_t> octets() const {
    std::vector<std::uint8_t> all;
    for (const rtps::NetworkBuffer& part : buffers_) {
      const auto* first = static_cast<const std::uint8_t*>(part.buffer);
      all.insert(all.end(), first, first + part.size);
    }
    return all;
  }

 private:
  Buffers own_;
  const Buffers& buffers_;
  std::uint32_t size_;
  rtps::LocatorsIterator *first_, *last_;
  Deadline deadline_;
};

/// A transport in front of another one.
class MessageTransport : public rtps::ChainingTransport {
 public:
  using ChainingTransport::ChainingTransport;

 protected:
  /// Sends a message by a sender of the transport below.
  virtual bool send_on(rtps::SenderResource& below, const OutgoingMessage& message) = 0;

 private:
  bool send(rtps::SenderResource* below, const OutgoingMessage::Buffers& buffers, std::uint32_t size,
            rtps::LocatorsIterator* first, rtps::LocatorsIterator* last,
            const OutgoingMessage::Deadline& deadline) final {
    return send_on(*below, OutgoingMessage(buffers, size, first, last, deadline));
  }
};

}  // namespace phantom::fast_dds
