#include "common/dds/cdr.hpp"

#include <fastdds/rtps/common/InstanceHandle.h>
#include <fastdds/rtps/common/SerializedPayload.h>

#include <algorithm>
#include <exception>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include "common/dds/topic_list.hpp"

namespace phantom::dds {
namespace {

using eprosima::fastrtps::rtps::SerializedPayload_t;

/// A payload over bytes that the caller owns, for the duration of one call.
class Borrowed : public SerializedPayload_t {
 public:
  explicit Borrowed(std::span<const std::uint8_t> bytes) {
    data = const_cast<std::uint8_t*>(bytes.data());
    length = max_size = static_cast<std::uint32_t>(bytes.size());
  }
  ~Borrowed() { data = nullptr; }
};

const TopicDescription* find(std::string_view wanted, const char* TopicDescription::*field) {
  for (const TopicDescription* topic : all_topics()) {
    if (wanted == topic->*field) return topic;
  }
  return nullptr;
}

}  // namespace

struct CdrCodec::Impl {
  explicit Impl(const TopicDescription& described)
      : topic(described), type(described.make_type()), scratch(type.create_data()) {}
  ~Impl() { type.delete_data(scratch); }
  const TopicDescription& topic;
  eprosima::fastdds::dds::TypeSupport type;
  void* scratch;
};

CdrCodec::CdrCodec(const TopicDescription& topic) : impl_(std::make_unique<Impl>(topic)) {}
CdrCodec::~CdrCodec() = default;
CdrCodec::CdrCodec(CdrCodec&&) noexcept = default;

const TopicDescription& CdrCodec::topic() const { return impl_->topic; }
bool CdrCodec::keyed() const { return impl_->type->m_isGetKeyDefined; }

bool CdrCodec::decode(std::span<const std::uint8_t> bytes, void* sample) const {
  if (bytes.size() < SerializedPayload_t::representation_header_size) return false;
  Borrowed payload(bytes);
  try {
    return impl_->type->deserialize(&payload, sample);
  } catch (const std::exception&) {  // e.g. a sequence whose stated length exceeds memory
    return false;
  }
}

bool CdrCodec::encode(const void* sample, std::vector<std::uint8_t>& bytes) const {
  auto* given = const_cast<void*>(sample);
  SerializedPayload_t payload(impl_->type->getSerializedSizeProvider(given)());
  try {
    if (!impl_->type->serialize(given, &payload)) return false;
  } catch (const std::exception&) {
    return false;
  }
  bytes.assign(payload.data, payload.data + payload.length);
  return true;
}

bool CdrCodec::instance_of(std::span<const std::uint8_t> bytes, InstanceKey& instance) const {
  instance = {};
  if (!keyed()) return true;
  if (!decode(bytes, impl_->scratch)) return false;
  eprosima::fastrtps::rtps::InstanceHandle_t handle;
  if (!impl_->type->getKey(impl_->scratch, &handle, false)) return false;
  std::copy_n(static_cast<const std::uint8_t*>(handle.value), instance.size(), instance.begin());
  return true;
}

const TopicDescription* topic_of_type(std::string_view type_name) {
  return find(type_name, &TopicDescription::type_name);
}
const TopicDescription* topic_named(std::string_view name) { return find(name, &TopicDescription::name); }

}  // namespace phantom::dds
