#pragma once

#include <optional>
#include <string>

#include "common/core/clock.hpp"
#include "common/core/health.hpp"

namespace phantom::messages {

/// Reports that the wall clock of this host and that of a partner's host differ. Nothing else depends on it:
/// couplings and percepts go by monotonic clocks; the times of logs, recordings and cameras do. Not
/// thread-safe.
class ClockReport {
 public:
  /// Differences from here on are reported in the status's message and in the log.
  static constexpr double kReported_s = 0.5;
  /// Smaller ones may be the network's delay: no figure.
  static constexpr double kFigure_s = 0.02;
  /// Shortest time between two log lines, ns.
  static constexpr core::Nanoseconds kEvery_ns = 60 * core::kNsPerSecond;

  /// `partner`: its component's name.
  explicit ClockReport(std::string partner) : partner_(std::move(partner)) {}

  /// Adds to `health` by how much this host's clock is ahead, and logs it at intervals. `difference_s`: as
  /// dds::DelayMonitor measures it.
  void add_to(core::Health& health, std::optional<double> difference_s, core::Nanoseconds now_ns);

 private:
  std::string partner_;
  std::string logged_;
  core::Nanoseconds quiet_until_ns_ = 0;
};

}  // namespace phantom::messages
