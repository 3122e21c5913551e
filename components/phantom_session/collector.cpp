#include "components/phantom_session/collector.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/core/text.hpp"
#include "common/messages/living.hpp"
#include "common/runtime/cell/other_arms.hpp"

namespace phantom::phantom_session {
namespace {

using core::formatted;

constexpr double kProgressInterval_s = 2.0;

double greatest(const core::JointArray& values) {
  double most = 0.0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

const char* words_for(percept::MotionClass motion) {
  constexpr std::array kWords{"", "leaving", "passing", "nearing"};
  return kWords.at(static_cast<std::size_t>(motion));
}

}  // namespace

Collector::Collector(double onset_threshold_Nm, double row_interval_s, Narrate narrate)
    : onset_threshold_Nm_(onset_threshold_Nm),
      row_interval_s_(row_interval_s),
      narrate_(std::move(narrate)) {}

void Collector::narrate(double t_s, const std::string& what) {
  waiting_.push_back({t_s, what});
  narrate_until(t_s);
}

void Collector::narrate_hit(const HitSample& sample) {
  narrate_until(sample.t_s);
  const std::string place = sample.point.empty() ? "skin" : sample.point;
  for (Line& line : waiting_) {
    const bool same = line.hit && line.hit->link == sample.link && line.hit->object == sample.object &&
                      line.hit->rule == sample.rule;
    if (!same || std::find(line.places.begin(), line.places.end(), place) != line.places.end()) continue;
    line.places.push_back(place);
    return;
  }
  waiting_.push_back({sample.t_s, "", sample, {place}});
}

std::string Collector::text_of(const Line& line) const {
  if (!line.hit) return line.what;
  std::string places = line.hit->place();
  if (line.places.size() > 1) places = line.hit->link + " (" + core::listed(line.places) + ")";
  return "  hit threatens: " + places + " near " + object_name(line.hit->object) + " (" + line.hit->rule +
         ")";
}

// Keeps the order of events: lines after a hit that may still grow wait with it.
void Collector::narrate_until(double now_s) {
  while (!waiting_.empty() && !(waiting_.front().hit && now_s < waiting_.front().t_s + kSameHit_s)) {
    const Line& line = waiting_.front();
    if (narrate_) narrate_(formatted("%7.2f s  ", line.t_s) + text_of(line));
    waiting_.pop_front();
  }
}

std::string Collector::object_name(int object) const {
  if (object == 0) return "something unknown";
  const auto found = object_names_.find(object);
  if (found != object_names_.end()) return found->second;
  if (object > 0 && object <= messages::kLiveId && messages::is_live(static_cast<std::uint16_t>(object)))
    return messages::live_name(static_cast<std::uint16_t>(object));
  return object >= runtime::kFirstOtherArmId ? "another arm" : "object " + std::to_string(object);
}

void Collector::begin_reach(double t_s, const messages::MasterState& state) {
  if (reaches_.size() >= kMaxEvents) {
    forgotten_.reaches += state.reach == forgotten_reach_ ? 0 : 1;
    forgotten_reach_ = state.reach;
    return;
  }
  reaches_.push_back({.number = state.reach, .percept = state.percept_enabled, .start_s = t_s});
  const char* percept = !state.percept_enabled ? "off"
                        : has_percept()        ? "on"
                                               : "on, but nothing is sensed yet";
  narrate(t_s, formatted("reach %d begins, percept %s", state.reach, percept));
}

void Collector::on_master(double t_s, const messages::MasterState& state) {
  master_ = state;
  if (state.reach >= 0 && (reaches_.empty() || reaches_.back().number != state.reach))
    begin_reach(t_s, state);
  if (state.reach < 0 || reaches_.empty()) return;
  Reach& reach = reaches_.back();
  if (reach.contact_s || !state.percept_enabled) return;
  reach.percept_missing = reach.percept_missing || !has_percept();
  const double torque_Nm = greatest(state.percept_torque_Nm);
  reach.peak_torque_Nm = std::max(reach.peak_torque_Nm, torque_Nm);
  if (!reach.onset_distance_m && torque_Nm > onset_threshold_Nm_ && slave_.clearance_m >= 0.0) {
    reach.onset_distance_m = slave_.clearance_m;
    narrate(t_s, formatted("  drag felt at %.0f mm from the nearest object", 1e3 * slave_.clearance_m));
  }
}

void Collector::on_percepts(double t_s, const PerceptsInForce& percepts) {
  const bool same = !percept_periods_.empty() && percept_periods_.back().percepts == percepts;
  if (same || percept_periods_.size() >= kMaxEvents) return;
  percept_periods_.push_back({t_s, percepts});
  narrate(t_s, percepts.words());
}

void Collector::on_slave(double t_s, const messages::SlaveState& state) {
  const bool begins = state.contact && !slave_.contact;
  if (begins && !reaches_.empty() && !reaches_.back().contact_s) {
    Reach& reach = reaches_.back();
    reach.contact_s = t_s;
    reach.contact_speed_m_s = slave_.tool_speed_m_s;
    reach.contact_object = state.contact_object;
    narrate(t_s, "  contact with " + object_name(state.contact_object) +
                     formatted(" at %.0f mm/s, percept torque had risen to %.2f N·m",
                               1e3 * reach.contact_speed_m_s, reach.peak_torque_Nm));
  }
  slave_ = state;
  narrate_until(t_s);
  add_row(t_s);
}

void Collector::add_row(double t_s) {
  if (!rows_.empty() && t_s - rows_.back().t_s < row_interval_s_) return;
  const messages::Percept felt = percept_.value_or(messages::Percept());
  rows_.push_back({t_s, master_.reach, master_.percept_enabled, slave_.clearance_m,
                   greatest(master_.percept_torque_Nm), greatest(master_.feedback_torque_Nm),
                   greatest(master_.operator_torque_Nm), felt.mu_Pa_s_per_m, felt.closeness,
                   slave_.tool_speed_m_s, slave_.contact_force_N});
}

std::string Collector::live_line() const {
  if (!percept_) return "no percept yet";
  if (!percept_->valid) return "no percept";
  std::string line = "drag";
  for (std::size_t j = 0; j < percept_->joint_count; ++j)
    line += formatted(" %+.2f", percept_->drag_torque_Nm[j]);
  line += '\n';
  if (percept_->mu_Pa_s_per_m > 0.0) {
    const bool named = percept_->link < link_names_.size();
    line += named ? link_names_[percept_->link] : "link " + std::to_string(percept_->link);
    line += formatted(", μ %.0f of ", percept_->mu_Pa_s_per_m) + object_name(percept_->object);
    if (percept_->motion != percept::MotionClass::kNone)
      line += std::string(", ") + words_for(percept_->motion);
  } else {
    line += "free";
  }
  if (percept_->muted_sensors > 0) line += " | " + std::to_string(percept_->muted_sensors) + " sensors muted";
  const auto sensing = statuses_.find("phantom_sensing");
  if (sensing == statuses_.end()) return line;
  const auto age = sensing->second.figures.find("model_age");
  return age == sensing->second.figures.end() ? line : line + formatted(" | model age %.1f ms", age->second);
}

void Collector::count_alarms(std::size_t begun) {
  if (master_.reach >= 0 && !reaches_.empty()) reaches_.back().alarms += begun;
}

void Collector::on_percept(double t_s, const messages::Percept& percept) {
  percept_ = percept;
  count_alarms(alarms_.on_threats(t_s, std::span(percept.threats.begin(), percept.threats.size())));
}

void Collector::on_hit(const HitSample& sample) {
  if (sample.cleared) return alarms_.on_cleared(sample.t_s, sample.alert);
  count_alarms(alarms_.on_raised(sample.t_s, sample.alert, sample.object, sample.asks));
  if (hits_.size() < kMaxEvents) {
    hits_.push_back(sample);
  } else {
    ++forgotten_.hits;
  }
  narrate_hit(sample);
}

void Collector::on_status(const StatusSample& sample) {
  const auto known = statuses_.find(sample.component);
  const bool news =
      !sample.message.empty() && (known == statuses_.end() || known->second.message != sample.message);
  // The progress of a start is narrated every kProgressInterval_s, everything else at once.
  const auto narrated = narrated_s_.find(sample.component);
  const bool soon = sample.state == core::ComponentState::kStarting && narrated != narrated_s_.end() &&
                    sample.t_s - narrated->second < kProgressInterval_s;
  if (news && !soon) {
    narrate(sample.t_s, sample.component + ": " + sample.message);
    narrated_s_[sample.component] = sample.t_s;
  }
  narrate_until(sample.t_s);
  statuses_[sample.component] = sample;
  if (statuses_.size() <= kMaxComponents) return;
  const auto oldest = std::min_element(statuses_.begin(), statuses_.end(), [](const auto& a, const auto& b) {
    return a.second.t_s < b.second.t_s;
  });
  ++forgotten_.components;
  narrated_s_.erase(oldest->first);
  statuses_.erase(oldest);
}

void Collector::on_foreign_writer(double t_s, const std::string& topic, const std::string& process,
                                  std::uint64_t samples) {
  const auto known = std::find_if(foreign_writers_.begin(), foreign_writers_.end(), [&](const auto& each) {
    return each.topic == topic && each.process == process;
  });
  if (known != foreign_writers_.end()) {
    known->samples = samples;
    return;
  }
  if (foreign_writers_.size() == kMaxComponents) return;
  foreign_writers_.push_back({t_s, topic, process, samples});
  narrate(t_s, "a second process writes " + topic + ": " + process + "; its samples are left out");
}

bool Collector::all_ready(const std::vector<std::string>& components, std::string* missing) const {
  std::string names;
  for (const auto& name : components) {
    const auto found = statuses_.find(name);
    const bool ready = found != statuses_.end() && (found->second.state == core::ComponentState::kReady ||
                                                    found->second.state == core::ComponentState::kRunning);
    if (!ready) core::add_to_list(names, name);
  }
  if (missing != nullptr) *missing = names;
  return names.empty();
}

std::string Collector::page() const {
  for (const auto& [component, status] : statuses_) {
    if (!status.page.empty()) return status.page;
  }
  return {};
}

bool Collector::any_stopped() const {
  return std::any_of(statuses_.begin(), statuses_.end(), [](const auto& entry) {
    const bool arm = entry.first == "master_io" || entry.first == "slave_io";
    return arm && entry.second.state == core::ComponentState::kStopped;
  });
}

}  // namespace phantom::phantom_session
