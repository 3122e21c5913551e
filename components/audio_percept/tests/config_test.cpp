#include "components/audio_percept/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/runtime/configuration/fields.hpp"
#include "tests/support/files.hpp"

namespace phantom::audio_percept {
namespace {

using testing::HasSubstr;

const std::string kShipped = PHANTOM_SOURCE_DIR "/components/audio_percept/audio_percept.yaml";

// The shipped file with one text replaced, and what the error must say.
void expect_refused(const std::string& from, const std::string& to,
                    const std::vector<std::string>& reported) {
  try {
    load_config(test::changed(kShipped, from, to));
    FAIL() << "accepted: " << to;
  } catch (const runtime::ConfigError& error) {
    for (const auto& part : reported) EXPECT_THAT(error.what(), HasSubstr(part));
    EXPECT_THAT(error.what(), HasSubstr(".yaml:")) << "names the file and the line";
  }
}

TEST(Config, TheShippedFileIsValid) {
  const AudioPerceptConfig config = load_config(kShipped);
  EXPECT_EQ(config.law.pitch, percept::MappingLaw::kExponential);
  EXPECT_DOUBLE_EQ(config.law.min_frequency_Hz, 220.0);
  EXPECT_DOUBLE_EQ(config.smoothing_s, 0.010);
  EXPECT_EQ(config.percept_timeout_ns, 200 * core::kNsPerMillisecond);
  EXPECT_EQ(config.sink, SinkChoice::kAuto);
  EXPECT_EQ(config.layout, Layout::kStereo);
  EXPECT_FALSE(config.listener.view) << "the main view";
  EXPECT_DOUBLE_EQ(config.alarms.lasting_repeat_s, AlarmRules().lasting_repeat_s);
}

TEST(Config, RefusesAnUnknownKey) {
  expect_refused("smoothing_ms", "smoothing_s", {"smoothing_s", "unknown key", "smoothing_ms"});
}
TEST(Config, RefusesAnUnknownPitchLaw) {
  expect_refused("law: exponential", "law: cubic", {"pitch.law", "cubic", "exponential, power, linear"});
}
TEST(Config, RefusesAFrequencyOutOfRange) {
  expect_refused("max_frequency_Hz: 1760", "max_frequency_Hz: 90000",
                 {"pitch.max_frequency_Hz", "90000", "8000"});
}
TEST(Config, RefusesAReversedPitchRange) {
  expect_refused("min_frequency_Hz: 220", "min_frequency_Hz: 2000",
                 {"max_frequency_Hz", "above min_frequency_Hz"});
}
TEST(Config, RefusesSilenceAtRest) {
  expect_refused("rest_gain: 0.08", "rest_gain: 0", {"level.rest_gain", "0.001"});
}
TEST(Config, RefusesARestGainAboveTheFull) {
  expect_refused("full_gain: 0.6", "full_gain: 0.05", {"level.full_gain", "rest_gain"});
}
TEST(Config, RefusesMoreThanFullScale) {
  expect_refused("gain: 0.3", "gain: 0.5", {"alarms.gain", "full scale"});
}
TEST(Config, RefusesAZeroFullSpeed) {
  expect_refused("full_speed_m_s: 0.25", "full_speed_m_s: 0", {"level.full_speed_m_s"});
}
TEST(Config, RefusesATimeOutOfZero) {
  expect_refused("percept_timeout_ms: 200", "percept_timeout_ms: 0", {"staleness.percept_timeout_ms", "20"});
}
TEST(Config, RefusesATimeThatIsNotANumber) {
  expect_refused("link_timeout_ms: 500", "link_timeout_ms: soon", {"staleness.link_timeout_ms", "soon"});
}
TEST(Config, RefusesAnUnknownSink) {
  expect_refused("sink: auto", "sink: speaker", {"output.sink", "speaker", "auto, live, paced"});
}
TEST(Config, EveryLayoutViewAndLawCanBeChosen) {
  const auto with = [](const std::string& from, const std::string& to) {
    return load_config(test::changed(kShipped, from, to));
  };
  for (const Layout layout : {Layout::kMono, Layout::kStereo, Layout::k5_1, Layout::k7_1, Layout::kHrtf})
    EXPECT_EQ(with("channels: stereo", std::string("channels: ") + name_of(layout)).layout, layout);
  EXPECT_FALSE(with("view: main", "view: main").listener.view);
  for (int number = 1; number <= percept::kNodeCount; ++number) {
    const auto node = static_cast<percept::ViewNode>(number);
    EXPECT_EQ(with("view: main", std::string("view: ") + percept::node_name(node)).listener.view, node);
  }
  EXPECT_EQ(with("law: exponential", "law: power").law.pitch, percept::MappingLaw::kPower);
  EXPECT_EQ(with("law: exponential", "law: linear").law.pitch, percept::MappingLaw::kLinear);
  EXPECT_EQ(with("law: power               # [power, exponential", "law: power  #").law.level,
            percept::MappingLaw::kPower);
}
TEST(Config, RefusesAnExponentThatDoesNothing) {
  expect_refused("  law: power  ", "  law: linear  ", {"level.exponent", "law: power"});
}
TEST(Config, RefusesALoudnessOutsideOfTheStandard) {
  expect_refused("loudness_phon: 60", "loudness_phon: 10", {"level.loudness_phon", "20 to 80"});
}
TEST(Config, RefusesUnknownChannels) {
  expect_refused("channels: stereo", "channels: quadro", {"output.channels", "quadro", "5.1"});
}
TEST(Config, RefusesAnUnknownView) {
  expect_refused("view: main", "view: X", {"listener.view", "main, 1, 2"});
}
TEST(Config, RefusesAlarmsThatBecomeMoreFrequent) {
  expect_refused("lasting_repeat_s: 30", "lasting_repeat_s: 6",
                 {"alarms.lasting_repeat_s", "medium_repeat_s"});
}
TEST(Config, RefusesAMissingSection) {
  expect_refused("staleness:", "stale_ness:", {"staleness", "missing"});
}

}  // namespace
}  // namespace phantom::audio_percept
