#include "common/dds/endpoints/cdr.hpp"

#include <algorithm>
#include <exception>

#include "common/dds/endpoints/topic_list.hpp"
#include "fast_dds/type_support.hpp"

namespace phantom::dds {
namespace {

using fast_dds::rtps::SerializedPayload_t;

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
bool CdrCodec::keyed() const { return fast_dds::is_keyed(*impl_->type); }

bool CdrCodec::decode(std::span<const std::uint8_t> bytes, void* sample) const {
  if (bytes.size() < SerializedPayload_t::representation_header_size) return false;
  Borrowed payload(bytes);
  try {
    return fast_dds::deserialise(*impl_->type, payload, sample);
  } catch (const std::exception&) {  // e.g. a sequence whose stated length exceeds memory
    return false;
  }
}

bool CdrCodec::encode(const void* sample, std::vector<std::uint8_t>& bytes) const {
  SerializedPayload_t payload;
  try {
    if (!fast_dds::serialise(*impl_->type, sample, payload)) return false;
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
  fast_dds::rtps::InstanceHandle_t handle;
  if (!fast_dds::find_key(*impl_->type, impl_->scratch, handle)) return false;
  std::copy_n(static_cast<const std::uint8_t*>(handle.value), instance.size(), instance.begin());
  return true;
}

const TopicDescription* topic_of_type(std::string_view type_name) {
  return find(type_name, &TopicDescription::type_name);
}
const TopicDescription* topic_named(std::string_view name) { return find(name, &TopicDescription::name); }

}  // namespace phantom::dds
