#pragma once

#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>

#include "common/dds/topics.hpp"

namespace phantom::dds {

/// QoS of the profile named as the topic, checked against its contract. Throws DdsError. Private to
/// common/dds.
eprosima::fastdds::dds::DataWriterQos writer_qos(eprosima::fastdds::dds::Publisher& publisher,
                                                 const TopicDescription& topic);
eprosima::fastdds::dds::DataReaderQos reader_qos(eprosima::fastdds::dds::Subscriber& subscriber,
                                                 const TopicDescription& topic);

/// "deadline", "reliability" … for the policy id that DDS reports on a mismatch.
const char* policy_name(int policy_id);

}  // namespace phantom::dds
