#pragma once

// What the constant of a topic holds.

namespace eprosima::fastdds::dds {
class TypeSupport;
}

namespace phantom::dds {

enum class Reliability { kBestEffort, kReliable };
enum class Durability { kVolatile, kTransientLocal };

/// What both ends of a topic may rely on. The XML profile named as the topic must agree (checked at start).
/// No sample expires by DDS (lifespan): that would compare the wall clocks of two hosts. Each receiver
/// decides by its own monotonic clock whether a sample is stale (watchdogs) or was held up on its way
/// (DelayMonitor).
struct QosContract {
  Reliability reliability = Reliability::kReliable;
  Durability durability = Durability::kVolatile;
  int history_depth = 1;  ///< KEEP_LAST depth per instance; 0: KEEP_ALL
  int deadline_ms = 0;    ///< 0: none
  int liveliness_ms = 0;  ///< lease of MANUAL_BY_TOPIC liveliness; 0: automatic, without a lease
};

/// A TopicSpec without its sample type: for lists, tables and tools.
struct TopicDescription {
  const char* name;
  const char* type_name;
  QosContract qos;
  eprosima::fastdds::dds::TypeSupport (*make_type)();
  bool foreign = false;        ///< a topic of others: it has no XML profile, and the contract alone holds
  const char* user_data = "";  ///< USER_DATA of the endpoint; empty: none
};

template <class T>
struct TopicSpec : TopicDescription {};

}  // namespace phantom::dds
