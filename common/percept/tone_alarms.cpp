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
constexpr std::array<AlarmPulse, 4> kUnsafeMotionBurst{
    {{1245.0, 0.065, 0.060}, {1245.0, 0.065, 0.060}, {1245.0, 0.065, 0.060}, {1245.0, 0.065, 0.060}}};
constexpr std::array<AlarmPulse, 3> kLinkLostBurst{
    {{622.0, 0.200, 0.200}, {523.0, 0.200, 0.200}, {415.0, 0.200, 0.200}}};
constexpr std::array<AlarmPulse, 3> kWorkspaceStaleBurst{
    {{415.0, 0.200, 0.200}, {622.0, 0.200, 0.200}, {415.0, 0.200, 0.200}}};
constexpr std::array<AlarmPulse, 2> kWorkspaceAgedBurst{{{415.0, 0.200, 0.200}, {622.0, 0.200, 0.200}}};
constexpr std::array<AlarmPulse, 1> kMutedContactBurst{{{330.0, 0.120, 0.100}}};

}  // namespace

AlarmPriority priority_of(Alarm alarm) noexcept {
  switch (alarm) {
    case Alarm::kEmergencyStop:
    case Alarm::kDriveFault:
    case Alarm::kUnsafeMotion:
      return AlarmPriority::kHigh;
    case Alarm::kLinkLost:
    case Alarm::kWorkspaceStale:
      return AlarmPriority::kMedium;
    case Alarm::kWorkspaceAged:
      return AlarmPriority::kLow;
    case Alarm::kMutedContact:
    case Alarm::kNone:
      break;
  }
  return AlarmPriority::kInformation;
}

const char* name_of(Alarm alarm) noexcept {
  constexpr std::array<const char*, kAlarmCount> kNames{
      "none",      "allowed contact, muted", "workspace aged", "workspace stale",
      "link lost", "unsafe motion",          "drive fault",    "emergency stop"};
  return kNames[static_cast<std::size_t>(alarm)];
}

std::span<const AlarmPulse> alarm_burst(Alarm alarm) noexcept {
  switch (alarm) {
    case Alarm::kEmergencyStop:
      return kEmergencyStopBurst;
    case Alarm::kDriveFault:
      return kDriveFaultBurst;
    case Alarm::kUnsafeMotion:
      return kUnsafeMotionBurst;
    case Alarm::kLinkLost:
      return kLinkLostBurst;
    case Alarm::kWorkspaceStale:
      return kWorkspaceStaleBurst;
    case Alarm::kWorkspaceAged:
      return kWorkspaceAgedBurst;
    case Alarm::kMutedContact:
      return kMutedContactBurst;
    case Alarm::kNone:
      break;
  }
  return {};
}

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
