#pragma once

#include <mutex>

#include "common/runtime/process/wake_signal.hpp"
#include "components/dds_recorder/sample.hpp"

namespace phantom::dds_recorder {

/// Passes samples from middleware threads to the writing thread. Bounded: a sample for which there is no room
/// is refused, and no thread waits.
class SampleQueue {
 public:
  /// Allocates all memory in advance: `bytes`, half of which is filled while the other half is written.
  explicit SampleQueue(std::size_t bytes);

  /// Copies the sample. Returns false if there is no room. Uses no heap; holds the lock for the copy only.
  /// Thread-safe.
  bool push(const SampleView& sample) noexcept;
  /// Waits until the half that is being filled is half full, at most `limit_s`. Samples are written in
  /// batches, because waking up for each would cost more than the writing.
  void wait(double limit_s) noexcept { wake_.wait(limit_s); }

  /// Calls take(SampleView) for all samples since the last call, in the order of arrival; returns their
  /// number. One thread.
  template <class Take>
  std::size_t drain(Take&& take) {
    swap();
    std::size_t count = 0;
    for (std::size_t offset = 0; offset < drained_->used; ++count) take(next(offset));
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
  /// Returns the drained sample at `offset`, which becomes that of the next one.
  SampleView next(std::size_t& offset) const noexcept;

  Arena arenas_[2];
  std::mutex mutex_;
  Arena* filled_ = &arenas_[0];   // under the mutex
  Arena* drained_ = &arenas_[1];  // used by the draining thread only
  runtime::WakeSignal wake_;
};

}  // namespace phantom::dds_recorder
