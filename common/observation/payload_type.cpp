#include "common/observation/payload_type.hpp"

#include <fastdds/rtps/common/InstanceHandle.h>
#include <fastdds/rtps/common/SerializedPayload.h>

#include <cstring>

namespace phantom::observation {

using Bytes = std::vector<std::uint8_t>;
using eprosima::fastrtps::rtps::SerializedPayload_t;

constexpr std::uint32_t kUsualSize = 1024;  // histories grow beyond it if samples need more

PayloadType::PayloadType(const std::string& name, bool keyed) {
  setName(name.c_str());
  m_typeSize = kUsualSize;
  m_isGetKeyDefined = keyed;
  auto_fill_type_object(false);
  auto_fill_type_information(false);
}

bool PayloadType::serialize(void* data, SerializedPayload_t* payload) {
  const auto& bytes = *static_cast<const Bytes*>(data);
  if (bytes.size() < SerializedPayload_t::representation_header_size || bytes.size() > payload->max_size)
    return false;
  std::memcpy(payload->data, bytes.data(), bytes.size());
  payload->length = static_cast<std::uint32_t>(bytes.size());
  payload->encapsulation = static_cast<std::uint16_t>(bytes[0] << 8U | bytes[1]);
  return true;
}

bool PayloadType::deserialize(SerializedPayload_t* payload, void* data) {
  static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
  return true;
}

std::function<std::uint32_t()> PayloadType::getSerializedSizeProvider(void* data) {
  return [data] { return static_cast<std::uint32_t>(static_cast<const Bytes*>(data)->size()); };
}

bool PayloadType::getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t* handle, bool) {
  if (!m_isGetKeyDefined) return false;
  for (std::size_t i = 0; i < 16; ++i) handle->value[i] = 0;
  handle->value[0] = 1;  // all zeros would be an invalid handle
  return true;
}

}  // namespace phantom::observation
