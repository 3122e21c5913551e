#include "components/audio_percept/render.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "common/core/errors.hpp"
#include "common/dds/endpoints/cdr.hpp"
#include "common/dds/endpoints/topics.hpp"
#include "common/recording/byte_sink.hpp"
#include "common/recording/mcap_writer.hpp"
#include "components/audio_percept/spectrogram.hpp"
#include "components/audio_percept/tests/test_config.hpp"
#include "phantom_idl/percept.hpp"

namespace phantom::audio_percept::render_test {
namespace {

using testing::HasSubstr;

std::filesystem::path temporary(const std::string& name) {
  return std::filesystem::temp_directory_path() / ("render_test_" + std::to_string(getpid()) + "_" + name);
}

Track track_of(const std::string& csv) {
  std::istringstream text(csv);
  return read_track_csv(text, "t.csv");
}

std::vector<Inputs> entries_of(const Track& track) {
  std::vector<Inputs> entries;
  for (Inputs inputs; track(inputs);) entries.push_back(inputs);
  return entries;
}

void expect_refused(const std::string& csv, const std::vector<std::string>& reported) {
  try {
    track_of(csv);
    FAIL() << "accepted: " << csv;
  } catch (const core::ConfigError& error) {
    for (const auto& part : reported) EXPECT_THAT(error.what(), HasSubstr(part));
  }
}

/// Times of the CSV's rows every 10 ms.
std::string approach(int rows) {
  std::ostringstream csv;
  csv << "t,closeness,speed_m_s,x_m,y_m,z_m\n";
  for (int i = 0; i < rows; ++i)
    csv << 0.01 * i << ',' << std::min(1.0, 0.2 + 0.5 * i / rows) << ",0.1," << -1.0 + 2.0 * i / rows
        << ",0.4,0.8\n";
  return csv.str();
}

double level(const std::vector<std::int16_t>& samples, std::size_t from, std::size_t to, std::size_t channels,
             std::size_t channel) {
  double sum = 0.0;
  for (std::size_t i = from; i < to; ++i) sum += std::pow(samples[i * channels + channel] / 32768.0, 2);
  return std::sqrt(sum / static_cast<double>(to - from));
}

TEST(TrackCsv, ReadsEveryColumnInAnyOrder) {
  const std::vector<Inputs> track = entries_of(
      track_of("speed_m_s, t, closeness, z_m, valid, link, muted, alert\n0.1, 0.5, 0.25, 2, 1, 0, 0, "
               "0\n\n0.2,1.5,0.75,3,0,3,1,1\r\n"));
  ASSERT_EQ(track.size(), 2U);
  EXPECT_DOUBLE_EQ(track[0].percept.closeness, 0.25);
  EXPECT_DOUBLE_EQ(track[0].percept.speed_m_s, 0.1);
  EXPECT_EQ(track[0].percept.position_m, (Vector3{0, 0, 2}));
  EXPECT_TRUE(track[0].percept.valid);
  EXPECT_EQ(track[0].slave.state, teleop::LinkState::kCoupled);
  EXPECT_EQ(track[1].now_ns - track[0].now_ns, core::kNsPerSecond);
  EXPECT_FALSE(track[1].percept.valid);
  EXPECT_GT(track[1].percept.muted_sensors, 0U);
  EXPECT_EQ(track[1].slave.state, teleop::LinkState::kStopped);
  EXPECT_EQ(track[1].slave.stop.cause, teleop::StopCause::kDriveFault);
  EXPECT_EQ(track[1].alerts.active, 1U);
  EXPECT_EQ(track[1].alerts.raised_ns, track[1].now_ns);
  EXPECT_TRUE(track[0].percept.threats.empty());
  const std::vector<Inputs> threats =
      entries_of(track_of("t,closeness,speed_m_s,contact_s\n0,0.2,0.1,-1\n1,0.2,0.1,0.8\n"));
  EXPECT_TRUE(threats.at(0).percept.threats.empty());
  EXPECT_DOUBLE_EQ(threats.at(1).percept.threats[0].contact.time_s, 0.8);
}

TEST(TrackCsv, NamesPlaceValueAndWhatIsAllowed) {
  expect_refused("", {"t.csv:1", "empty"});
  expect_refused("t,closeness\n0,0\n", {"t.csv:1", "'speed_m_s' is missing"});
  expect_refused("t,closeness,speed_m_s,mu\n", {"t.csv:1", "'mu' is unknown", "allowed"});
  expect_refused("t,closeness,speed_m_s,t\n", {"'t' stands twice"});
  expect_refused("t,closeness,speed_m_s\n", {"no rows"});
  expect_refused("t,closeness,speed_m_s\n0,0.5\n", {"t.csv:2", "2 values", "3"});
  expect_refused("t,closeness,speed_m_s\n0,1.5,0\n", {"t.csv:2", "closeness", "'1.5'", "0 to 1"});
  expect_refused("t,closeness,speed_m_s\n0,0.5,fast\n", {"speed_m_s", "'fast'"});
  expect_refused("t,closeness,speed_m_s\n0,nan,0\n", {"closeness", "'nan'"});
  expect_refused("t,closeness,speed_m_s\n0,0.5,0.1x\n", {"'0.1x'"});
  expect_refused("t,closeness,speed_m_s\n1,0,0\n0.5,0,0\n", {"t.csv:3", "0.5", "not later"});
}

TEST(Render, AnApproachFromLeftToRightIsHeardSo) {
  const auto samples = render_track(
      track_of(approach(200)),
      [] {
        AudioPerceptConfig config = test_config(Layout::kStereo);
        config.listener.view = percept::ViewNode::kSouth;  // x is right
        return config;
      }(),
      0.0);
  const std::size_t frames = samples.size() / 2;
  EXPECT_NEAR(static_cast<double>(frames), 1.99 * 48000, 480);
  EXPECT_GT(level(samples, 4800, 14400, 2, 0), 1.5 * level(samples, 4800, 14400, 2, 1));
  EXPECT_GT(level(samples, frames - 9600, frames, 2, 1), 1.5 * level(samples, frames - 9600, frames, 2, 0));
}

TEST(Render, RowsThatStopEndInSilence) {
  AudioPerceptConfig config = test_config();
  const auto samples = render_track(track_of(approach(100)), config, 3.0);
  EXPECT_GT(level(samples, 24000, 48000, 1, 0), 0.01);
  EXPECT_EQ(level(samples, samples.size() - 24000, samples.size(), 1, 0), 0.0);
}

TEST(Render, WritesWavAndSpectrogramOfEveryLayout) {
  const auto csv = temporary("approach.csv"), wav = temporary("a.wav"), png = temporary("a.png");
  std::ofstream(csv) << approach(50);
  for (const char* channels : {"mono", "stereo", "5.1", "7.1", "hrtf"}) {
    EXPECT_EQ(run_render({csv, wav, png, channels}, test_config()), 0) << channels;
    EXPECT_GT(std::filesystem::file_size(wav), 20000U);
    EXPECT_GT(std::filesystem::file_size(png), 5000U);
    std::filesystem::remove(wav);
    std::filesystem::remove(png);
  }
  std::filesystem::remove(csv);
}

TEST(Render, ARecordingSoundsAsItsPercepts) {
  const auto file = temporary("approach.mcap");
  {
    auto sink = recording::FileSink::create(file);
    ASSERT_TRUE(sink) << sink.status().message();
    recording::McapWriter writer(**sink, {});
    recording::Channel channel;
    channel.topic = "percept";
    channel.message_encoding = "cdr";
    const auto percepts = writer.add_channel(channel);
    channel.topic = "something_else";
    const auto others = writer.add_channel(channel);
    ASSERT_TRUE(percepts && others);
    const dds::CdrCodec codec(dds::kPercept);
    for (std::uint64_t i = 1; i <= 100; ++i) {
      msg::Percept percept;
      percept.stamp().sequence_number(i);
      percept.stamp().session(1);
      percept.valid(true);
      percept.joint_count(6);
      percept.closeness(0.5);
      percept.speed_m_s(i == 50 ? std::nan("") : 0.1);  // one that is refused, as when it comes live
      percept.position_m().x(1.0);
      std::vector<std::uint8_t> bytes;
      ASSERT_TRUE(codec.encode(&percept, bytes));
      recording::Message message;
      message.log_time_ns = 1'700'000'000'000'000'000ULL + i * 10'000'000ULL;
      message.data = bytes;
      message.channel_id = *percepts;
      ASSERT_TRUE(writer.write(message));
      message.channel_id = *others;
      ASSERT_TRUE(writer.write(message));
    }
    ASSERT_TRUE(writer.finish());
  }
  const std::vector<Inputs> track = entries_of(read_track(file));
  ASSERT_EQ(track.size(), 100U);
  EXPECT_DOUBLE_EQ(track.back().percept.closeness, 0.5);
  EXPECT_EQ(track.back().percept.position_m, (Vector3{1, 0, 0}));
  EXPECT_EQ(track[49].percept.received_ns, track[48].percept.received_ns);
  const auto samples = render_track(read_track(file), test_config(), 0.0);
  std::filesystem::remove(file);
  EXPECT_GT(level(samples, 24000, 40000, 1, 0), 0.01);
}

TEST(Render, NamesWhatIsMissing) {
  EXPECT_THROW(run_render({"/nowhere/a.csv", "/tmp/x.wav", "", ""}, test_config()), core::MissingError);
  EXPECT_THROW(run_render({"/nowhere/a.mcap", "/tmp/x.wav", "", ""}, test_config()), core::MissingError);
  const auto garbage = temporary("garbage.mcap");
  std::ofstream(garbage) << "this is no recording";
  EXPECT_THROW(run_render({garbage, "/tmp/x.wav", "", ""}, test_config()), core::ConfigError);
  std::filesystem::remove(garbage);
  EXPECT_THROW(draw_spectrogram(std::vector<std::int16_t>(9600), Layout::kMono, "/nowhere/a.png"),
               std::runtime_error);
}

TEST(Spectrogram, IsRefusedUnderAnotherEnding) {
  const auto other = temporary("short.txt");
  EXPECT_THROW(draw_spectrogram(std::vector<std::int16_t>(480, 1000), Layout::kMono, other),
               std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(other));
}

TEST(Spectrogram, AShortSoundHasOneToo) {
  const auto png = temporary("short.png");
  draw_spectrogram(std::vector<std::int16_t>(480, 1000), Layout::kMono, png);
  EXPECT_GT(std::filesystem::file_size(png), 1000U);
  std::filesystem::remove(png);
}

}  // namespace
}  // namespace phantom::audio_percept::render_test
