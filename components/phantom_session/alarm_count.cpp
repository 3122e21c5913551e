#include "components/phantom_session/alarm_count.hpp"

namespace phantom::phantom_session {

bool AlarmCount::asks(percept::HitRule rule, double contact_s) noexcept {
  return rule == percept::HitRule::kVeryClose || (contact_s >= 0.0 && contact_s <= kSoon_s);
}

std::size_t AlarmCount::begin(Entry& entry) noexcept {
  if (entry.begun) return 0;
  entry.begun = true;
  ++entries_;
  return 1;
}

std::size_t AlarmCount::on_raised(double t_s, std::uint32_t alert, int object, bool asks) {
  if (object_of_.size() >= kMaxStanding) return 0;
  Entry& entry = objects_[object];
  if (entry.standing.empty() && t_s - entry.ended_s >= kStays_s) entry.begun = false;
  entry.standing.insert(alert);
  object_of_[alert] = object;
  return asks ? begin(entry) : 0;
}

void AlarmCount::on_cleared(double t_s, std::uint32_t alert) {
  const auto found = object_of_.find(alert);
  if (found == object_of_.end()) return;
  Entry& entry = objects_[found->second];
  entry.standing.erase(alert);
  entry.ended_s = t_s;
  object_of_.erase(found);
}

std::size_t AlarmCount::on_threats(std::span<const messages::Threat> threats) {
  std::size_t begun = 0;
  for (const messages::Threat& threat : threats) {
    const auto found = objects_.find(threat.object);
    if (found == objects_.end() || found->second.standing.empty()) continue;
    if (asks(threat.rule, threat.contact.time_s)) begun += begin(found->second);
  }
  return begun;
}

}  // namespace phantom::phantom_session
