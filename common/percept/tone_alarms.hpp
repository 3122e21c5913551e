#pragma once

#include <cstddef>
#include <span>

namespace phantom::percept {

/// Alarms that sound besides the percept, in order of rising severity. Alarms are bursts of pulses with odd
/// harmonics; the percept is a continuous pure tone.
enum class Alarm {
  kNone,
  kMutedContact,    ///< the arm touches an allowed object, whose fluid it does not feel
  kWorkspaceAged,   ///< the percept is valid, but the model may lag behind the cell
  kWorkspaceStale,  ///< the model is not reliable: there is no percept
  kLinkLost,        ///< master, slave or phantom is silent or degraded
  kUnsafeMotion,    ///< a hit threatens
  kDriveFault,
  kEmergencyStop
};
inline constexpr std::size_t kAlarmCount = 8;

/// How soon somebody must act, as in IEC 60601-1-8.
enum class AlarmPriority { kInformation, kLow, kMedium, kHigh };
/// Returns the priority of an alarm. Real-time safe: yes.
AlarmPriority priority_of(Alarm alarm) noexcept;
/// Returns the alarm's name for display, such as "emergency stop". Real-time safe: yes.
const char* name_of(Alarm alarm) noexcept;

/// A pulse of a burst and the pause after it.
struct AlarmPulse {
  double frequency_Hz = 0.0;
  double on_s = 0.0, off_s = 0.0;
};
/// Returns the burst of `alarm`; empty for kNone. High, medium and low priority have the pulse counts and
/// times of IEC 60601-1-8:2006, tables 3 and 4 (ten pulses 3-2-3-2, three, two). Unsafe motion must be heard
/// within a fraction of a second, so its burst is faster than any of them. Real-time safe: yes.
std::span<const AlarmPulse> alarm_burst(Alarm alarm) noexcept;
/// Returns the time from the first pulse to the end of the last. Real-time safe: yes.
double burst_duration_s(Alarm alarm) noexcept;
/// Returns the amplitude of the burst relative to alarms of high priority, 0…1. Real-time safe: yes.
double burst_gain(Alarm alarm) noexcept;

}  // namespace phantom::percept
