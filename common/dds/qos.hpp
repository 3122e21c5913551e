#pragma once

#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>

#include "common/dds/topics.hpp"

namespace phantom::dds {

/// QoS of the profile named as the topic, checked against its contract. Throws DdsError. Private to
/// common/dds and common/observation.
eprosima::fastdds::dds::DataWriterQos writer_qos(eprosima::fastdds::dds::Publisher& publisher,
                                                 const TopicDescription& topic);
eprosima::fastdds::dds::DataReaderQos reader_qos(eprosima::fastdds::dds::Subscriber& subscriber,
                                                 const TopicDescription& topic);

/// No heartbeats beside the periodic ones. Fast DDS 2.9.1 takes the bytes that its sending thread ever sent
/// for those since the last heartbeat: once that is 4 MiB (bricks for two late joiners), every message that
/// is sent again brings a heartbeat to all readers, each of them answers, and asks once more for what is
/// under way. On a busy host that never ended.
void without_piggyback(eprosima::fastdds::dds::DataWriterQos& qos) noexcept;

/// "deadline", "reliability" … for the policy id that DDS reports on a mismatch.
const char* policy_name(int policy_id);

}  // namespace phantom::dds
