#pragma once

#include <mutex>

#include "common/runtime/wake_signal.hpp"
#include "components/dds_recorder/sample.hpp"

namespace phantom::dds_recorder {

/// Takes samples from middleware threads to the one that writes. Bounded: what finds no room is refused,
/// nobody waits.
class SampleQueue {
 public:
  /// Allocates all that it will ever need: `bytes`, half of which is being filled while the other half is
  /// written.
  explicit SampleQueue(std::size_t bytes);

  /// Copies the sample. False if there is no room. No heap; the lock is held for the copy alone. Thread-safe.
  bool push(const SampleView& sample) noexcept;
  /// Waits until it is getting full, at most `limit_s`: samples are written in batches, a wake-up for each
  /// would cost more than the writing.
  void wait(double limit_s) noexcept { wake_.wait(limit_s); }

  /// Calls take(SampleView) for all that came since the last call, in the order of arrival; returns how many.
  /// One thread.
  template <class Take>
  std::size_t drain(Take&& take) {
    swap();
    std::size_t count = 0;
    for (std::size_t at = 0; at < drained_->used; ++count) at = visit(at, take);
    return count;
  }

 private:
  struct Arena {
    std::vector<std::uint8_t> bytes;
    std::size_t used = 0;
  };
  struct Entry {
    SampleHead head;
    std::uint64_t size = 0;
  };
  void swap() noexcept;
  SampleView at(std::size_t offset, std::size_t& next) const noexcept;
  template <class Take>
  std::size_t visit(std::size_t offset, Take& take) {
    std::size_t next = 0;
    take(at(offset, next));
    return next;
  }

  Arena arenas_[2];
  std::mutex mutex_;
  Arena* filled_ = &arenas_[0];   // under the mutex
  Arena* drained_ = &arenas_[1];  // the draining thread's
  runtime::WakeSignal wake_;
};

}  // namespace phantom::dds_recorder
