#include "components/audio_percept/engine.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <thread>
#include <vector>

#include "common/runtime/process.hpp"
#include "components/audio_percept/session.hpp"
#include "tests/support/heap_guard.hpp"
#include "components/audio_percept/tests/test_config.hpp"

namespace phantom::audio_percept {
namespace {

constexpr core::Nanoseconds kMs = core::kNsPerMillisecond;

// OpenAL Soft reads this when it is first used: its null device takes sound at its pace and drops it, on any
// machine.
[[maybe_unused]] const int g_null_device = setenv("ALSOFT_DRIVERS", "null", 1);

/// A device of which the test says what it wants.
struct FakeDevice final : AudioSink {
  int due = 1;
  bool there = true;
  double queue_s = 0.010;
  std::vector<std::int16_t>* heard;
  explicit FakeDevice(std::vector<std::int16_t>* into) : heard(into) {}
  std::string name() const override { return "live: fake"; }
  int periods_due(double) override { return due; }
  void write(std::span<const std::int16_t> period) override {
    heard->insert(heard->end(), period.begin(), period.end());
  }
  double queued_s() const override { return queue_s; }
  bool alive() const override { return there; }
};

TEST(Engine, WritesWhatTheDeviceWantsAndRecordsTheSame) {
  std::vector<std::int16_t> heard;
  auto device = std::make_unique<FakeDevice>(&heard);
  FakeDevice& fake = *device;
  Inbox inbox;
  SampleRing ring(48000);
  Engine engine(test_config(), std::move(device), true, inbox, &ring);
  core::Nanoseconds now_ns = 1000 * kMs;
  for (int due : {3, 0, 1, 2, 0, 1}) {
    inbox.percept.write({now_ns, true, 0.5, 0.1});
    fake.due = due;
    engine.turn(kPeriod_s, now_ns += 5 * kMs);
  }
  EXPECT_EQ(heard.size(), 7 * kPeriodFrames);
  std::vector<std::int16_t> recorded(48000);
  recorded.resize(ring.pop(recorded));
  EXPECT_EQ(recorded, heard);
  EXPECT_GT(*std::max_element(heard.begin(), heard.end()), 1000);
}

TEST(Engine, LatencyIsTheWaitForTheTurnPlusTheQueueAhead) {
  std::vector<std::int16_t> heard;
  Inbox inbox;
  Engine engine(test_config(), std::make_unique<FakeDevice>(&heard), true, inbox, nullptr);
  core::Nanoseconds now_ns = 1000 * kMs;
  for (int i = 0; i < 200; ++i) {
    inbox.percept.write({now_ns, true, 0.5, 0.1});
    engine.turn(kPeriod_s, now_ns += 3 * kMs);
  }
  const EngineFigures figures = engine.figures();
  EXPECT_EQ(figures.percepts, 200U);
  EXPECT_NEAR(figures.latency_p50_ms, 13.0, 13.0 / 16.0);
  EXPECT_NEAR(figures.latency_p99_ms, 13.0, 13.0 / 16.0);
}

TEST(Engine, APerceptCountsOnce) {
  std::vector<std::int16_t> heard;
  Inbox inbox;
  Engine engine(test_config(), std::make_unique<FakeDevice>(&heard), true, inbox, nullptr);
  inbox.percept.write({1000 * kMs, true, 0.5, 0.1});
  for (int i = 0; i < 50; ++i) engine.turn(kPeriod_s, (1001 + i) * kMs);
  EXPECT_EQ(engine.figures().percepts, 1U);
}

TEST(Engine, GoesOnWithoutTheDeviceThatWentAway) {
  std::vector<std::int16_t> heard;
  auto device = std::make_unique<FakeDevice>(&heard);
  FakeDevice& fake = *device;
  Inbox inbox;
  SampleRing ring(480000);
  Engine engine(test_config(), std::move(device), true, inbox, &ring);
  for (int i = 0; i < 10; ++i) engine.turn(kPeriod_s, (1000 + 5 * i) * kMs);
  fake.there = false;
  for (int i = 0; i < 90; ++i) engine.turn(kPeriod_s, (1050 + 5 * i) * kMs);
  EXPECT_EQ(heard.size(), 10 * kPeriodFrames);
  std::vector<std::int16_t> recorded(480000);
  EXPECT_EQ(ring.pop(recorded), 100 * kPeriodFrames);
  EXPECT_TRUE(engine.figures().sink_lost);
}

TEST(Engine, ATurnUsesNoHeap) {
  Inbox inbox;
  SampleRing ring(48000);
  Engine engine(test_config(), std::make_unique<PacedSink>(), false, inbox, &ring);
  const test::HeapGuard guard;
  for (int i = 0; i < 100; ++i) {
    inbox.percept.write({(1000 + 5 * i) * kMs, true, 0.5, 0.1});
    engine.turn(kPeriod_s, (1001 + 5 * i) * kMs);
  }
}

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

TEST(OpenSink, SaysWhyThereIsNoLiveOne) {
  AudioPerceptConfig config = test_config();
  config.sink = SinkChoice::kAuto;
  config.device = "no such device";
  const OpenedSink opened = open_sink(config);
  EXPECT_FALSE(opened.live);
  EXPECT_THAT(opened.notice, testing::HasSubstr("no such device"));
}

TEST(LiveSink, AsksForSoundUntilItsQueueIsFullAndAgainAsItPlays) {
  std::string reason;
  const auto sink = open_live_sink("", reason);
  ASSERT_NE(sink, nullptr) << reason;
  EXPECT_THAT(sink->name(), testing::StartsWith("live: "));
  const std::vector<std::int16_t> period(kPeriodFrames);
  const int queue = sink->periods_due(0.0);
  EXPECT_GE(queue, 3);
  for (int i = 0; i < queue; ++i) sink->write(period);
  EXPECT_NEAR(sink->queued_s(), queue * kPeriod_s, 1e-9);
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  int played = 0;
  while (played < 40 && std::chrono::steady_clock::now() < give_up) {
    for (int due = sink->periods_due(0.001); due > 0; --due, ++played) sink->write(period);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_GE(played, 40);
  EXPECT_TRUE(sink->alive());
}

TEST(LiveSink, ADeviceThatTakesNothingIsGone) {
  std::string reason;
  const auto sink = open_live_sink("", reason);  // nothing is queued, so nothing can be played
  ASSERT_NE(sink, nullptr) << reason;
  sink->periods_due(3.0);
  EXPECT_FALSE(sink->alive());
}

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

TEST(Health, SaysWhatTheOperatorMustKnow) {
  EngineFigures figures;
  EXPECT_EQ(health_of(figures, {}, "x").state, core::ComponentState::kReady);
  figures.situation = Situation::kSounding;
  EXPECT_EQ(health_of(figures, {}, "x").state, core::ComponentState::kRunning);
  figures.sink_lost = true;
  EXPECT_EQ(health_of(figures, {}, "x").state, core::ComponentState::kDegraded);
  figures.situation = Situation::kStale;
  EXPECT_THAT(health_of(figures, {}, "x").message, testing::HasSubstr("stale"));
  figures.alarm = percept::Alarm::kStopped;
  EXPECT_THAT(health_of(figures, {}, "x").message, testing::HasSubstr("emergency stop"));
  figures.drive_fault = true;
  EXPECT_THAT(health_of(figures, {}, "x").message, testing::HasSubstr("drives in fault"));
}

}  // namespace
}  // namespace phantom::audio_percept
