#include "components/phantom_session/alarm_count.hpp"

#include <algorithm>
#include <limits>

namespace phantom::phantom_session {

bool AlarmCount::asks(percept::HitRule rule, double contact_s) noexcept {
  return rule == percept::HitRule::kVeryClose || (contact_s >= 0.0 && contact_s <= kSoon_s);
}

double AlarmCount::over_s(double t_s, std::size_t entry) const {
  double since_s = std::numeric_limits<double>::infinity();
  for (const auto& [id, object] : objects_) {
    if (object.entry != entry) continue;
    if (!object.standing.empty()) return 0.0;
    since_s = std::min(since_s, t_s - object.ended_s);
  }
  return since_s;
}

std::size_t AlarmCount::join(double t_s, Object& object) {
  if (object.entry != 0) return 0;
  // Only the newest can still be that of the present motion.
  const bool opens = entries_ == 0 || over_s(t_s, entries_) >= kSameMotion_s;
  if (opens) ++entries_;
  object.entry = entries_;
  return opens ? 1 : 0;
}

std::size_t AlarmCount::on_raised(double t_s, std::uint32_t alert, int id, bool asks) {
  if (object_of_.size() >= kMaxStanding) return 0;
  Object& object = objects_[id];
  if (object.entry != 0 && over_s(t_s, object.entry) >= kStays_s) object.entry = 0;
  const std::size_t begun = asks ? join(t_s, object) : 0;
  object.standing.insert(alert);
  object_of_[alert] = id;
  return begun;
}

void AlarmCount::on_cleared(double t_s, std::uint32_t alert) {
  const auto found = object_of_.find(alert);
  if (found == object_of_.end()) return;
  Object& object = objects_[found->second];
  object.standing.erase(alert);
  object.ended_s = t_s;
  object_of_.erase(found);
}

std::size_t AlarmCount::on_threats(double t_s, std::span<const messages::Threat> threats) {
  std::size_t begun = 0;
  for (const messages::Threat& threat : threats) {
    const auto found = objects_.find(threat.object);
    if (found == objects_.end() || found->second.standing.empty()) continue;
    if (asks(threat.rule, threat.contact.time_s)) begun += join(t_s, found->second);
  }
  return begun;
}

}  // namespace phantom::phantom_session
