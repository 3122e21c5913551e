#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <optional>

#include "common/percept/tone_alarms.hpp"

namespace phantom::audio_percept {

using AlarmSet = std::bitset<percept::kAlarmCount>;  ///< by percept::Alarm

/// How rarely alarms may sound; what the operator must hear at once is not held back.
struct AlarmRules {
  int prompt_bursts = 3;           ///< then an alarm counts as noticed and repeats rarely
  double medium_delay_s = 0.1;     ///< a condition of medium priority that is shorter does not sound
  double low_delay_s = 1.0;        ///< the same of low priority and of information
  double high_repeat_s = 5.0;      ///< between the beginnings of prompt bursts of high priority
  double medium_repeat_s = 10.0;   ///< the same of medium, low and information: also when the condition flaps
  double lasting_repeat_s = 30.0;  ///< between bursts of what is noticed or acknowledged
  double least_silence_s = 0.3;    ///< between bursts, unless a graver alarm breaks in
  double forget_s = 10.0;          ///< a condition gone for so long begins anew when it comes back
};

/// Decides which alarm sounds when: the gravest condition that stands, promptly at first, rarely when it
/// lasts. A pure step; time comes in as dt.
class AlarmManager {
 public:
  explicit AlarmManager(const AlarmRules& rules);

  /// One period later, with the conditions that hold now. `acknowledged`: the operator has just shown that
  /// what stands is known. Returns the alarm whose burst begins now (it replaces what is being played), kNone
  /// if what is being played must end, or nothing if all goes on. Real-time safe: yes.
  std::optional<percept::Alarm> step(const AlarmSet& holding, bool acknowledged, double dt_s) noexcept;

  /// The gravest alarm that stands, sounding or not. Real-time safe: yes.
  percept::Alarm standing() const noexcept { return standing_; }
  std::uint64_t bursts() const noexcept { return bursts_; }  ///< that were begun

 private:
  struct Course {
    double held_s = 0.0, absent_s = 1e9, since_burst_s = 1e9;
    int bursts = 0;      // since it was last forgotten
    bool begun = false;  // whether it has sounded since it came to stand
    bool known = false;  // acknowledged
  };
  void follow(Course& course, percept::Alarm alarm, bool holds, double dt_s) noexcept;
  bool is_due(const Course& course, percept::Alarm alarm) const noexcept;
  void pass_time(double dt_s) noexcept;

  AlarmRules rules_;
  std::array<Course, percept::kAlarmCount> courses_{};
  percept::Alarm standing_ = percept::Alarm::kNone, playing_ = percept::Alarm::kNone;
  double playing_left_s_ = 0.0, silence_s_ = 1e9;
  std::uint64_t bursts_ = 0;
};

}  // namespace phantom::audio_percept
