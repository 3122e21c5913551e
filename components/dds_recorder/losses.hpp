#pragma once

#include "common/core/recent_map.hpp"
#include "components/dds_recorder/sample.hpp"

namespace phantom::dds_recorder {

/// Counts of a topic's samples that are not in the recording, by reason.
struct TopicLosses {
  std::uint64_t missing = 0;       ///< gaps in the sequence numbers of a volatile topic
  std::uint64_t superseded = 0;    ///< states of a durable topic that newer ones replaced before they came
  std::uint64_t overflow = 0;      ///< no room in the recorder's queue (also counted in `missing`)
  std::uint64_t dds_lost = 0;      ///< lost, as DDS counts
  std::uint64_t dds_rejected = 0;  ///< rejected because DDS's history was full, as DDS counts
  std::uint64_t unwritten = 0;     ///< arrived while nothing could be written (disk)
  bool any() const { return missing + overflow + dds_lost + dds_rejected + unwritten > 0; }
  bool operator==(const TopicLosses&) const = default;
  TopicLosses& operator+=(const TopicLosses& other);
  TopicLosses& operator-=(const TopicLosses& other);
};

/// The reasons with their names in records and JSON.
inline constexpr std::pair<const char*, std::uint64_t TopicLosses::*> kLossReasons[] = {
    {"missing", &TopicLosses::missing},           {"superseded", &TopicLosses::superseded},
    {"queue_overflow", &TopicLosses::overflow},   {"dds_lost", &TopicLosses::dds_lost},
    {"dds_rejected", &TopicLosses::dds_rejected}, {"unwritten", &TopicLosses::unwritten}};

inline TopicLosses& TopicLosses::operator+=(const TopicLosses& other) {
  for (const auto& [name, count] : kLossReasons) this->*count += other.*count;
  return *this;
}
inline TopicLosses& TopicLosses::operator-=(const TopicLosses& other) {
  for (const auto& [name, count] : kLossReasons) this->*count -= other.*count;
  return *this;
}

/// Counts the gaps in the sequence numbers of every writer, of the kMax heard last. Not thread-safe.
class GapCounter {
 public:
  static constexpr std::size_t kMax = 16384;
  /// Returns how many samples of this writer are missing before this one; 0 for its first.
  std::uint64_t gap_before(const SampleHead& sample);

 private:
  core::RecentMap<std::pair<TopicNumber, Guid>, std::uint64_t> last_{kMax};
};

}  // namespace phantom::dds_recorder
