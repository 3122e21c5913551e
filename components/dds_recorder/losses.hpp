#pragma once

#include <map>

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
};

/// Counts the gaps in the sequence numbers of every writer. Not thread-safe.
class GapCounter {
 public:
  /// Returns how many samples of this writer are missing before this one; 0 for its first.
  std::uint64_t gap_before(const SampleHead& sample);

 private:
  std::map<std::pair<TopicNumber, Guid>, std::uint64_t> last_;
};

}  // namespace phantom::dds_recorder
