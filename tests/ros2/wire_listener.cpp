#include "tests/ros2/wire_listener.hpp"

#include <dds/ddsi/ddsi_serdata.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "tests/ros2/ros2_types.h"

namespace phantom::ros2::test {
namespace {

const dds_topic_descriptor_t* const kDescriptors[] = {
    ros2_joint_state, ros2_string,  ros2_float64, ros2_tf,    ros2_diagnostics,
    ros2_marker,      ros2_markers, ros2_wrench,  ros2_cloud, ros2_picture};

const dds_topic_descriptor_t& descriptor(const std::string& type) {
  const auto found = std::find_if(std::begin(kDescriptors), std::end(kDescriptors),
                                  [&](const auto* one) { return type == one->m_typename; });
  if (found == std::end(kDescriptors)) throw std::runtime_error(type + " is not in ros2_types.h");
  return **found;
}

std::int32_t sound(std::int32_t entity) {
  if (entity < 0) throw std::runtime_error(dds_strretcode(-entity));
  return entity;
}

}  // namespace

std::vector<std::vector<std::uint8_t>> WireListener::heard(const std::string& topic,
                                                           const std::string& type) {
  std::int32_t& reader = readers_[topic];
  if (reader == 0) {
    // A volatile reader hears latched messages only as they are sent again: it asks for them as RViz does.
    dds_qos_t* qos = dds_create_qos();
    const bool latched =
        topic == "rt/tf_static" || type == ros2_string->m_typename || type == ros2_cloud->m_typename;
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    dds_qset_durability(qos, latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 64);
    const dds_data_representation_id_t plain_cdr = DDS_DATA_REPRESENTATION_XCDR1;
    dds_qset_data_representation(qos, 1, &plain_cdr);
    const auto made = sound(dds_create_topic(participant_, &descriptor(type), topic.c_str(), qos, nullptr));
    reader = sound(dds_create_reader(participant_, made, qos, nullptr));
    dds_delete_qos(qos);
  }
  ddsi_serdata* samples[64] = {nullptr};
  dds_sample_info_t infos[64];
  const int count = dds_readcdr(reader, samples, 64, infos, DDS_ANY_STATE);
  std::vector<std::vector<std::uint8_t>> all;
  for (int i = 0; i < count; ++i) {
    if (infos[i].valid_data) {
      all.emplace_back(ddsi_serdata_size(samples[i]));
      ddsi_serdata_to_ser(samples[i], 0, all.back().size(), all.back().data());
    }
    ddsi_serdata_unref(samples[i]);
  }
  return all;
}

}  // namespace phantom::ros2::test
