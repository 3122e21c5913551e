#pragma once

#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>

#include "common/dds/endpoints/topics.hpp"

namespace phantom::dds {

/// Return the QoS of the profile named as the topic, checked against its contract. Throw DdsError. Private to
/// common/dds and common/observation.
eprosima::fastdds::dds::DataWriterQos writer_qos(eprosima::fastdds::dds::Publisher& publisher,
                                                 const TopicDescription& topic);
eprosima::fastdds::dds::DataReaderQos reader_qos(eprosima::fastdds::dds::Subscriber& subscriber,
                                                 const TopicDescription& topic);

/// Disables piggybacked heartbeats; the periodic ones remain. Fast DDS 2.9.1 counts all bytes that its
/// sending thread has ever sent as sent since the last heartbeat. Once that is 4 MiB (bricks for two late
/// joiners), every resent message carries a heartbeat to all readers, and each reader answers and requests
/// once more what is already under way. On a busy host that never ended.
void without_piggyback(eprosima::fastdds::dds::DataWriterQos& qos) noexcept;

/// Returns "deadline", "reliability" … for the policy id that DDS reports on a mismatch.
const char* policy_name(int policy_id);

}  // namespace phantom::dds
