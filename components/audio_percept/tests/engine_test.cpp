#include "components/audio_percept/engine.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <thread>
#include <vector>

#include "common/runtime/process/process.hpp"
#include "components/audio_percept/tests/test_config.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::audio_percept {
namespace {

messages::Received<messages::Percept> sensed(core::Nanoseconds at_ns) {
  return {{.stamp = {1, at_ns, 1}, .valid = true, .closeness = 0.5, .speed_m_s = 0.1}, at_ns};
}

/// A device of which the test says what it wants.
struct ScriptedDevice final : AudioSink {
  int due = 1;
  double queue_s = 0.010;
  std::vector<std::int16_t>* heard;
  explicit ScriptedDevice(std::vector<std::int16_t>* into) : heard(into) {}
  std::string name() const override { return "live: scripted"; }
  int periods_due(double) override { return due; }
  void write(std::span<const std::int16_t> period) override {
    heard->insert(heard->end(), period.begin(), period.end());
  }
  double queued_s() const override { return queue_s; }
  double device_latency_s() const override { return 0.004; }
  std::uint64_t interruptions() const override { return 3; }
  bool alive() const override { return true; }
};

TEST(Engine, WritesWhatTheDeviceWantsAndRecordsTheSame) {
  std::vector<std::int16_t> heard;
  auto device = std::make_unique<ScriptedDevice>(&heard);
  ScriptedDevice& fake = *device;
  Inbox inbox;
  SampleRing ring(48000);
  Engine engine(test_config(), std::move(device), inbox, &ring);
  core::Nanoseconds now_ns = 1000 * core::kNsPerMillisecond;
  for (int due : {3, 0, 1, 2, 0, 1}) {
    inbox.percept.write(sensed(now_ns));
    fake.due = due;
    engine.turn(kPeriod_s, now_ns += 5 * core::kNsPerMillisecond);
  }
  EXPECT_EQ(heard.size(), 7 * kPeriodFrames);
  std::vector<std::int16_t> recorded(48000);
  recorded.resize(ring.pop(recorded));
  EXPECT_EQ(recorded, heard);
  EXPECT_GT(*std::max_element(heard.begin(), heard.end()), 1000);
}

// Tries audio_percept: the disk is slow
TEST(Engine, ARecordingThatNobodyWritesCountsWhatItLosesAndTheSoundGoesOn) {
  std::vector<std::int16_t> heard;
  Inbox inbox;
  SampleRing ring(4 * kPeriodFrames);
  Engine engine(test_config(), std::make_unique<ScriptedDevice>(&heard), inbox, &ring);
  for (int i = 0; i < 100; ++i) {
    inbox.percept.write(sensed((1000 + 5 * i) * core::kNsPerMillisecond));
    engine.turn(kPeriod_s, (1001 + 5 * i) * core::kNsPerMillisecond);
  }
  EXPECT_EQ(heard.size(), 100 * kPeriodFrames);
  std::vector<std::int16_t> kept(heard.size());
  kept.resize(ring.pop(kept));
  EXPECT_EQ(ring.dropped(), heard.size() - kept.size());
  EXPECT_GT(ring.dropped(), 0U);
  EXPECT_TRUE(std::equal(kept.begin(), kept.end(), heard.begin()));
}

TEST(Engine, LatencyIsTheWaitForTheTurnTheQueueAheadAndTheDevice) {
  std::vector<std::int16_t> heard;
  Inbox inbox;
  Engine engine(test_config(), std::make_unique<ScriptedDevice>(&heard), inbox, nullptr);
  core::Nanoseconds now_ns = 1000 * core::kNsPerMillisecond;
  for (int i = 0; i < 200; ++i) {
    inbox.percept.write(sensed(now_ns));
    engine.turn(kPeriod_s, now_ns += 3 * core::kNsPerMillisecond);
  }
  const EngineFigures figures = engine.figures();
  EXPECT_EQ(figures.percepts, 200U);
  EXPECT_DOUBLE_EQ(figures.device_latency_ms, 4.0);
  EXPECT_EQ(figures.interruptions, 3U);
  EXPECT_NEAR(figures.latency_p50_ms, 17.0, 17.0 / 16.0);
  EXPECT_NEAR(figures.latency_p99_ms, 17.0, 17.0 / 16.0);
}

TEST(Engine, APerceptCountsOnce) {
  std::vector<std::int16_t> heard;
  Inbox inbox;
  Engine engine(test_config(), std::make_unique<ScriptedDevice>(&heard), inbox, nullptr);
  inbox.percept.write(sensed(1000 * core::kNsPerMillisecond));
  for (int i = 0; i < 50; ++i) engine.turn(kPeriod_s, (1001 + i) * core::kNsPerMillisecond);
  EXPECT_EQ(engine.figures().percepts, 1U);
}

TEST(Engine, LatencyCountsFromTheStamp) {
  std::vector<std::int16_t> heard;
  Inbox inbox;
  Engine engine(test_config(), std::make_unique<ScriptedDevice>(&heard), inbox, nullptr);
  core::Nanoseconds now_ns = 1000 * core::kNsPerMillisecond;
  for (int i = 0; i < 50; ++i) {
    auto sample = sensed(now_ns);
    sample.stamp.monotonic_ns -= 2 * core::kNsPerMillisecond;
    inbox.percept.write(sample);
    engine.turn(kPeriod_s, now_ns += 3 * core::kNsPerMillisecond);
  }
  EXPECT_NEAR(engine.figures().latency_p50_ms, 19.0, 19.0 / 16.0);
}

TEST(Engine, EveryLayoutIsRecordedWithAllItsChannels) {
  for (const Layout layout : {Layout::kMono, Layout::kStereo, Layout::k5_1, Layout::k7_1, Layout::kHrtf}) {
    Inbox inbox;
    SampleRing ring(1U << 19);
    Engine engine(test_config(layout), nullptr, inbox, &ring);
    for (int i = 0; i < 50; ++i) {
      inbox.percept.write(sensed((1000 + 5 * i) * core::kNsPerMillisecond));
      engine.turn(kPeriod_s, (1001 + 5 * i) * core::kNsPerMillisecond);
    }
    std::vector<std::int16_t> recorded(1U << 19);
    recorded.resize(ring.pop(recorded));
    EXPECT_EQ(recorded.size(), 50 * kPeriodFrames * channel_count(layout)) << name_of(layout);
    EXPECT_GT(*std::max_element(recorded.begin(), recorded.end()), 500) << name_of(layout);
  }
}

TEST(Engine, TellsTheDirectionThatIsHeard) {
  AudioPerceptConfig config = test_config();
  config.listener.view = percept::ViewNode::kSouth;  // x is right
  config.listener.position_m = {0, 0, 0};
  Inbox inbox;
  Engine engine(config, nullptr, inbox, nullptr);
  for (int i = 0; i < 100; ++i) {
    auto sample = sensed((1000 + 5 * i) * core::kNsPerMillisecond);
    sample.position_m = {1, 0, 1};
    inbox.percept.write(sample);
    engine.turn(kPeriod_s, (1001 + 5 * i) * core::kNsPerMillisecond);
  }
  EXPECT_NEAR(engine.figures().azimuth_deg, 90.0, 0.5);
  EXPECT_NEAR(engine.figures().elevation_deg, 45.0, 0.5);
}

TEST(Engine, ATurnUsesNoHeap) {
  Inbox inbox;
  SampleRing ring(48000);
  Engine engine(test_config(Layout::kStereo), nullptr, inbox, &ring);
  const test::HeapGuard guard("libopenal");
  for (int i = 0; i < 100; ++i) {
    inbox.percept.write(sensed((1000 + 5 * i) * core::kNsPerMillisecond));
    engine.turn(kPeriod_s, (1001 + 5 * i) * core::kNsPerMillisecond);
  }
}

// Tries audio_percept: no percept yet
// Tries audio_percept: percept stale
// Tries audio_percept: emergency stop … drives in fault
// Tries audio_percept: the device goes away
TEST(Health, SaysWhatTheOperatorMustKnow) {
  using percept::Alarm;
  EngineFigures figures;
  EXPECT_EQ(health_of(figures, {}, "x").state, core::ComponentState::kReady) << "no percept yet";
  figures.situation = Situation::kSounding;
  EXPECT_EQ(health_of(figures, {}, "x").state, core::ComponentState::kRunning);
  figures.device_lost = true;
  EXPECT_EQ(health_of(figures, {}, "x").state, core::ComponentState::kDegraded);
  EXPECT_THAT(health_of(figures, {}, "x").message, testing::HasSubstr("device"));
  figures = {.situation = Situation::kStale};
  EXPECT_EQ(health_of(figures, {}, "x").state, core::ComponentState::kDegraded);
  EXPECT_THAT(health_of(figures, {}, "x").message, testing::HasSubstr("stale"));
  for (const auto& [alarm, words] : {std::pair{Alarm::kEmergencyStop, "emergency stop"},
                                     {Alarm::kDriveFault, "drives in fault"},
                                     {Alarm::kWorkspaceStale, "model"}}) {
    figures.alarm = alarm;
    EXPECT_THAT(health_of(figures, {}, "x").message, testing::HasSubstr(words));
  }
  figures = {.situation = Situation::kSounding, .alarm = Alarm::kLinkLost};
  EXPECT_EQ(health_of(figures, {}, "x").state, core::ComponentState::kDegraded);
  EXPECT_THAT(health_of(figures, {}, "x").message, testing::HasSubstr("link"));
}

}  // namespace
}  // namespace phantom::audio_percept
