#pragma once

#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>

#include "fast_dds/types.hpp"

namespace phantom::fast_dds {

/// Whether a writer that ends frees its samples while its heartbeats may read them: version 2 does.
inline constexpr bool kFreesSamplesInUse = false;

/// Sets how often a reliable writer repeats its heartbeat, and after what time it answers a request.
inline void set_heartbeats(eprosima::fastdds::dds::DataWriterQos& qos, Duration period, Duration answer) {
  qos.reliable_writer_qos().times.heartbeat_period = period;
  qos.reliable_writer_qos().times.nack_response_delay = answer;
}
/// Lets a reliable reader ask at once for what it lacks.
inline void ask_at_once(eprosima::fastdds::dds::DataReaderQos& qos) {
  qos.reliable_reader_qos().times.initial_acknack_delay = {0, 0};
  qos.reliable_reader_qos().times.heartbeat_response_delay = {0, 0};
}
/// Returns whether a reader does so.
inline bool asks_at_once(const eprosima::fastdds::dds::DataReaderQos& qos) {
  return qos.reliable_reader_qos().times.initial_acknack_delay == Duration(0, 0) &&
         qos.reliable_reader_qos().times.heartbeat_response_delay == Duration(0, 0);
}
/// Lets a reader hear writers of both data representations.
inline void accept_all_representations(eprosima::fastdds::dds::DataReaderQos& qos) {
  namespace edds = eprosima::fastdds::dds;
  qos.representation().m_value = {edds::XCDR_DATA_REPRESENTATION, edds::XCDR2_DATA_REPRESENTATION};
}

}  // namespace phantom::fast_dds
