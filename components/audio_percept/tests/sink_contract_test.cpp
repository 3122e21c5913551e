// What the engine relies on, held against every device behind AudioSink: OpenAL's, played into its null
// backend, which takes sound at its pace on any machine, and the fake one of the other tests.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <thread>

#include "common/runtime/process/process.hpp"
#include "components/audio_percept/tests/fake_sink.hpp"
#include "components/audio_percept/tests/test_config.hpp"

namespace phantom::audio_percept {
namespace {

// OpenAL Soft reads this when it is first used.
[[maybe_unused]] const int g_null_device = setenv("ALSOFT_DRIVERS", "null", 1);

struct Device {
  const char* name;
  Layout layout;
  bool real;
};

class SinkContract : public testing::TestWithParam<Device> {
 protected:
  std::unique_ptr<AudioSink> open() {
    if (!GetParam().real) return std::make_unique<FakeSink>(fake_);
    std::string reason;
    auto sink = open_live_sink(test_config(GetParam().layout), reason);
    EXPECT_NE(sink, nullptr) << reason;
    return sink;
  }
  /// Waits for what must happen, the device's time passing meanwhile.
  static bool eventually(AudioSink& sink, const std::function<bool(int due)>& holds) {
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (std::chrono::steady_clock::now() < give_up) {
      if (holds(sink.periods_due(0.001))) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }
  FakeDevice fake_;
  std::vector<std::int16_t> period_ =
      std::vector<std::int16_t>(kPeriodFrames * channel_count(GetParam().layout));
};

TEST_P(SinkContract, AsksForSoundUntilItsQueueIsFullAndNoMore) {
  const auto sink = open();
  EXPECT_THAT(sink->name(), testing::StartsWith("live: "));
  EXPECT_EQ(sink->queued_s(), 0.0);
  const int queue = sink->periods_due(0.0);
  EXPECT_GE(queue, 2);
  EXPECT_LE(queue, 64);
  for (int i = 0; i < queue - 1; ++i) {
    sink->write(period_);
    EXPECT_NEAR(sink->queued_s(), (i + 1) * kPeriod_s, 1e-9);
  }
  EXPECT_EQ(sink->periods_due(0.0), 1) << "it does not play before its queue is full";
}

TEST_P(SinkContract, PlaysAtThePaceOfItsDevice) {
  const auto sink = open();
  int queue = sink->periods_due(0.0), played = -queue;
  EXPECT_TRUE(eventually(*sink, [&](int due) {
    for (; due > 0; --due, ++played) sink->write(period_);
    EXPECT_LE(sink->queued_s(), 64 * kPeriod_s + 1e-9);
    return played >= 40;
  }));
  EXPECT_TRUE(sink->alive());
}

TEST_P(SinkContract, GoesOnAfterItsQueueRanDryAndCountsThat) {
  const auto sink = open();
  for (std::uint64_t round = 0; round < 3; ++round) {
    EXPECT_EQ(sink->interruptions(), round);
    for (int i = sink->periods_due(0.0); i > 0; --i) sink->write(period_);
    EXPECT_TRUE(eventually(*sink, [&](int due) { return due > 0 && sink->queued_s() == 0.0; }))
        << "all of it is played";
  }
  EXPECT_EQ(sink->interruptions(), 3U);
}

TEST_P(SinkContract, ADeviceThatTakesNothingIsGone) {
  const auto sink = open();  // nothing is queued, so nothing can be played
  EXPECT_TRUE(sink->alive());
  sink->periods_due(3.0);
  EXPECT_FALSE(sink->alive());
}

TEST_P(SinkContract, KnowsALatencyThatCanBe) {
  const auto sink = open();
  for (int i = sink->periods_due(0.0); i > 0; --i) sink->write(period_);
  EXPECT_GE(sink->device_latency_s(), 0.0);
  EXPECT_LT(sink->device_latency_s(), 1.0);
}

INSTANTIATE_TEST_SUITE_P(
    AllDevices, SinkContract,
    testing::Values(Device{"OpenAlMono", Layout::kMono, true}, Device{"OpenAlStereo", Layout::kStereo, true},
                    Device{"OpenAlHrtf", Layout::kHrtf, true}, Device{"OpenAl51", Layout::k5_1, true},
                    Device{"OpenAl71", Layout::k7_1, true}, Device{"Fake", Layout::kStereo, false}),
    [](const auto& tested) { return tested.param.name; });

TEST(PacedSink, KeepsTheClocksPaceOverUnevenTurns) {
  PacedSink sink;
  int periods = 0;
  for (int i = 0; i < 1000; ++i) periods += sink.periods_due(i % 3 == 0 ? 0.002 : 0.005);
  EXPECT_NEAR(periods, 0.004 * 1000 / kPeriod_s, 1.0);
}

TEST(PacedSink, AStalledHostIsCaughtUpWithButNotWithoutEnd) {
  PacedSink sink;
  EXPECT_EQ(sink.periods_due(1.0), 200);
  EXPECT_EQ(sink.periods_due(3600.0), 1000);
}

// Tries audio_percept: no playback device
TEST(OpenSink, SaysWhyThereIsNoLiveOne) {
  AudioPerceptConfig config = test_config();
  config.sink = SinkChoice::kAuto;
  config.device = "no such device";
  const OpenedSink opened = open_sink(config);
  EXPECT_EQ(opened.sink, nullptr);
  EXPECT_THAT(opened.notice, testing::HasSubstr("no such device"));
  EXPECT_THAT(opened.name(), testing::HasSubstr("without a device"));
}

// Tries audio_percept: `output.sink: live`
TEST(OpenSink, ALiveOneThatIsRequiredAndMissingIsAnError) {
  AudioPerceptConfig config = test_config();
  config.sink = SinkChoice::kLive;
  config.device = "no such device";
  try {
    open_sink(config);
    FAIL();
  } catch (const runtime::MissingError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("output.sink"));
    EXPECT_THAT(error.what(), testing::HasSubstr("no such device"));
  }
}

}  // namespace
}  // namespace phantom::audio_percept
