#include "common/percept/threat_monitor.hpp"

#include <algorithm>

namespace phantom::percept {

ThreatMonitor::ThreatMonitor(const HitThresholds& thresholds, const AlertTiming& timing)
    : thresholds_(thresholds), blank_(thresholds, timing) {
  for (std::size_t i = 0; i < kMax; ++i) followed_.push_back({blank_});
}

ThreatMonitor::Followed* ThreatMonitor::find(std::uint32_t link, std::uint16_t object) noexcept {
  const auto found = std::ranges::find_if(
      followed_, [&](const Followed& one) { return one.used && one.link == link && one.object == object; });
  return found != followed_.end() ? &*found : nullptr;
}

std::uint32_t ThreatMonitor::alert_of(std::uint32_t link, std::uint16_t object) const noexcept {
  const auto found = std::ranges::find_if(followed_, [&](const Followed& one) {
    return one.used && one.link == link && one.object == object && one.hits.active();
  });
  return found != followed_.end() ? found->number : 0;
}

bool ThreatMonitor::has_alert(std::uint32_t link) const noexcept {
  return std::ranges::any_of(followed_, [link](const Followed& one) {
    return one.used && one.link == link && one.hits.active().has_value();
  });
}

std::size_t ThreatMonitor::active_count() const noexcept {
  return static_cast<std::size_t>(std::ranges::count_if(
      followed_, [](const Followed& one) { return one.used && one.hits.active().has_value(); }));
}

/// Finds a place for a threat that is not followed yet. Returns null if all are taken by threats that hold.
ThreatMonitor::Followed* ThreatMonitor::place_for(const HitCandidate& threat, Changes& changes) noexcept {
  const auto first = [&](const auto& may_go) {
    const auto found = std::ranges::find_if(followed_, may_go);
    return found != followed_.end() ? &*found : nullptr;
  };
  Followed* place = first([](const Followed& one) { return !one.used; });
  if (place == nullptr) place = first([](const Followed& one) { return !one.seen && !one.hits.active(); });
  if (place == nullptr) place = first([](const Followed& one) { return !one.seen; });
  if (place == nullptr) return nullptr;
  if (place->used) note(*place, place->hits.close(), changes);
  place->hits = blank_;
  place->link = threat.link;
  place->object = threat.object;
  place->used = true;
  return place;
}

/// Numbers the alerts of all threats in one sequence.
void ThreatMonitor::note(Followed& followed, const AlertEvents& events, Changes& changes) noexcept {
  if (events.cleared) {
    changes.cleared.push_back(*events.cleared);
    changes.cleared.back().number = followed.number;
  }
  if (events.raised) {
    followed.number = ++raised_;
    changes.raised.push_back(*events.raised);
    changes.raised.back().number = followed.number;
  }
}

void ThreatMonitor::step(std::span<const HitCandidate> threats, double dt_s, Changes& changes) noexcept {
  for (Followed& one : followed_) one.seen = false;
  // Those that are followed already keep their places, however many come before them.
  for (const HitCandidate& threat : threats)
    if (Followed* const one = find(threat.link, threat.object)) one->seen = true;
  for (const HitCandidate& threat : threats) {
    if (find(threat.link, threat.object) != nullptr) continue;
    if (assess_hit(threat.situation, thresholds_) == HitRule::kNone) continue;
    if (Followed* const one = place_for(threat, changes)) one->seen = true;
  }
  for (auto threat = threats.rbegin(); threat != threats.rend(); ++threat)
    if (Followed* const one = find(threat->link, threat->object))
      note(*one, one->hits.step(*threat, dt_s), changes);
  for (Followed& one : followed_) {
    if (!one.used || one.seen) continue;
    note(one, one.hits.step(std::nullopt, dt_s), changes);
    if (one.hits.is_idle()) one.used = false;
  }
}

void ThreatMonitor::close(Changes& changes) noexcept {
  for (Followed& one : followed_)
    if (one.used) note(one, one.hits.close(), changes);
}

}  // namespace phantom::percept
