#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>

#include "common/core/clock.hpp"

namespace phantom::dds {

/// Logs why samples of a topic are refused: the first time, then at intervals, not once per sample.
/// Thread-safe; not real-time safe.
class RefusalLog {
 public:
  /// Shortest time between two log lines; the refusals in between are counted.
  static constexpr core::Nanoseconds kEvery_ns = 5 * core::kNsPerSecond;

  /// `topic`: its name in the log; the string must outlive this object.
  explicit RefusalLog(const char* topic) : topic_(topic) {}

  void refused(std::string_view why, core::Nanoseconds now_ns = core::monotonic_ns());

 private:
  const char* topic_;
  std::mutex mutex_;
  std::uint64_t count_ = 0;
  core::Nanoseconds quiet_until_ns_ = 0;
};

}  // namespace phantom::dds
