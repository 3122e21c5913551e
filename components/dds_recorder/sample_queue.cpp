#include "components/dds_recorder/sample_queue.hpp"

#include <cstring>
#include <utility>

namespace phantom::dds_recorder {

static_assert(std::is_trivially_copyable_v<SampleHead>);

SampleQueue::SampleQueue(std::size_t bytes) {
  for (Arena& arena : arenas_)
    arena.bytes.resize(bytes / 2);  // touches every page, so that none faults later
}

bool SampleQueue::push(const SampleView& sample) noexcept {
  const Entry entry{sample.head, sample.bytes.size()};
  bool half_full = false;
  {
    const std::lock_guard lock(mutex_);
    if (sizeof entry + sample.bytes.size() > filled_->bytes.size() - filled_->used) return false;
    std::uint8_t* to = filled_->bytes.data() + filled_->used;
    std::memcpy(to, &entry, sizeof entry);
    if (!sample.bytes.empty()) std::memcpy(to + sizeof entry, sample.bytes.data(), sample.bytes.size());
    const std::size_t half = filled_->bytes.size() / 2, before = filled_->used;
    filled_->used += sizeof entry + sample.bytes.size();
    half_full = before < half && filled_->used >= half;
  }
  if (half_full) wake_.raise();
  return true;
}

void SampleQueue::swap() noexcept {
  const std::lock_guard lock(mutex_);
  drained_->used = 0;
  std::swap(filled_, drained_);
}

SampleView SampleQueue::next(std::size_t& offset) const noexcept {
  Entry entry;
  const std::uint8_t* from = drained_->bytes.data() + offset;
  std::memcpy(&entry, from, sizeof entry);
  offset += sizeof entry + static_cast<std::size_t>(entry.size);
  return {entry.head, {from + sizeof entry, static_cast<std::size_t>(entry.size)}};
}

}  // namespace phantom::dds_recorder
