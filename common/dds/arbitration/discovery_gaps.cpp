#include "common/dds/arbitration/discovery_gaps.hpp"

#include <algorithm>

namespace phantom::dds {

bool DiscoveryGaps::complete(const Writer& writer) {
  const auto end = std::min<std::int64_t>(writer.last, kMaxSamples);
  for (std::int64_t number = writer.first; number <= end; ++number)
    if (!writer.come[static_cast<std::size_t>(number - 1)]) return false;
  return true;
}

void DiscoveryGaps::note(std::span<const wire::DiscoverySequence> sequences, core::Nanoseconds now) {
  if (sequences.empty()) return;
  const std::lock_guard lock(mutex_);
  for (const wire::DiscoverySequence& sequence : sequences) {
    Writer& writer = writers_.find_or_add(Key{sequence.writer.prefix, sequence.writer.entity}).first;
    if (sequence.announced) {
      writer.first = sequence.first;
      writer.last = std::max(writer.last, sequence.last);
    } else {
      const auto end = std::min<std::int64_t>(sequence.last, kMaxSamples);
      for (std::int64_t number = std::max<std::int64_t>(1, sequence.first); number <= end; ++number)
        writer.come.set(static_cast<std::size_t>(number - 1));
    }
    if (complete(writer)) {
      writer.incomplete_since = 0;
    } else if (writer.incomplete_since == 0) {
      writer.incomplete_since = now;
    }
  }
}

void DiscoveryGaps::forget(const GuidPrefix& participant) {
  const std::lock_guard lock(mutex_);
  for (const wire::EntityId writer : {wire::kPublicationWriter, wire::kSubscriptionWriter})
    writers_.erase(Key{participant, writer});
}

std::vector<DiscoveryGaps::Incomplete> DiscoveryGaps::incomplete(core::Nanoseconds before) const {
  std::vector<Incomplete> found;
  const std::lock_guard lock(mutex_);
  writers_.for_each([&](const Key& key, const Writer& writer) {
    if (writer.incomplete_since == 0 || writer.incomplete_since > before) return;
    if (!found.empty() && found.back().participant == key.participant) {
      found.back().since = std::min(found.back().since, writer.incomplete_since);
    } else {
      found.push_back({key.participant, writer.incomplete_since});
    }
  });
  return found;
}

}  // namespace phantom::dds
