#pragma once

#include <cstdint>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <string>
#include <vector>

namespace phantom::observation {

/// A DDS type that leaves its samples serialised: data is a std::vector<uint8_t> with the encapsulation
/// header. Private to common/observation.
class PayloadType : public eprosima::fastdds::dds::TopicDataType {
 public:
  PayloadType(const std::string& name, bool keyed);
  bool serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override;
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override;
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override;
  void* createData() override { return new std::vector<std::uint8_t>(); }
  void deleteData(void* data) override { delete static_cast<std::vector<std::uint8_t>*>(data); }
  /// Returns the same key for all samples, because the key member is unknown here.
  bool getKey(void* data, eprosima::fastrtps::rtps::InstanceHandle_t* handle, bool force_md5) override;
};

}  // namespace phantom::observation
