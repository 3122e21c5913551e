#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "common/core/bounded_list.hpp"
#include "common/percept/hit_susceptibility.hpp"

namespace phantom::percept {

/// Turns the threats of an arm into alerts: one alert for each link near each object, several at once. They
/// share one running number. Each threat has the hysteresis, the least interval and the replacement of
/// HitMonitor, of its own. At most kMax threats are followed at once, the most urgent first: one more is
/// taken in place of one that rests between two alerts, or else of one whose rule no longer holds (its alert
/// then ends early), or else not until there is room. Real-time safe: yes.
class ThreatMonitor {
 public:
  static constexpr std::size_t kMax = 16;

  /// What changed in a step. Those that ended come before those that were raised, and of these the most
  /// urgent comes last: who follows the newest alert follows it.
  struct Changes {
    core::BoundedList<Alert, kMax> cleared, raised;
    bool empty() const noexcept { return cleared.empty() && raised.empty(); }
  };

  ThreatMonitor(const HitThresholds& thresholds, const AlertTiming& timing);

  /// Takes the threats of this step, most urgent first, each link and object once. A `dt_s` that is NaN or
  /// negative counts as 0.
  void step(std::span<const HitCandidate> threats, double dt_s, Changes& changes) noexcept;
  /// Ends all alerts at once, because the data behind them are no longer valid.
  void close(Changes& changes) noexcept;

  /// Returns the number of the alert that is up for a link near an object; 0: none.
  std::uint32_t alert_of(std::uint32_t link, std::uint16_t object) const noexcept;
  bool has_alert(std::uint32_t link) const noexcept;  ///< near any object
  std::size_t active_count() const noexcept;

 private:
  struct Followed {
    HitMonitor hits;
    std::uint32_t link = 0;
    std::uint16_t object = 0;
    std::uint32_t number = 0;  // of its alert
    bool used = false, seen = false;
  };
  Followed* find(std::uint32_t link, std::uint16_t object) noexcept;
  Followed* place_for(const HitCandidate& threat, Changes& changes) noexcept;
  void note(Followed& followed, const AlertEvents& events, Changes& changes) noexcept;

  HitThresholds thresholds_;
  HitMonitor blank_;  // with these thresholds and timing
  core::BoundedList<Followed, kMax> followed_;
  std::uint32_t raised_ = 0;
};

}  // namespace phantom::percept
