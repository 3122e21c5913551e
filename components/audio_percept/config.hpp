#pragma once

#include <filesystem>
#include <string>

#include "common/core/clock.hpp"
#include "common/core/units.hpp"
#include "common/percept/tone.hpp"
#include "components/audio_percept/alarm_manager.hpp"
#include "components/audio_percept/layout.hpp"
#include "components/audio_percept/listener.hpp"

namespace phantom::audio_percept {

enum class SinkChoice {
  kAuto,  ///< a live device if one opens; until then, paced
  kLive,  ///< a live device from the start, or an error
  kPaced  ///< no device: the sound is rendered in real time and goes only to the recording
};

/// The checked content of audio_percept.yaml.
struct AudioPerceptConfig {
  percept::ToneLaw law;
  double smoothing_s = 0.010;
  double alarm_gain = 0.3;
  AlarmRules alarms;
  core::Nanoseconds unsafe_alarm_ns = 0;     ///< how long a new hit alert sounds the alarm
  core::Nanoseconds percept_timeout_ns = 0;  ///< age from which a percept is stale
  core::Nanoseconds link_timeout_ns = 0;     ///< age from which a master or slave state is stale
  ListenerConfig listener{.main_azimuth_rad = -50 * core::kRadPerDegree,
                          .main_elevation_rad = 26 * core::kRadPerDegree};
  SinkChoice sink = SinkChoice::kAuto;
  std::string device;    ///< name of a playback device in OpenAL; empty: the default device
  double retry_s = 5.0;  ///< between attempts to open a device while none is open
  Layout layout = Layout::kStereo;
  /// SCHED_FIFO priority of the servos, to which the priorities of the audio thread and of OpenAL's thread
  /// are relative; 0: none requested.
  int servo_priority = 0;
};

extern const char* const kParameters;  ///< the shipped audio_percept.yaml, which defines the parameters

/// Reads and checks a configuration. Throws runtime::ConfigError with file, line, key, value and what is
/// allowed.
AudioPerceptConfig load_config(const std::filesystem::path& path);

}  // namespace phantom::audio_percept
