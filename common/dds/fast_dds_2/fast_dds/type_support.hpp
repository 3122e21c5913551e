#pragma once

#include <exception>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <span>
#include <string>
#include <string_view>

#include "common/dds/endpoints/encapsulation.hpp"
#include "fast_dds/types.hpp"

namespace phantom::fast_dds {

/// Keeps descriptions of a type out of what its endpoints announce.
inline void announce_name_only(eprosima::fastdds::dds::TopicDataType& type) {
  type.auto_fill_type_object(false);
  type.auto_fill_type_information(false);
}

inline bool is_keyed(const eprosima::fastdds::dds::TopicDataType& type) { return type.m_isGetKeyDefined; }

/// Serialises a sample by a type. Returns false if it exceeds the bounds of the type. Throws what the
/// generated code throws.
inline bool serialise(eprosima::fastdds::dds::TopicDataType& type, const void* sample,
                      rtps::SerializedPayload_t& payload) {
  auto* given = const_cast<void*>(sample);
  payload.reserve(type.getSerializedSizeProvider(given)());
  return type.serialize(given, &payload);
}
inline bool deserialise(eprosima::fastdds::dds::TopicDataType& type, rtps::SerializedPayload_t& payload,
                        void* sample) {
  return type.deserialize(&payload, sample);
}
inline bool find_key(eprosima::fastdds::dds::TopicDataType& type, const void* sample,
                     rtps::InstanceHandle_t& key) {
  return type.getKey(const_cast<void*>(sample), &key, false);
}

/// A generated type that takes octets which are no sample of it for that. The generated code lets exceptions
/// out, in a thread of Fast DDS: a stranger's sample with an encapsulation that is not CDR's would end the
/// process.
template <class PubSubType>
class Refusing : public PubSubType {
 public:
  bool deserialize(rtps::SerializedPayload_t* payload, void* sample) override {
    if (!dds::is_plain_cdr(payload->data, payload->length)) return false;
    try {
      return PubSubType::deserialize(payload, sample);
    } catch (const std::exception&) {
      return false;
    }
  }
};

/// A generated type whose octets `kScreen`, a bool(std::string_view type_name, std::span<const
/// std::uint8_t>), looks at before anything is decoded of them: what it refuses is none of the type's
/// samples.
template <class PubSubType, auto kScreen>
class Screened : public Refusing<PubSubType> {
  bool deserialize(rtps::SerializedPayload_t* payload, void* sample) override {
    return kScreen(this->getName(), std::span<const std::uint8_t>(payload->data, payload->length)) &&
           Refusing<PubSubType>::deserialize(payload, sample);
  }
};

/// A type whose samples are written and read by its own functions.
class OwnType : public eprosima::fastdds::dds::TopicDataType {
 public:
  /// `usual_size`: octets of a payload; histories grow if a sample needs more.
  OwnType(const std::string& name, bool keyed, std::uint32_t usual_size) {
    setName(name.c_str());
    m_typeSize = usual_size;
    m_isGetKeyDefined = keyed;
    announce_name_only(*this);
  }

 protected:
  virtual bool write_to(rtps::SerializedPayload_t& payload, const void* sample) const = 0;
  virtual bool read_from(const rtps::SerializedPayload_t& payload, void* sample) const = 0;
  virtual std::uint32_t size_of(const void* sample) const = 0;
  virtual void key_of(const void* sample, rtps::InstanceHandle_t& key) const = 0;
  virtual void* make_sample() const = 0;
  virtual void free_sample(void* sample) const = 0;

 private:
  bool serialize(void* sample, rtps::SerializedPayload_t* payload) final {
    return write_to(*payload, sample);
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* sample) final {
    return read_from(*payload, sample);
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* sample) final {
    return [this, sample] { return size_of(sample); };
  }
  void* createData() final { return make_sample(); }
  void deleteData(void* sample) final { free_sample(sample); }
  bool getKey(void* sample, rtps::InstanceHandle_t* key, bool) final {
    if (m_isGetKeyDefined) key_of(sample, *key);
    return m_isGetKeyDefined;
  }
};

}  // namespace phantom::fast_dds
