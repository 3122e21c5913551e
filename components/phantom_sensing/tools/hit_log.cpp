#include "components/phantom_sensing/tools/hit_log.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace phantom::phantom_sensing {
namespace {

constexpr std::size_t kMaxRecords = 10'000, kMaxDoubtRecords = 1'000;
constexpr std::size_t kOpenSearched = 64;  // more than the alerts that can be active at once

}  // namespace

std::string doubt_sentence(const percept::ModelDoubt& doubt, const std::string& link,
                           const std::string& object) {
  const percept::DoubtEvidence& at = doubt.at;
  if (at.kind == percept::DoubtKind::kNoForceInside)
    return fmt::format("no force at {}, {:.0f} mm inside {}", link, -1e3 * at.residual_m, object);
  const std::string force = at.force_N >= 0.0 ? fmt::format("force of {:.1f} N", at.force_N) : "a force";
  const std::string where = at.located ? " at " : " somewhere on or behind ";
  if (!std::isfinite(at.residual_m)) return force + where + link + ", where no object reaches";
  return force + where + link + fmt::format(", {:.0f} mm from {}", 1e3 * at.residual_m, object);
}

HitLog::HitLog(PerceptSink& next, const PhantomModel& model) : next_(next), model_(model) {
  records_.reserve(kMaxRecords);
  doubts_.reserve(kMaxDoubtRecords);
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

void HitLog::on_doubt(const percept::ModelDoubt& doubt, bool holds) {
  next_.on_doubt(doubt, holds);
  const double now_s = core::seconds(core::monotonic_ns() - start_ns_);
  const std::lock_guard lock(mutex_);
  auto& in_force = in_force_[static_cast<std::size_t>(doubt.at.kind)];
  if (holds) {
    in_force = doubt;
    if (doubts_.size() < kMaxDoubtRecords) doubts_.push_back({doubt, now_s});
    return;
  }
  if (in_force && in_force->number == doubt.number) in_force.reset();
  for (DoubtRecord& record : doubts_)
    if (record.doubt.number == doubt.number) record.held_s = now_s - record.raised_s;
}

std::optional<HitLog::DoubtRecord> HitLog::doubt_record(std::size_t index) {
  const std::lock_guard lock(mutex_);
  return index < doubts_.size() ? std::optional(doubts_[index]) : std::nullopt;
}

std::string HitLog::sentence_of(const percept::ModelDoubt& doubt, const ObjectName& object_name) const {
  return doubt_sentence(doubt, model_.arm.links()[doubt.at.link].name, object_name(doubt.at.object));
}

std::string HitLog::doubt_in_force(const ObjectName& object_name) {
  std::optional<percept::ModelDoubt> newest;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& doubt : in_force_)
      if (doubt && (!newest || doubt->number > newest->number)) newest = doubt;
  }
  return newest ? sentence_of(*newest, object_name) : "";
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
  while (const auto record = doubt_record(doubts_logged_)) {
    ++doubts_logged_;
    spdlog::warn("the model is in doubt ({}): {}", record->doubt.number,
                 sentence_of(record->doubt, object_name));
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

nlohmann::ordered_json HitLog::doubts_json(const ObjectName& object_name) {
  auto list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; const auto record = doubt_record(i); ++i) {
    const percept::DoubtEvidence& at = record->doubt.at;
    const bool inside = at.kind == percept::DoubtKind::kNoForceInside;
    list.push_back({{"t", record->raised_s},
                    {"doubt", record->doubt.number},
                    {"kind", inside ? "no_force_inside" : "force_in_free_space"},
                    {"link", model_.arm.links()[at.link].name},
                    {"object", at.object != 0 ? object_name(at.object) : ""},
                    {"position_m", {at.position_W_m.x(), at.position_W_m.y(), at.position_W_m.z()}},
                    {"located", at.located}});
    if (at.force_N >= 0.0) list.back()["force_N"] = at.force_N;
    if (std::isfinite(at.residual_m)) list.back()["residual_m"] = at.residual_m;
    if (record->held_s >= 0.0) list.back()["held_s"] = record->held_s;
  }
  return list;
}

}  // namespace phantom::phantom_sensing
