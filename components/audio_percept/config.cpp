#include "components/audio_percept/config.hpp"

#include <algorithm>

#include "common/percept/equal_loudness.hpp"
#include "common/runtime/configuration/fields.hpp"

namespace phantom::audio_percept {
namespace {

using runtime::Fields;

/// Reads an exponent; only the power law has one.
void read_exponent(const Fields& fields, double& exponent, bool power_law) {
  fields.check(power_law || !fields.has("exponent"), "exponent",
               "does nothing: it belongs to law: power; allowed: leave it out");
  fields.number("exponent", exponent);
}

void read_pitch(const Fields& pitch, percept::ToneLaw& law) {
  using enum percept::MappingLaw;
  pitch.choice("law", law.pitch, {{"exponential", kExponential}, {"power", kPower}, {"linear", kLinear}});
  read_exponent(pitch, law.pitch_exponent, law.pitch == kPower);
  pitch.number("min_frequency_Hz", law.min_frequency_Hz);
  pitch.number("max_frequency_Hz", law.max_frequency_Hz);
  pitch.check(law.max_frequency_Hz > law.min_frequency_Hz, "max_frequency_Hz",
              "is not above min_frequency_Hz; allowed: more than that, up to 8000 Hz");
}

void read_level(const Fields& level, percept::ToneLaw& law) {
  using enum percept::MappingLaw;
  level.choice("law", law.level, {{"power", kPower}, {"exponential", kExponential}, {"linear", kLinear}});
  read_exponent(level, law.speed_exponent, law.level == kPower);
  level.number("rest_gain", law.rest_gain);
  level.number("full_gain", law.full_gain);
  level.check(law.full_gain >= law.rest_gain, "full_gain",
              "is below rest_gain; allowed: at least that, up to 1");
  level.number("full_speed_m_s", law.full_speed_m_s);
  level.number("loudness_phon", law.loudness_phon);
  level.check(law.loudness_phon <= 0.0 || law.loudness_phon >= percept::kMinPhon, "loudness_phon",
              "is outside of ISO 226; allowed: 20 to 80 phon, or 0 for no compensation");
}

void read_urgency(const Fields& urgency, percept::ToneLaw& law) {
  urgency.number("pulses_from_s", law.pulses_from_s);
  urgency.number("pulses_full_s", law.pulses_full_s);
  urgency.check(law.pulses_from_s <= 0.0 || law.pulses_full_s < law.pulses_from_s, "pulses_full_s",
                "is not below pulses_from_s; allowed: less than that");
  urgency.number("min_rate_Hz", law.min_pulse_Hz);
  urgency.number("max_rate_Hz", law.max_pulse_Hz);
  urgency.check(law.max_pulse_Hz >= law.min_pulse_Hz, "max_rate_Hz",
                "is below min_rate_Hz; allowed: at least that, up to 15 Hz");
  urgency.number("floor", law.pulse_floor);
}

void read_alarms(const Fields& alarms, AudioPerceptConfig& config) {
  AlarmRules& rules = config.alarms;
  alarms.number("gain", config.alarm_gain);
  alarms.check(config.alarm_gain + config.law.full_gain <= 1.0, "gain",
               "and level.full_gain are more than full scale together; allowed: a sum of at most 1");
  alarms.number("unsafe_motion_s", config.unsafe_alarm_ns, 1e9);
  alarms.number("medium_delay_s", rules.medium_delay_s);
  alarms.number("low_delay_s", rules.low_delay_s);
  alarms.number("high_repeat_s", rules.high_repeat_s);
  alarms.number("medium_repeat_s", rules.medium_repeat_s);
  alarms.number("prompt_bursts", rules.prompt_bursts);
  alarms.number("lasting_repeat_s", rules.lasting_repeat_s);
  alarms.check(rules.lasting_repeat_s >= std::max(rules.high_repeat_s, rules.medium_repeat_s),
               "lasting_repeat_s",
               "is below high_repeat_s or medium_repeat_s; allowed: at least these, up to 3600 s");
  alarms.number("least_silence_s", rules.least_silence_s);
  alarms.number("forget_s", rules.forget_s);
}

void read_listener(const Fields& section, ListenerConfig& listener) {
  std::vector<std::pair<const char*, std::optional<percept::ViewNode>>> views{{"main", std::nullopt}};
  for (int number = 1; number <= percept::kNodeCount; ++number) {
    const auto node = static_cast<percept::ViewNode>(number);
    views.emplace_back(percept::node_name(node), node);
  }
  section.vector3("position_m", listener.position_m);
  section.choice("view", listener.view, views);
  section.flag("follow_viewer", listener.follow_viewer);
  section.number("view_timeout_ms", listener.view_timeout_ns, 1e6);
  section.flag("follow_operator", listener.follow_operator);
  section.number("main_azimuth_deg", listener.main_azimuth_rad, core::kRadPerDegree);
  section.number("main_elevation_deg", listener.main_elevation_rad, core::kRadPerDegree);
  section.number("near_m", listener.near_m);
}

void read_output(const Fields& output, AudioPerceptConfig& config) {
  std::vector<std::pair<const char*, Layout>> layouts;
  for (const Layout layout : {Layout::kMono, Layout::kStereo, Layout::k5_1, Layout::k7_1, Layout::kHrtf})
    layouts.emplace_back(name_of(layout), layout);
  output.choice("channels", config.layout, layouts);
  using enum SinkChoice;
  output.choice("sink", config.sink, {{"auto", kAuto}, {"live", kLive}, {"paced", kPaced}});
  output.text("device", config.device);
  output.number("retry_s", config.retry_s);
  output.number("fifo_priority", config.servo_priority);
}

}  // namespace

AudioPerceptConfig load_config(const std::filesystem::path& path) {
  const runtime::Fields file(path, {kParameters});
  AudioPerceptConfig config;
  read_pitch(file.section("pitch"), config.law);
  read_level(file.section("level"), config.law);
  read_urgency(file.section("urgency"), config.law);
  file.number("smoothing_ms", config.smoothing_s, 1e-3);
  read_alarms(file.section("alarms"), config);
  const auto staleness = file.section("staleness");
  staleness.number("percept_timeout_ms", config.percept_timeout_ns, 1e6);
  staleness.number("link_timeout_ms", config.link_timeout_ns, 1e6);
  read_listener(file.section("listener"), config.listener);
  read_output(file.section("output"), config);
  file.finish();
  return config;
}

}  // namespace phantom::audio_percept
