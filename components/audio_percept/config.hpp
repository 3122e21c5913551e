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
  kAuto,  ///< a live device if one opens, else paced until one does
  kLive,  ///< a live device from the start, or an error
  kPaced  ///< no device: the sound is made at its pace and goes to the recording alone
};

/// audio_percept.yaml.
struct AudioPerceptConfig {
  percept::ToneLaw law;
  double smoothing_s = 0.010;
  double alarm_gain = 0.3;
  AlarmRules alarms;
  core::Nanoseconds unsafe_alarm_ns = 0;     ///< how long a new hit alert sounds
  core::Nanoseconds percept_timeout_ns = 0;  ///< age from which a percept is stale
  core::Nanoseconds link_timeout_ns = 0;     ///< age from which a master or slave state is stale
  ListenerConfig listener{.main_azimuth_rad = -50 * core::kRadPerDegree,
                          .main_elevation_rad = 26 * core::kRadPerDegree};
  SinkChoice sink = SinkChoice::kAuto;
  std::string device;    ///< OpenAL's name of a playback device; empty: the default one
  double retry_s = 5.0;  ///< between attempts to open a device, while there is none
  Layout layout = Layout::kStereo;
  int servo_priority = 0;  ///< SCHED_FIFO priority of the servos, to which the audio thread's and OpenAL's
                           ///< are relative; 0: do not ask
};

extern const char* const kParameters;  ///< the shipped audio_percept.yaml: their table

/// Reads and checks a configuration. Throws runtime::ConfigError (file, line, key, value, what is allowed).
AudioPerceptConfig load_config(const std::filesystem::path& path);

}  // namespace phantom::audio_percept
