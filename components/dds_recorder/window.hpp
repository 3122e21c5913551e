#pragma once

#include <deque>

#include "components/dds_recorder/sample.hpp"

namespace phantom::dds_recorder {

/// Holds the samples of the last seconds in memory until an event. Bounded in time and in bytes. Not
/// thread-safe.
class Window {
 public:
  Window(core::Nanoseconds length_ns, std::size_t limit_bytes)
      : length_ns_(length_ns), limit_bytes_(limit_bytes) {}

  /// Adds the newest sample. Calls leave(Sample&&) for each that is too old now or for which there is no
  /// memory.
  template <class Leave>
  void put(Sample sample, Leave&& leave) {
    const core::Nanoseconds now_ns = sample.head.received_ns;
    bytes_ += sample.cost();
    samples_.push_back(std::move(sample));
    while (!samples_.empty() &&
           (samples_.front().head.received_ns < now_ns - length_ns_ || bytes_ > limit_bytes_)) {
      leave(pop());
    }
  }
  /// Removes all samples, the oldest first, and passes each to leave(Sample&&).
  template <class Leave>
  void drain(Leave&& leave) {
    while (!samples_.empty()) leave(pop());
  }
  std::size_t size() const { return samples_.size(); }
  std::size_t bytes() const { return bytes_; }
  core::Nanoseconds oldest_ns() const { return samples_.empty() ? 0 : samples_.front().head.received_ns; }

 private:
  Sample pop() {
    Sample sample = std::move(samples_.front());
    samples_.pop_front();
    bytes_ -= sample.cost();
    return sample;
  }
  core::Nanoseconds length_ns_;
  std::size_t limit_bytes_, bytes_ = 0;
  std::deque<Sample> samples_;
};

}  // namespace phantom::dds_recorder
