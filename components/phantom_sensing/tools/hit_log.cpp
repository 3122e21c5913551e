#include "components/phantom_sensing/tools/hit_log.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>

namespace phantom::phantom_sensing {
namespace {

constexpr std::size_t kMaxRecords = 10'000;
constexpr std::size_t kOpenSearched = 64;  // more than the alerts that can be active at once

}  // namespace

HitLog::HitLog(PerceptSink& next, const PhantomModel& model) : next_(next), model_(model) {
  records_.reserve(kMaxRecords);
}

void HitLog::on_alert(const percept::Alert& alert, bool cleared) {
  next_.on_alert(alert, cleared);
  const double now_s = core::seconds(core::monotonic_ns() - start_ns_);
  const std::lock_guard lock(mutex_);
  if (!cleared) {
    if (records_.size() < kMaxRecords) records_.push_back({alert, now_s});
    return;
  }
  for (std::size_t back = 1; back <= std::min(records_.size(), kOpenSearched); ++back) {
    Record& record = records_[records_.size() - back];
    if (record.alert.number == alert.number) record.cleared_s = now_s;
  }
}

std::optional<HitLog::Record> HitLog::record(std::size_t index) {
  const std::lock_guard lock(mutex_);
  return index < records_.size() ? std::optional(records_[index]) : std::nullopt;
}

/// Returns "gripper", or "forearm (elbow)" for an interest point.
std::string HitLog::place_of(const percept::Alert& alert) const {
  const std::string& link = model_.arm.links()[alert.at.link].name;
  if (alert.at.interest_point < 0) return link;
  return link + " (" + model_.interest_points[static_cast<std::size_t>(alert.at.interest_point)].name + ")";
}

void HitLog::log_new(const ObjectName& object_name) {
  while (const auto hit = record(logged_)) {
    ++logged_;
    const percept::TimeToContact& contact = hit->alert.at.contact;
    spdlog::info("hit alert {}: {} near {} (rule {}, {:.3f} m/s{})", hit->alert.number, place_of(hit->alert),
                 object_name(hit->alert.at.object), static_cast<int>(hit->alert.rule),
                 hit->alert.at.situation.speed_m_s,
                 contact.is_nearing() ? fmt::format(", contact in {:.2f} s", contact.time_s) : "");
  }
}

nlohmann::ordered_json HitLog::json(const ObjectName& object_name) {
  auto list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; const auto hit = record(i); ++i) {
    const percept::HitCandidate& at = hit->alert.at;
    list.push_back({{"t", hit->raised_s},
                    {"alert", hit->alert.number},
                    {"link", model_.arm.links()[at.link].name},
                    {"object", object_name(at.object)},
                    {"rule", static_cast<int>(hit->alert.rule)},
                    {"mu", at.situation.mu},
                    {"speed_m_s", at.situation.speed_m_s}});
    if (at.contact.is_nearing()) list.back()["time_to_contact_s"] = at.contact.time_s;
    if (at.contact.gap_m >= 0.0) list.back()["gap_m"] = at.contact.gap_m;
    if (at.interest_point >= 0)
      list.back()["point"] = model_.interest_points[static_cast<std::size_t>(at.interest_point)].name;
    if (hit->cleared_s >= 0.0) list.back()["cleared_t"] = hit->cleared_s;
  }
  return list;
}

}  // namespace phantom::phantom_sensing
