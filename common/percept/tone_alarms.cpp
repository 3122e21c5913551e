#include "common/percept/tone_alarms.hpp"

#include <array>

namespace phantom::percept {
namespace {

// Ten pulses: three and two, then three and two again, with `kRest_s` between the halves.
constexpr std::array<AlarmPulse, 10> ten_pulses(double three_Hz, double two_Hz) {
  constexpr double kOn_s = 0.150, kGap_s = 0.100, kRest_s = 0.600;
  std::array<AlarmPulse, 10> pulses{};
  for (std::size_t i = 0; i < pulses.size(); ++i) {
    const std::size_t k = i % 5;
    const double off_s = k == 2 ? 2.0 * kGap_s + kOn_s : k == 4 ? kRest_s : kGap_s;
    pulses[i] = {k < 3 ? three_Hz : two_Hz, kOn_s, off_s};
  }
  return pulses;
}

constexpr auto kEmergencyStopBurst = ten_pulses(932.0, 699.0);
constexpr auto kDriveFaultBurst = ten_pulses(523.0, 784.0);
constexpr AlarmPulse kUnsafeMotionPulse{1245.0, 0.065, 0.060};
constexpr std::array kUnsafeMotionBurst{kUnsafeMotionPulse, kUnsafeMotionPulse, kUnsafeMotionPulse,
                                        kUnsafeMotionPulse};
constexpr std::array<AlarmPulse, 3> kLinkLostBurst{
    {{622.0, 0.200, 0.200}, {523.0, 0.200, 0.200}, {415.0, 0.200, 0.200}}};
constexpr std::array<AlarmPulse, 3> kWorkspaceStaleBurst{
    {{415.0, 0.200, 0.200}, {622.0, 0.200, 0.200}, {415.0, 0.200, 0.200}}};
constexpr std::array<AlarmPulse, 2> kWorkspaceAgedBurst{{{415.0, 0.200, 0.200}, {622.0, 0.200, 0.200}}};
constexpr std::array<AlarmPulse, 1> kMutedContactBurst{{{330.0, 0.120, 0.100}}};

struct AlarmKind {
  const char* name;
  AlarmPriority priority;
  std::span<const AlarmPulse> burst;
};
using enum AlarmPriority;
constexpr std::array<AlarmKind, kAlarmCount> kAlarms{
    {{"none", kInformation, {}},
     {"allowed contact, muted", kInformation, kMutedContactBurst},
     {"workspace aged", kLow, kWorkspaceAgedBurst},
     {"workspace stale", kMedium, kWorkspaceStaleBurst},
     {"link lost", kMedium, kLinkLostBurst},
     {"unsafe motion", kHigh, kUnsafeMotionBurst},
     {"drive fault", kHigh, kDriveFaultBurst},
     {"emergency stop", kHigh, kEmergencyStopBurst}}};

const AlarmKind& kind_of(Alarm alarm) noexcept { return kAlarms[static_cast<std::size_t>(alarm)]; }

}  // namespace

AlarmPriority priority_of(Alarm alarm) noexcept { return kind_of(alarm).priority; }
const char* name_of(Alarm alarm) noexcept { return kind_of(alarm).name; }
std::span<const AlarmPulse> alarm_burst(Alarm alarm) noexcept { return kind_of(alarm).burst; }

double burst_duration_s(Alarm alarm) noexcept {
  const auto pulses = alarm_burst(alarm);
  double duration_s = 0.0;
  for (const AlarmPulse& pulse : pulses) duration_s += pulse.on_s + pulse.off_s;
  return pulses.empty() ? 0.0 : duration_s - pulses.back().off_s;
}

double burst_gain(Alarm alarm) noexcept {
  constexpr std::array<double, 4> kByPriority{0.3, 0.5, 0.8, 1.0};
  return kByPriority[static_cast<std::size_t>(priority_of(alarm))];
}

}  // namespace phantom::percept
