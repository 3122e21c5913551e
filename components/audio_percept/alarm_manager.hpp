#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <optional>

#include "common/percept/tone_alarms.hpp"

namespace phantom::audio_percept {

using AlarmSet = std::bitset<percept::kAlarmCount>;  ///< one bit for each percept::Alarm

/// Limits how often alarms sound. What the operator must hear at once is not delayed.
struct AlarmRules {
  int prompt_bursts = 3;  ///< number of bursts after which an alarm counts as noticed and repeats rarely
  double medium_delay_s = 0.1;  ///< a condition of medium priority shorter than this does not sound
  double low_delay_s = 1.0;     ///< the same for low priority and for information
  double high_repeat_s = 5.0;   ///< from one prompt burst of high priority to the next, start to start
  /// The same for medium, low and information, also if the condition comes and goes.
  double medium_repeat_s = 10.0;
  double lasting_repeat_s = 30.0;  ///< between bursts of a noticed or acknowledged alarm
  double least_silence_s = 0.3;    ///< between bursts, unless an alarm of higher priority interrupts
  double forget_s = 10.0;          ///< a condition absent for this long starts anew when it comes back
};

/// Decides which alarm sounds when: the most serious condition present, promptly at first, rarely if it
/// lasts. A pure step; time comes in as dt.
class AlarmManager {
 public:
  explicit AlarmManager(const AlarmRules& rules);

  /// Advances by one period, given the conditions that hold now. `acknowledged`: the operator has just shown
  /// that he knows the present alarms. Returns the alarm whose burst begins now (it replaces the one being
  /// played), kNone if the burst being played must end, or nothing if playback continues unchanged. Real-time
  /// safe: yes.
  std::optional<percept::Alarm> step(const AlarmSet& holding, bool acknowledged, double dt_s) noexcept;

  /// Returns the most serious alarm present, whether it sounds or not. Real-time safe: yes.
  percept::Alarm active() const noexcept { return active_; }
  std::uint64_t bursts() const noexcept { return bursts_; }  ///< number of bursts started

 private:
  struct Course {
    double held_s = 0.0, absent_s = 1e9, since_burst_s = 1e9;
    int bursts = 0;      // since the condition last started anew
    bool begun = false;  // whether it has sounded since the condition began to hold
    bool known = false;  // acknowledged
  };
  void follow(Course& course, percept::Alarm alarm, bool holds, double dt_s) noexcept;
  bool is_due(const Course& course, percept::Alarm alarm) const noexcept;
  void pass_time(double dt_s) noexcept;

  AlarmRules rules_;
  std::array<Course, percept::kAlarmCount> courses_{};
  percept::Alarm active_ = percept::Alarm::kNone, playing_ = percept::Alarm::kNone;
  double playing_left_s_ = 0.0, silence_s_ = 1e9;
  std::uint64_t bursts_ = 0;
};

}  // namespace phantom::audio_percept
