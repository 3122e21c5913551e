#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "common/core/clock.hpp"
#include "common/core/health.hpp"
#include "common/robot/kinematics/model_identity.hpp"

namespace phantom::messages {

/// Compares what a topic's writers announce of their arm and cell with this process's own, and logs each
/// difference once, however often writers alternate. One thread calls look(); the rest is thread-safe. Not
/// real-time safe, but for differs().
class ModelCheck {
 public:
  /// `topic`: its name in the log; the string must outlive this object. `own`: null: nothing differs.
  ModelCheck(const char* topic, std::shared_ptr<const robot::ModelIdentity> own)
      : topic_(topic), own_(std::move(own)) {}

  /// A difference is reported for this long after its writer's last sample.
  static constexpr core::Nanoseconds kReported_ns = 2 * core::kNsPerSecond;

  /// `label`: of the newest sample's writer (dds::SampleInfo::model_label). `received_ns`: when it came, by
  /// this host's monotonic clock.
  void look(std::string_view label, core::Nanoseconds received_ns);
  bool differs() const noexcept { return differs_.load(std::memory_order_relaxed); }
  /// Returns how the last one that differs did so, in one sentence; empty: none within kReported_ns.
  std::string difference() const;

 private:
  const char* topic_;
  std::shared_ptr<const robot::ModelIdentity> own_;
  std::string label_;                  // compared last
  std::string logged_;                 // the difference that was logged last
  core::Nanoseconds differed_ns_ = 0;  // when a sample of a writer that differs came last
  std::atomic<bool> differs_{false};
  mutable std::mutex mutex_;
  std::string difference_;  // guarded by the mutex
};

/// Adds to a status's message how a partner's model differs; empty: nothing.
void add_difference(core::Health& health, const std::string& difference);

}  // namespace phantom::messages
