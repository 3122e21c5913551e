#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <memory>
#include <mutex>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/admission/guid_prefix.hpp"
#include "common/dds/arbitration/discovery.hpp"
#include "common/dds/endpoints/participant.hpp"
#include "common/dds/endpoints/topics.hpp"

namespace phantom::fast_dds {
class DiscoveryListener;
}

namespace phantom::dds {

/// Counters of one endpoint, written by middleware threads.
struct EndpointCounters {
  const TopicDescription* topic = nullptr;
  bool writer = false;
  std::atomic<std::uint32_t> matched{0};
  std::atomic<std::uint64_t> samples{0}, refused{0}, deadline_missed{0}, liveliness_lost{0},
      incompatible_qos{0};
  std::atomic<core::Nanoseconds> busy_since_ns{0};  // 0: no callback of the component is running
};

class Bans;
class RediscoveryManager;
class Outbox;
class WriterLabels;
class RefusedDatagrams;

inline GuidPrefix prefix_of(const fast_dds::rtps::GUID_t& guid) {
  GuidPrefix prefix;
  std::copy_n(guid.guidPrefix.value, prefix.size(), prefix.begin());
  return prefix;
}

/// Prefix and entity, in the order of the wire.
std::array<std::uint8_t, 16> octets_of(const fast_dds::rtps::GUID_t& guid);

/// Private to common/dds and common/observation.
struct Participant::Impl {
  std::string component;
  std::uint64_t session = 0;
  std::string model_label;               // USER_DATA of every writer of our own topics
  std::shared_ptr<WriterLabels> labels;  // of others' writers
  int servo_priority = 0;
  std::optional<DocumentsEnd> documents_end;
  std::shared_ptr<fast_dds::DiscoveryListener> listener;  // outlives the participant
  std::shared_ptr<RefusedDatagrams> refused;              // shared with the transport
  std::shared_ptr<Outbox> outbox;                         // shared with the transport
  std::shared_ptr<Bans> bans;                             // shared with the transport
  std::shared_ptr<RediscoveryManager> readmission;        // null where there are discovery servers
  eprosima::fastdds::dds::DomainParticipant* participant = nullptr;
  eprosima::fastdds::dds::Publisher* publisher = nullptr;
  eprosima::fastdds::dds::Subscriber* subscriber = nullptr;
  std::mutex mutex;
  std::vector<std::shared_ptr<EndpointCounters>> counters;

  ~Impl();
  /// Returns the DDS topic of this participant; the first call creates it. Throws DdsError.
  eprosima::fastdds::dds::Topic* topic(const TopicDescription& description);
  std::shared_ptr<EndpointCounters> add_counters(const TopicDescription& topic, bool writer);
};

/// Deletes a writer and its history.
void delete_writer(eprosima::fastdds::dds::Publisher& publisher, eprosima::fastdds::dds::DataWriter* writer);

/// Logs that another participant's endpoint is incompatible with this one, and in which policy. Called once
/// per endpoint.
void report_incompatible(const std::string& component, const EndpointCounters& counters, int policy_id);

}  // namespace phantom::dds
