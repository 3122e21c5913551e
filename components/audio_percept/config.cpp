#include "components/audio_percept/config.hpp"

#include <algorithm>

#include "common/core/units.hpp"
#include "common/percept/equal_loudness.hpp"
#include "common/runtime/config_reader.hpp"

namespace phantom::audio_percept {
namespace {

/// An exponent, which only the power law has.
double exponent(const runtime::ConfigReader& section, bool power_law, double fallback) {
  if (!power_law && section.has("exponent"))
    throw section.error("exponent", "does nothing: it belongs to law: power; allowed: leave it out");
  return section.number("exponent", fallback, {0.1, 4, ""});
}

percept::ToneLaw read_law(const runtime::ConfigReader& file) {
  percept::ToneLaw law;
  const auto pitch = file.section("pitch");
  const std::string pitch_law = pitch.choice("law", "exponential", {"exponential", "power", "linear"});
  law.pitch = pitch_law == "linear"  ? percept::PitchLaw::kLinear
              : pitch_law == "power" ? percept::PitchLaw::kPower
                                     : percept::PitchLaw::kExponential;
  law.pitch_exponent = exponent(pitch, law.pitch == percept::PitchLaw::kPower, law.pitch_exponent);
  law.min_frequency_Hz = pitch.number("min_frequency_Hz", {20, 8000, "Hz"});
  law.max_frequency_Hz = pitch.number("max_frequency_Hz", {20, 8000, "Hz"});
  if (law.max_frequency_Hz <= law.min_frequency_Hz) {
    throw pitch.error("max_frequency_Hz",
                      "is not above min_frequency_Hz; allowed: more than that, up to 8000 Hz");
  }
  const auto level = file.section("level");
  const std::string level_law = level.choice("law", "power", {"power", "exponential", "linear"});
  law.level = level_law == "linear"        ? percept::LevelLaw::kLinear
              : level_law == "exponential" ? percept::LevelLaw::kExponential
                                           : percept::LevelLaw::kPower;
  law.speed_exponent = exponent(level, law.level == percept::LevelLaw::kPower, law.speed_exponent);
  law.rest_gain = level.number("rest_gain", {0.001, 1, ""});
  law.full_gain = level.number("full_gain", {0.001, 1, ""});
  if (law.full_gain < law.rest_gain)
    throw level.error("full_gain", "is below rest_gain; allowed: at least that, up to 1");
  law.full_speed_m_s = level.number("full_speed_m_s", {0.001, 100, "m/s"});
  law.loudness_phon = level.number("loudness_phon", law.loudness_phon, {0, percept::kMostPhon, "phon"});
  if (law.loudness_phon > 0.0 && law.loudness_phon < percept::kLeastPhon)
    throw level.error("loudness_phon",
                      "is outside of ISO 226; allowed: 20 to 80 phon, or 0 for no compensation");
  return law;
}

AlarmRules read_alarms(const runtime::ConfigReader& alarms) {
  AlarmRules rules;
  rules.prompt_bursts = alarms.integer("prompt_bursts", rules.prompt_bursts, {1, 1000, ""});
  rules.medium_delay_s = alarms.number("medium_delay_s", rules.medium_delay_s, {0, 10, "s"});
  rules.low_delay_s = alarms.number("low_delay_s", rules.low_delay_s, {0, 60, "s"});
  rules.high_repeat_s = alarms.number("high_repeat_s", rules.high_repeat_s, {4, 60, "s"});
  rules.medium_repeat_s = alarms.number("medium_repeat_s", rules.medium_repeat_s, {2.5, 120, "s"});
  rules.lasting_repeat_s = alarms.number("lasting_repeat_s", rules.lasting_repeat_s, {4, 3600, "s"});
  rules.least_silence_s = alarms.number("least_silence_s", rules.least_silence_s, {0, 10, "s"});
  rules.forget_s = alarms.number("forget_s", rules.forget_s, {0, 3600, "s"});
  if (rules.lasting_repeat_s < std::max(rules.high_repeat_s, rules.medium_repeat_s)) {
    throw alarms.error("lasting_repeat_s",
                       "is below high_repeat_s or medium_repeat_s; allowed: at least these, up to 3600 s");
  }
  return rules;
}

ListenerConfig read_listener(const runtime::ConfigReader& section) {
  ListenerConfig listener;
  const Eigen::Vector3d ears_m = section.vector3("ears_m", Eigen::Vector3d::Map(listener.ears_m.data()));
  listener.ears_m = {ears_m.x(), ears_m.y(), ears_m.z()};
  const std::string view = section.choice(
      "view", "main", {"main", "1", "2", "3", "4", "5", "6", "7", "8", "N", "S", "E", "W", "T", "B"});
  listener.view = percept::node_from_name(view);  // "main" names none
  listener.follow_viewer = section.flag("follow_viewer", listener.follow_viewer);
  listener.view_timeout_ns =
      core::from_seconds(1e-3 * section.number("view_timeout_ms", 1000, {100, 60000, "ms"}));
  listener.follow_operator = section.flag("follow_operator", listener.follow_operator);
  listener.main_azimuth_rad =
      core::kRadPerDegree * section.number("main_azimuth_deg", -50.0, {-360, 360, "deg"});
  listener.main_elevation_rad =
      core::kRadPerDegree * section.number("main_elevation_deg", 26.0, {-90, 90, "deg"});
  listener.near_m = section.number("near_m", listener.near_m, {0, 10, "m"});
  return listener;
}

Layout read_layout(const runtime::ConfigReader& output) {
  const std::string channels = output.choice("channels", "stereo", {"mono", "stereo", "5.1", "7.1", "hrtf"});
  for (const Layout layout : {Layout::kMono, Layout::kStereo, Layout::k5_1, Layout::k7_1}) {
    if (channels == name_of(layout)) return layout;
  }
  return Layout::kHrtf;
}

core::Nanoseconds milliseconds(const runtime::ConfigReader& section, const char* key) {
  return core::from_seconds(1e-3 * section.number(key, {20, 10000, "ms"}));
}

}  // namespace

AudioPerceptConfig load_config(const std::filesystem::path& path) {
  const auto file = runtime::ConfigReader::from_file(path);
  AudioPerceptConfig config;
  config.law = read_law(file);
  config.smoothing_s = 1e-3 * file.number("smoothing_ms", 10, {2, 200, "ms"});
  const auto alarms = file.section("alarms");
  config.alarm_gain = alarms.number("gain", {0.01, 1, ""});
  if (config.alarm_gain + config.law.full_gain > 1.0) {
    throw alarms.error("gain",
                       "and level.full_gain are more than full scale together; allowed: a sum of at most 1");
  }
  config.alarms = read_alarms(alarms);
  config.unsafe_alarm_ns = core::from_seconds(alarms.number("unsafe_motion_s", {0.1, 3600, "s"}));
  const auto staleness = file.section("staleness");
  config.percept_timeout_ns = milliseconds(staleness, "percept_timeout_ms");
  config.link_timeout_ns = milliseconds(staleness, "link_timeout_ms");
  config.listener = read_listener(file.optional_section("listener"));
  const auto output = file.optional_section("output");
  const std::string sink = output.choice("sink", "auto", {"auto", "live", "paced"});
  config.sink = sink == "live" ? SinkChoice::kLive : sink == "paced" ? SinkChoice::kPaced : SinkChoice::kAuto;
  config.device = output.text("device", "");
  config.retry_s = output.number("retry_s", config.retry_s, {0.5, 3600, "s"});
  config.layout = read_layout(output);
  config.servo_priority = output.integer("fifo_priority", config.servo_priority, {0, 99, ""});
  file.finish();
  return config;
}

}  // namespace phantom::audio_percept
