#include "common/observation/payload_type.hpp"

#include <algorithm>
#include <cstring>

namespace phantom::observation {

using fast_dds::rtps::SerializedPayload_t;

constexpr std::uint32_t kUsualSize = 1024;  // histories grow beyond it if samples need more

PayloadType::PayloadType(const std::string& name, bool keyed) : OwnType(name, keyed, kUsualSize) {}

bool PayloadType::write_to(SerializedPayload_t& payload, const void* sample) const {
  const auto& bytes = static_cast<const SerializedSample*>(sample)->bytes;
  if (bytes.size() < SerializedPayload_t::representation_header_size || bytes.size() > payload.max_size)
    return false;
  std::memcpy(payload.data, bytes.data(), bytes.size());
  payload.length = static_cast<std::uint32_t>(bytes.size());
  payload.encapsulation = static_cast<std::uint16_t>(bytes[0] << 8U | bytes[1]);
  return true;
}

bool PayloadType::read_from(const SerializedPayload_t& payload, void* sample) const {
  static_cast<SerializedSample*>(sample)->bytes.assign(payload.data, payload.data + payload.length);
  return true;
}

std::uint32_t PayloadType::size_of(const void* sample) const {
  return static_cast<std::uint32_t>(static_cast<const SerializedSample*>(sample)->bytes.size());
}

void PayloadType::key_of(const void* sample, fast_dds::rtps::InstanceHandle_t& key) const {
  const auto& instance = static_cast<const SerializedSample*>(sample)->instance;
  for (std::size_t i = 0; i < instance.size(); ++i) key.value[i] = instance[i];
}

bool register_type(eprosima::fastdds::dds::DomainParticipant& participant, const PayloadTopic& topic) {
  using eprosima::fastdds::dds::TypeSupport;
  const TypeSupport known = participant.find_type(topic.type);
  if (!known.empty())
    return dynamic_cast<PayloadType*>(known.get()) != nullptr && fast_dds::is_keyed(*known) == topic.keyed;
  const TypeSupport type(new PayloadType(topic.type, topic.keyed));
  return fast_dds::ok(type.register_type(&participant, topic.type));
}

}  // namespace phantom::observation
