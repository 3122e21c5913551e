#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "common/core/health.hpp"
#include "common/robot/kinematics/model_identity.hpp"

namespace phantom::messages {

/// Compares what a topic's writer announces of its arm and cell with this process's own, and logs a
/// difference once. One thread calls look(); the rest is thread-safe. Not real-time safe, but for differs().
class ModelCheck {
 public:
  /// `topic`: its name in the log; the string must outlive this object. `own`: null: nothing differs.
  ModelCheck(const char* topic, std::shared_ptr<const robot::ModelIdentity> own)
      : topic_(topic), own_(std::move(own)) {}

  /// `label`: of the newest sample's writer (dds::SampleInfo::model_label).
  void look(std::string_view label);
  bool differs() const noexcept { return differs_.load(std::memory_order_relaxed); }
  /// Returns how it differs, in one sentence; empty: not at all.
  std::string difference() const;

 private:
  const char* topic_;
  std::shared_ptr<const robot::ModelIdentity> own_;
  std::string label_;  // compared last
  std::atomic<bool> differs_{false};
  mutable std::mutex mutex_;
  std::string difference_;  // guarded by the mutex
};

/// Adds to a status's message how a partner's model differs; empty: nothing.
void add_difference(core::Health& health, const std::string& difference);

}  // namespace phantom::messages
