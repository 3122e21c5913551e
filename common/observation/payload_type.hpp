#pragma once

#include <array>
#include <cstdint>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <string>
#include <vector>

#include "common/observation/payload_reader.hpp"
#include "fast_dds/type_support.hpp"

namespace phantom::observation {

/// The data of a PayloadType. Private to common/observation.
struct SerializedSample {
  std::vector<std::uint8_t> bytes;  ///< with the encapsulation header
  /// Key of a keyed topic. A reader leaves this default, one instance for all, because it does not know the
  /// key member. (All zeros would be an invalid key.)
  std::array<std::uint8_t, 16> instance{1};
};

/// A DDS type that leaves its samples serialised: data is a SerializedSample. Private to common/observation.
class PayloadType : public fast_dds::OwnType {
 public:
  PayloadType(const std::string& name, bool keyed);

 private:
  bool write_to(fast_dds::rtps::SerializedPayload_t& payload, const void* sample) const override;
  bool read_from(const fast_dds::rtps::SerializedPayload_t& payload, void* sample) const override;
  std::uint32_t size_of(const void* sample) const override;
  void key_of(const void* sample, fast_dds::rtps::InstanceHandle_t& key) const override;
  void* make_sample() const override { return new SerializedSample(); }
  void free_sample(void* sample) const override { delete static_cast<SerializedSample*>(sample); }
};

/// Registers the payload type of that name with the participant at its first topic. Returns false if the type
/// is known with other properties, or Fast DDS refuses it.
bool register_type(eprosima::fastdds::dds::DomainParticipant& participant, const PayloadTopic& topic);

}  // namespace phantom::observation
