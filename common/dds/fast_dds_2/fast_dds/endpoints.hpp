#pragma once

#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>

#include "fast_dds/types.hpp"

namespace phantom::fast_dds {

/// Whether a writer that ends frees its samples while its heartbeats may read them, and such a heartbeat
/// never ends (fixed after 2.12, https://github.com/eProsima/Fast-DDS/pull/4076).
inline constexpr bool kFreesSamplesInUse = true;

/// Sets how often a reliable writer repeats its heartbeat, and after what time it answers a request.
inline void set_heartbeats(eprosima::fastdds::dds::DataWriterQos& qos, Duration period, Duration answer) {
  qos.reliable_writer_qos().times.heartbeatPeriod = period;
  qos.reliable_writer_qos().times.nackResponseDelay = answer;
}
/// Lets a reliable reader ask at once for what it lacks.
inline void ask_at_once(eprosima::fastdds::dds::DataReaderQos& qos) {
  qos.reliable_reader_qos().times.initialAcknackDelay = {0, 0};
  qos.reliable_reader_qos().times.heartbeatResponseDelay = {0, 0};
}
/// Returns whether a reader does so.
inline bool asks_at_once(const eprosima::fastdds::dds::DataReaderQos& qos) {
  return qos.reliable_reader_qos().times.initialAcknackDelay == Duration(0, 0) &&
         qos.reliable_reader_qos().times.heartbeatResponseDelay == Duration(0, 0);
}
/// Lets a reader hear writers of both data representations.
inline void accept_all_representations(eprosima::fastdds::dds::DataReaderQos& qos) {
  namespace edds = eprosima::fastdds::dds;
  qos.type_consistency().representation.m_value = {edds::XCDR_DATA_REPRESENTATION,
                                                   edds::XCDR2_DATA_REPRESENTATION};
}

}  // namespace phantom::fast_dds
