#include "components/audio_percept/alarm_manager.hpp"

#include <algorithm>

namespace phantom::audio_percept {

using percept::Alarm;
using percept::AlarmPriority;

namespace {

// The unsafe-motion alarm repeats at short intervals, also when its condition comes and goes: a threat
// matters at every moment.
constexpr double kUnsafeRepeat_s = 0.75, kUnsafeLastingRepeat_s = 1.5;
// A condition of high priority that comes back sounds at once, but not more often than this.
constexpr double kHighHoldOff_s = 1.0;

double delay_s(const AlarmRules& rules, Alarm alarm) noexcept {
  const AlarmPriority priority = percept::priority_of(alarm);
  return priority == AlarmPriority::kHigh     ? 0.0
         : priority == AlarmPriority::kMedium ? rules.medium_delay_s
                                              : rules.low_delay_s;
}

}  // namespace

AlarmManager::AlarmManager(const AlarmRules& rules) : rules_(rules) {}

void AlarmManager::follow(Course& course, Alarm alarm, bool holds, double dt_s) noexcept {
  course.since_burst_s += dt_s;
  if (!holds) {
    course.absent_s += dt_s;
    course.held_s = 0.0;
    course.begun = course.known = false;
    if (course.absent_s > rules_.forget_s) course.bursts = 0;
    return;
  }
  course.absent_s = 0.0;
  course.held_s += dt_s;
  if (course.held_s > delay_s(rules_, alarm)) active_ = std::max(active_, alarm);
}

bool AlarmManager::is_due(const Course& course, Alarm alarm) const noexcept {
  const AlarmPriority priority = percept::priority_of(alarm);
  const bool noticed = course.known || course.bursts >= rules_.prompt_bursts;
  if (alarm == Alarm::kUnsafeMotion)
    return course.since_burst_s >= (noticed ? kUnsafeLastingRepeat_s : kUnsafeRepeat_s);
  if (priority == AlarmPriority::kHigh && !course.begun) return course.since_burst_s >= kHighHoldOff_s;
  // Information sounds once, when its condition begins.
  if (priority == AlarmPriority::kInformation && course.begun) return false;
  const double prompt_s = priority == AlarmPriority::kHigh ? rules_.high_repeat_s : rules_.medium_repeat_s;
  return course.since_burst_s >= (noticed ? rules_.lasting_repeat_s : prompt_s);
}

void AlarmManager::pass_time(double dt_s) noexcept {
  if (playing_ == Alarm::kNone) {
    silence_s_ += dt_s;
    return;
  }
  playing_left_s_ -= dt_s;
  if (playing_left_s_ > 0.0) return;
  playing_ = Alarm::kNone;
  silence_s_ = 0.0;
}

std::optional<Alarm> AlarmManager::step(const AlarmSet& holding, bool acknowledged, double dt_s) noexcept {
  active_ = Alarm::kNone;
  for (std::size_t i = 1; i < courses_.size(); ++i)
    follow(courses_[i], static_cast<Alarm>(i), holding[i], dt_s);
  if (acknowledged) {
    for (Course& course : courses_) course.known = course.begun;
  }
  pass_time(dt_s);
  std::optional<Alarm> change;
  const bool over = playing_ != Alarm::kNone && !holding[static_cast<std::size_t>(playing_)];
  // Bursts of lower priority are short and play to their end.
  if (over && percept::priority_of(playing_) == AlarmPriority::kHigh) {
    playing_ = Alarm::kNone;
    silence_s_ = 0.0;
    change = Alarm::kNone;
  }
  Course& most_severe = courses_[static_cast<std::size_t>(active_)];
  if (active_ == Alarm::kNone || !is_due(most_severe, active_)) return change;
  const bool urgent = percept::priority_of(active_) == AlarmPriority::kHigh;
  const bool may_begin =
      playing_ == Alarm::kNone ? urgent || silence_s_ >= rules_.least_silence_s : active_ > playing_;
  if (!may_begin) return change;
  most_severe.since_burst_s = 0.0;
  most_severe.begun = true;
  ++most_severe.bursts;
  ++bursts_;
  playing_ = active_;
  playing_left_s_ = percept::burst_duration_s(active_);
  return active_;
}

}  // namespace phantom::audio_percept
