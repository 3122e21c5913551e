#pragma once

#include <fastdds/dds/core/policy/QosPolicies.hpp>
#include <string>
#include <utility>
#include <vector>

#include "fast_dds/types.hpp"

namespace phantom::dds {

/// What discovery has learned of a participant or an endpoint. Whether an endpoint's own process removed it
/// or its participant was lost is not told.
enum class Discovered { kFound, kChanged, kLeft, kLost };

/// Another participant. If it is gone, only `guid` holds.
struct FoundParticipant {
  Discovered event = Discovered::kFound;
  fast_dds::rtps::GUID_t guid;
  std::string name;
  fast_dds::rtps::VendorId_t vendor{};
  fast_dds::Duration lease;
  std::vector<std::pair<std::string, std::string>> properties;
  std::vector<fast_dds::rtps::Locator_t> announcements;  ///< unicast, where it hears announcements
  std::vector<fast_dds::rtps::Locator_t> samples;        ///< unicast and multicast, where it hears samples
};

/// The policies that readers and writers announce.
struct EndpointPolicies {
  eprosima::fastdds::dds::ReliabilityQosPolicy reliability;
  eprosima::fastdds::dds::DurabilityQosPolicy durability;
  eprosima::fastdds::dds::DeadlineQosPolicy deadline;
  eprosima::fastdds::dds::LatencyBudgetQosPolicy latency_budget;
  eprosima::fastdds::dds::LifespanQosPolicy lifespan;  ///< of a writer
  eprosima::fastdds::dds::LivelinessQosPolicy liveliness;
  eprosima::fastdds::dds::OwnershipQosPolicy ownership;
  eprosima::fastdds::dds::DestinationOrderQosPolicy destination_order;
  eprosima::fastdds::dds::PresentationQosPolicy presentation;
  std::vector<std::string> partitions;
  std::vector<eprosima::fastdds::dds::DataRepresentationId_t> representations;
};

/// A reader or writer of another participant. If it is gone, only `guid` and `writer` hold.
struct FoundEndpoint {
  Discovered event = Discovered::kFound;
  fast_dds::rtps::GUID_t guid;
  bool writer = false;
  std::string topic, type;
  fast_dds::DescribedType described;  ///< empty unless its description was asked for and came
  bool keyed = false;
  EndpointPolicies policies;
  std::string user_data;
};

/// Receives what discovery learns of others. Calls come from threads of Fast DDS, one at a time for one
/// participant: copy and return; do not throw, or create or delete DDS entities. Private to common/dds and
/// common/observation.
class DiscoveryEvents {
 public:
  virtual ~DiscoveryEvents() = default;
  /// Returns whether the owners of endpoints are asked to describe their types. An endpoint whose owner
  /// announces a description and never gives it is not reported then.
  virtual bool asks_for_types() const { return false; }
  virtual void on_participant(const FoundParticipant&) {}
  /// A handshake has ended, on a secured site.
  virtual void on_authentication(const fast_dds::rtps::GUID_t&, bool /*admitted*/) {}
  virtual void on_endpoint(const FoundEndpoint&) {}
};

}  // namespace phantom::dds
