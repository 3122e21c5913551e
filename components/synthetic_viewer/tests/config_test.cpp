#include "components/synthetic_viewer/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "common/core/errors.hpp"
#include "common/web/tests/certificate.hpp"
#include "tests/support/files.hpp"

namespace phantom::synthetic_viewer {
namespace {

using ::testing::HasSubstr;

std::string refusal(const std::string& yaml) {
  try {
    load_config(test::new_file(yaml));
  } catch (const std::runtime_error& problem) {
    return problem.what();
  }
  return "accepted";
}

const std::string kShipped = PHANTOM_SOURCE_DIR "/components/synthetic_viewer/synthetic_viewer.yaml";

TEST(Config, TheShippedFileIsValidAndHoldsTheDefaults) {
  const ViewerConfig shipped = load_config(kShipped), empty = load_config(test::new_file("{}"));
  for (const auto* config : {&shipped, &empty}) {
    EXPECT_EQ(config->frame_rate_hz, 10);
    EXPECT_EQ(config->niceness, 10);
    EXPECT_EQ(config->main_view.format.width_px, 1280);
    EXPECT_EQ(config->hit_view.format.height_px, 360);
    EXPECT_EQ(config->page.address, "127.0.0.1");
    EXPECT_EQ(config->page.port, 8080);
    EXPECT_EQ(config->page.stream_port, 0);
    EXPECT_TRUE(config->page.allow_commands);
    EXPECT_FALSE(config->page.headset_hand);
    EXPECT_TRUE(config->tool_view.enabled);
    EXPECT_FALSE(config->window.wanted);
    EXPECT_EQ(config->recording.rate_hz, 10);
    EXPECT_FALSE(config->recording.at_start);
  }
  EXPECT_EQ(shipped.main_view.azimuth_rad, empty.main_view.azimuth_rad);
  EXPECT_EQ(shipped.main_view.elevation_rad, empty.main_view.elevation_rad);
  EXPECT_EQ(shipped.main_view.field_of_view_rad, empty.main_view.field_of_view_rad);
  EXPECT_EQ(shipped.main_view.margin, empty.main_view.margin);
  EXPECT_EQ(shipped.hit_view.rule.choice.distance_m, empty.hit_view.rule.choice.distance_m);
  EXPECT_EQ(shipped.hit_view.rule.choice.margin, empty.hit_view.rule.choice.margin);
  EXPECT_EQ(shipped.hit_view.rule.hold_after_clear_s, empty.hit_view.rule.hold_after_clear_s);
  EXPECT_EQ(shipped.tool_view.eye_m, empty.tool_view.eye_m);
  EXPECT_EQ(shipped.pgv_arrow.length, empty.pgv_arrow.length);
  EXPECT_EQ(shipped.pgv_arrow.half_strength_Pa_s_per_m, empty.pgv_arrow.half_strength_Pa_s_per_m);
  EXPECT_EQ(shipped.staleness.slave_s, empty.staleness.slave_s);
  EXPECT_EQ(shipped.report_pictures, empty.report_pictures);
}

TEST(Config, AHeadsetsControllerLeadsWhereThatIsSaidAndThePageMayCommand) {
  const ViewerConfig headset = load_config(PHANTOM_SOURCE_DIR "/deploy/cartesian/headset_viewer.yaml");
  EXPECT_TRUE(headset.page.headset_hand);
  EXPECT_EQ(headset.page.hand_silent_s, 0.1);
  EXPECT_THAT(refusal("page: {headset_hand: true, allow_commands: false}"), HasSubstr("headset_hand"));
  EXPECT_THAT(refusal("page: {hand_silent_s: 0.3}"), HasSubstr("hand_silent_s"));
}

TEST(Config, PicturesAreWrittenInOneOfTheLanguages) {
  EXPECT_EQ(load_config(kShipped).language, Language::kEnglish);
  EXPECT_EQ(load_config(test::new_file("language: de")).language, Language::kGerman);
  EXPECT_THAT(refusal("language: fr"),
              testing::AllOf(HasSubstr("language"), HasSubstr("en"), HasSubstr("de")));
}

TEST(Config, PicturesMustNotShareThePortOfTheStop) {
  EXPECT_THAT(refusal("page: {port: 8080, stream_port: 8080}"), HasSubstr("stream_port"));
  EXPECT_EQ(refusal("page: {port: 8080, stream_port: 8081}"), "accepted");
  EXPECT_EQ(refusal("page: {port: 0, stream_port: 0}"), "accepted");
}

TEST(Config, ANetworkIsServedWithSecretsOnly) {
  EXPECT_THAT(refusal("page: {address: 0.0.0.0}"), HasSubstr("page.secrets"));
  EXPECT_THAT(refusal("page: {address: 127.attacker.example}"), HasSubstr("page.secrets"));
  EXPECT_EQ(refusal("page: {address: 127.0.0.2}"), "accepted");
  EXPECT_EQ(refusal("page: {address: '::1'}"), "accepted");
  const std::filesystem::path folder = test::new_file("").string() + ".secrets";
  EXPECT_THAT(refusal("page: {secrets: " + folder.string() + "}"), HasSubstr("watch: cannot be read"));
  runtime::make_role_secrets(folder);
  EXPECT_EQ(refusal("page: {address: 0.0.0.0, secrets: " + folder.string() + "}"), "accepted");
}

TEST(Config, AMissingFileIsNamed) {
  try {
    load_config("/nowhere/viewer.yaml");
    FAIL();
  } catch (const std::exception& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("/nowhere/viewer.yaml"));
  }
}

struct Fault {
  const char* name;
  const char* yaml;
  const char* key;
  const char* allowed;
};

class Faults : public ::testing::TestWithParam<Fault> {};

// Tries synthetic_viewer: unknown key; value out of range
TEST_P(Faults, AreRefusedWithFileKeyAndWhatIsAllowed) {
  const std::string message = refusal(GetParam().yaml);
  EXPECT_THAT(message, HasSubstr(".yaml:"));
  EXPECT_THAT(message, HasSubstr(GetParam().key));
  EXPECT_THAT(message, HasSubstr(GetParam().allowed));
}

INSTANTIATE_TEST_SUITE_P(
    Config, Faults,
    ::testing::Values(
        Fault{"unknown_key", "frame_rate: 10", "frame_rate", "frame_rate_hz"},
        Fault{"graphics", "graphics: vulkan", "graphics", "surfaceless"},
        Fault{"frame_rate", "frame_rate_hz: 0", "frame_rate_hz", "120"},
        Fault{"niceness", "niceness: -5", "niceness", "19"},
        Fault{"jpeg_quality", "jpeg_quality: 101", "jpeg_quality", "100"},
        Fault{"width", "main_view: {width_px: 8}", "width_px", "3840"},
        Fault{"height", "hit_view: {height_px: 9000}", "height_px", "2160"},
        Fault{"samples", "main_view: {samples: 16}", "samples", "8"},
        Fault{"elevation", "main_view: {elevation_deg: 95}", "elevation_deg", "89"},
        Fault{"field_of_view", "hit_view: {field_of_view_deg: 170}", "field_of_view_deg", "120"},
        Fault{"distance", "hit_view: {distance_m: 0}", "distance_m", "10"},
        Fault{"hold", "hit_view: {hold_after_clear_s: -1}", "hold_after_clear_s", "600"},
        Fault{"tool_view", "tool_view: {eye_m: [0, 0, 0], look_at_m: [0, 0, 0]}", "look_at_m", "eye_m"},
        Fault{"staleness", "staleness: {slave_s: 0}", "slave_s", "60"},
        Fault{"port", "page: {port: 70000}", "port", "65535"},
        Fault{"streams", "page: {max_streams: 1}", "max_streams", "200"},
        Fault{"host_names", "page: {host_names: ['viewer.example:8080']}", "host_names", "without port"},
        Fault{"host_address", "page: {host_names: [0177.0.0.1]}", "host_names", "without port"},
        Fault{"window", "window: 3", "window", "true"},
        Fault{"recording_format", "recording: {format: gif}", "format", "mp4"},
        Fault{"recording_rate", "recording: {rate_hz: 0}", "rate_hz", "60"},
        Fault{"recording_view", "recording: {at_start: side}", "at_start", "tool"},
        Fault{"flag", "page: {allow_commands: perhaps}", "allow_commands", "true"},
        Fault{"not_a_number", "frame_rate_hz: fast", "frame_rate_hz", "number"}),
    [](const auto& fault) { return std::string(fault.param.name); });

TEST(PageCertificate, AndItsKeyAreConfiguredTogether) {
  const web::test::Certificate own;
  const auto refusal_of = [](const std::string& page) {
    try {
      return std::string(load_config(test::new_file("page: {" + page + "}")).page.tls ? "TLS" : "no TLS");
    } catch (const std::runtime_error& problem) {
      return std::string(problem.what());
    }
  };
  const std::string certificate = "certificate: " + own.certificate.string(),
                    key = "key: " + own.key.string();
  EXPECT_EQ(refusal_of(""), "no TLS");
  EXPECT_EQ(refusal_of(certificate + ", " + key), "TLS");
  EXPECT_THAT(refusal_of(certificate), AllOf(HasSubstr(".yaml:"), HasSubstr("page.key")));
  EXPECT_THAT(refusal_of(key), AllOf(HasSubstr(".yaml:"), HasSubstr("page.certificate")));
  EXPECT_THAT(refusal_of("certificate: nowhere.pem, " + key), HasSubstr("nowhere.pem: cannot be read"));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
