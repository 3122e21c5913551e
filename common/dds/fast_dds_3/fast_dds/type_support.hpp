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

/// Keeps descriptions of a type out of what its endpoints announce. Version 3 announces none of a type whose
/// code was generated without them (idl/CMakeLists.txt).
inline void announce_name_only(eprosima::fastdds::dds::TopicDataType&) {}

inline bool is_keyed(const eprosima::fastdds::dds::TopicDataType& type) {
  return type.is_compute_key_provided;
}

/// Serialises a sample by a type. Returns false if it exceeds the bounds of the type. Throws what the
/// generated code throws.
inline bool serialise(eprosima::fastdds::dds::TopicDataType& type, const void* sample,
                      rtps::SerializedPayload_t& payload) {
  constexpr auto kXcdr1 = eprosima::fastdds::dds::XCDR_DATA_REPRESENTATION;
  payload.reserve(type.calculate_serialized_size(sample, kXcdr1));
  return type.serialize(sample, payload, kXcdr1);
}
inline bool deserialise(eprosima::fastdds::dds::TopicDataType& type, rtps::SerializedPayload_t& payload,
                        void* sample) {
  return type.deserialize(payload, sample);
}
inline bool find_key(eprosima::fastdds::dds::TopicDataType& type, const void* sample,
                     rtps::InstanceHandle_t& key) {
  return type.compute_key(sample, key, false);
}

/// A generated type that takes octets which are no sample of it for that, whatever the generated code throws.
/// Only plain CDR is decoded: of sequences in XTypes' version 2 Fast CDR believes the length before it looks
/// how many octets are left, and takes as much memory.
template <class PubSubType>
class Refusing : public PubSubType {
 public:
  bool deserialize(rtps::SerializedPayload_t& payload, void* sample) override {
    if (!dds::is_plain_cdr(payload.data, payload.length)) return false;
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
  bool deserialize(rtps::SerializedPayload_t& payload, void* sample) override {
    return kScreen(this->get_name(), std::span<const std::uint8_t>(payload.data, payload.length)) &&
           Refusing<PubSubType>::deserialize(payload, sample);
  }
};

/// A type whose samples are written and read by its own functions.
class OwnType : public eprosima::fastdds::dds::TopicDataType {
 public:
  /// `usual_size`: octets of a payload; histories grow if a sample needs more.
  OwnType(const std::string& name, bool keyed, std::uint32_t usual_size) {
    set_name(name);
    max_serialized_type_size = usual_size;
    is_compute_key_provided = keyed;
  }

 protected:
  virtual bool write_to(rtps::SerializedPayload_t& payload, const void* sample) const = 0;
  virtual bool read_from(const rtps::SerializedPayload_t& payload, void* sample) const = 0;
  virtual std::uint32_t size_of(const void* sample) const = 0;
  virtual void key_of(const void* sample, rtps::InstanceHandle_t& key) const = 0;
  virtual void* make_sample() const = 0;
  virtual void free_sample(void* sample) const = 0;

 private:
  using Representation = eprosima::fastdds::dds::DataRepresentationId_t;

  bool serialize(const void* sample, rtps::SerializedPayload_t& payload, Representation) final {
    return write_to(payload, sample);
  }
  bool deserialize(rtps::SerializedPayload_t& payload, void* sample) final {
    return read_from(payload, sample);
  }
  std::uint32_t calculate_serialized_size(const void* sample, Representation) final {
    return size_of(sample);
  }
  void* create_data() final { return make_sample(); }
  void delete_data(void* sample) final { free_sample(sample); }
  bool compute_key(const void* sample, rtps::InstanceHandle_t& key, bool) final {
    if (is_compute_key_provided) key_of(sample, key);
    return is_compute_key_provided;
  }
  // The key of a payload is asked for only if a sample came without it.
  bool compute_key(rtps::SerializedPayload_t& payload, rtps::InstanceHandle_t& key, bool force_md5) final {
    if (!is_compute_key_provided) return false;
    void* sample = make_sample();
    const bool read = read_from(payload, sample) && compute_key(sample, key, force_md5);
    free_sample(sample);
    return read;
  }
};

}  // namespace phantom::fast_dds
