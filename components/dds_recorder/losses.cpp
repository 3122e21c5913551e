#include "components/dds_recorder/losses.hpp"

namespace phantom::dds_recorder {

std::uint64_t GapCounter::gap_before(const SampleHead& sample) {
  const auto [last, first] =
      last_.find_or_add(std::pair{sample.topic, sample.writer}, sample.sequence_number);
  if (first || sample.sequence_number <= last) return 0;
  const std::uint64_t gap = sample.sequence_number - last - 1;
  last = sample.sequence_number;
  return gap;
}

}  // namespace phantom::dds_recorder
