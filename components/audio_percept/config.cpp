#include "components/audio_percept/config.hpp"

#include "common/runtime/config_reader.hpp"

namespace phantom::audio_percept {
namespace {

percept::ToneLaw read_law(const runtime::ConfigReader& file) {
  percept::ToneLaw law;
  const auto pitch = file.section("pitch");
  law.pitch = pitch.choice("law", "exponential", {"exponential", "linear"}) == "linear"
                  ? percept::PitchLaw::kLinear
                  : percept::PitchLaw::kExponential;
  law.min_frequency_Hz = pitch.number("min_frequency_Hz", {20, 8000, "Hz"});
  law.max_frequency_Hz = pitch.number("max_frequency_Hz", {20, 8000, "Hz"});
  if (law.max_frequency_Hz <= law.min_frequency_Hz) {
    throw pitch.error("max_frequency_Hz",
                      "is not above min_frequency_Hz; allowed: more than that, up to 8000 Hz");
  }
  const auto level = file.section("level");
  law.rest_gain = level.number("rest_gain", {0.001, 1, ""});
  law.full_gain = level.number("full_gain", {0.001, 1, ""});
  if (law.full_gain < law.rest_gain)
    throw level.error("full_gain", "is below rest_gain; allowed: at least that, up to 1");
  law.full_speed_m_s = level.number("full_speed_m_s", {0.001, 100, "m/s"});
  law.speed_exponent = level.number("speed_exponent", law.speed_exponent, {0.1, 4, ""});
  law.equal_loudness = level.flag("equal_loudness", law.equal_loudness);
  return law;
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
  config.unsafe_alarm_ns = core::from_seconds(alarms.number("unsafe_motion_s", {0.1, 3600, "s"}));
  const auto staleness = file.section("staleness");
  config.percept_timeout_ns = milliseconds(staleness, "percept_timeout_ms");
  config.link_timeout_ns = milliseconds(staleness, "link_timeout_ms");
  const auto output = file.optional_section("output");
  const std::string sink = output.choice("sink", "auto", {"auto", "live", "paced"});
  config.sink = sink == "live" ? SinkChoice::kLive : sink == "paced" ? SinkChoice::kPaced : SinkChoice::kAuto;
  config.device = output.text("device", "");
  file.finish();
  return config;
}

}  // namespace phantom::audio_percept
