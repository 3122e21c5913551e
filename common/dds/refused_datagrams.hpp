#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/wire/fault.hpp"
#include "common/wire/participants.hpp"

namespace phantom::dds {

/// Datagrams that a participant has refused for one reason.
struct Refused {
  wire::Fault fault = wire::Fault::kNone;
  std::uint64_t count = 0;
  wire::Source last;  ///< the sender of the last one
};

/// Counts refused datagrams by reason. Thread-safe.
class RefusedDatagrams {
 public:
  void add(wire::Fault fault, const wire::Source& source) {
    const std::lock_guard lock(mutex_);
    Refused& one = by_fault_[static_cast<std::size_t>(fault)];
    one = {fault, one.count + 1, source};
  }
  /// Returns the reasons for which any was refused.
  std::vector<Refused> list() const;
  /// Logs what was refused since the last call that logged, reason by reason, at most every kEvery.
  void log(const std::string& component, core::Nanoseconds now);

 private:
  static constexpr core::Nanoseconds kEvery = 5 * core::kNsPerSecond;
  mutable std::mutex mutex_;
  std::array<Refused, wire::kFaults> by_fault_;
  std::array<std::uint64_t, wire::kFaults> logged_{};
  core::Nanoseconds quiet_until_ = 0;
};

/// Returns "10.30.1.2:7410".
std::string to_text(const wire::Source& source);

}  // namespace phantom::dds
