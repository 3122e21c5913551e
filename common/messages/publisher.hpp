#pragma once

#include <utility>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"

namespace phantom::messages {

/// Publishes samples on their topic: converts each by the topic's codec, and stamps it. One thread. Include
/// the codec, too.
template <class Sample>
class Publisher {
 public:
  using Message = decltype(to_idl(std::declval<const Sample&>()));

  /// Throws DdsError.
  Publisher(dds::Participant& participant, const dds::TopicSpec<Message>& topic)
      : stamper_(participant), writer_(participant, topic) {}
  /// Returns false if the sample could not be queued. May block, as dds::Writer::write().
  bool publish(const Sample& sample) {
    Message message = to_idl(sample);
    message.stamp(stamper_.next());
    return writer_.write(message);
  }
  std::uint32_t matched() const { return writer_.matched(); }

 private:
  dds::Stamper stamper_;
  dds::Writer<Message> writer_;
};

}  // namespace phantom::messages
