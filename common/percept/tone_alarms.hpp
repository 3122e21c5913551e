#pragma once

#include <cstddef>
#include <span>

namespace phantom::percept {

/// What sounds apart from the percept, the gravest last. Alarms come in bursts of pulses with odd harmonics,
/// where the percept is a continuous pure tone.
enum class Alarm {
  kNone,
  kMutedContact,    ///< an allowed contact is being touched: it is not felt
  kWorkspaceAged,   ///< the percept counts, but the model may lag behind the cell
  kWorkspaceStale,  ///< the model cannot be relied on: there is no percept
  kLinkLost,        ///< master, slave or phantom is silent or degraded
  kUnsafeMotion,    ///< a hit threatens
  kDriveFault,
  kEmergencyStop
};
inline constexpr std::size_t kAlarmCount = 8;

/// As in IEC 60601-1-8: how soon somebody must act.
enum class AlarmPriority { kInformation, kLow, kMedium, kHigh };
/// Real-time safe: yes.
AlarmPriority priority_of(Alarm alarm) noexcept;
/// For people: "emergency stop". Real-time safe: yes.
const char* name_of(Alarm alarm) noexcept;

/// A pulse of a burst and the pause after it.
struct AlarmPulse {
  double frequency_Hz = 0.0;
  double on_s = 0.0, off_s = 0.0;
};
/// The burst of `alarm`; empty for kNone. High, medium and low priority keep to the pulse counts and times
/// of IEC 60601-1-8:2006, tables 3 and 4 (ten pulses 3-2-3-2, three, two); unsafe motion, which must be
/// heard within a fraction of a second, is faster than any of them. Real-time safe: yes.
std::span<const AlarmPulse> alarm_burst(Alarm alarm) noexcept;
/// From the first pulse to the end of the last. Real-time safe: yes.
double burst_duration_s(Alarm alarm) noexcept;
/// Loudness of the burst against alarms of high priority, 0…1. Real-time safe: yes.
double burst_gain(Alarm alarm) noexcept;

}  // namespace phantom::percept
