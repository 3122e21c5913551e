#pragma once

#include <map>

#include "components/dds_recorder/sample.hpp"

namespace phantom::dds_recorder {

/// What of a topic is not in the recording, and why.
struct TopicLosses {
  std::uint64_t missing = 0;       ///< sequence numbers of volatile topics that never came, or were not kept
  std::uint64_t superseded = 0;    ///< states of durable topics that a newer one replaced before they came
  std::uint64_t overflow = 0;      ///< found no room in the recorder's queue (counted in `missing` as well)
  std::uint64_t dds_lost = 0;      ///< lost by DDS's own count
  std::uint64_t dds_rejected = 0;  ///< came while DDS's history was full, by its own count
  std::uint64_t unwritten = 0;     ///< came when nothing could be written (disk)
  bool any() const { return missing + overflow + dds_lost + dds_rejected + unwritten > 0; }
  bool operator==(const TopicLosses&) const = default;
};

/// Counts the gaps in the sequence numbers of every writer. Not thread-safe.
class GapCounter {
 public:
  /// The number of samples of this writer that should have come before this one and did not; 0 at its first.
  std::uint64_t gap_before(const SampleHead& sample);

 private:
  std::map<std::pair<TopicNumber, Guid>, std::uint64_t> last_;
};

}  // namespace phantom::dds_recorder
