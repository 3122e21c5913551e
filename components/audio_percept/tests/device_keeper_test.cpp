#include "components/audio_percept/device_keeper.hpp"

#include <gtest/gtest.h>

#include "components/audio_percept/tests/fake_sink.hpp"
#include "components/audio_percept/tests/test_config.hpp"

namespace phantom::audio_percept {
namespace {

/// An engine and its keeper, time passing for both.
struct KeeperRig {
  FakeDevice fake;
  bool can_open = false;
  int attempts = 0;
  Inbox inbox;
  SampleRing ring{1U << 20};
  Engine engine;
  DeviceKeeper keeper;
  core::Nanoseconds now_ns = 1'000'000 * core::kNsPerMillisecond;

  explicit KeeperRig(bool from_the_start)
      : engine(test_config(), from_the_start ? std::make_unique<FakeSink>(fake) : nullptr, inbox, &ring),
        keeper(
            engine,
            [this](std::string& reason) -> std::unique_ptr<AudioSink> {
              ++attempts;
              reason = "unplugged";
              if (!can_open) return nullptr;
              fake.plugged = true;
              return std::make_unique<FakeSink>(fake);
            },
            5.0, from_the_start ? "live: fake" : PacedSink().name()) {}

  void run(double duration_s) {
    for (int i = 0; i < duration_s / kPeriod_s; ++i) {
      now_ns += 5 * core::kNsPerMillisecond;
      if (i % 2 == 0)
        inbox.percept.write(
            {{.stamp = {1, now_ns, 1}, .valid = true, .closeness = 0.5, .speed_m_s = 0.1}, now_ns});
      engine.turn(kPeriod_s, now_ns);
      if (i % 20 == 19) keeper.step(0.1);
    }
  }
  std::size_t recorded() {
    std::vector<std::int16_t> out(1U << 20);
    return ring.pop(out);
  }
};

// Tries audio_percept: no playback device
TEST(DeviceKeeper, FindsADeviceThatAppearsLater) {
  KeeperRig rig(false);
  rig.run(6.0);
  EXPECT_EQ(rig.attempts, 1) << "every five seconds, not all the time";
  EXPECT_FALSE(rig.engine.figures().live);
  EXPECT_TRUE(rig.fake.heard.empty());
  EXPECT_EQ(rig.recorded(), 6.0 * 48000) << "the sound was made all the same";
  rig.can_open = true;
  rig.run(6.0);
  EXPECT_TRUE(rig.engine.figures().live);
  EXPECT_EQ(rig.keeper.name(), "live: fake");
  EXPECT_GT(rig.fake.heard.size(), 48000U / 2);
  rig.run(20.0);
  EXPECT_EQ(rig.attempts, 2) << "what is there is not looked for";
}

// Tries audio_percept: the device goes away
TEST(DeviceKeeper, GoesOnWithoutADeviceThatGoesAndComesBackToIt) {
  KeeperRig rig(true);
  rig.run(1.0);
  EXPECT_TRUE(rig.engine.figures().live);
  const auto heard = rig.fake.heard.size();
  EXPECT_GT(heard, 40000U);
  rig.fake.plugged = false;
  rig.run(4.0);
  EXPECT_EQ(rig.fake.heard.size(), heard);
  EXPECT_TRUE(rig.engine.figures().device_lost);
  EXPECT_FALSE(rig.engine.figures().live);
  EXPECT_EQ(rig.fake.open, 0) << "what is gone is closed";
  EXPECT_EQ(rig.keeper.losses(), 1);
  EXPECT_NEAR(static_cast<double>(rig.recorded()), 5.0 * 48000, 1000.0)
      << "not a moment is missing from the recording";
  rig.can_open = true;
  rig.run(6.0);
  EXPECT_TRUE(rig.engine.figures().live);
  EXPECT_FALSE(rig.engine.figures().device_lost);
  EXPECT_GT(rig.fake.heard.size(), heard + 24000U);
}

TEST(DeviceKeeper, ADeviceThatComesAndGoesAllTheTimeLeavesNothingOpen) {
  {
    KeeperRig rig(true);
    rig.can_open = true;
    for (int i = 0; i < 8; ++i) {
      rig.run(1.0);
      rig.fake.plugged = false;
      rig.run(6.0);
      EXPECT_LE(rig.fake.open, 1);
    }
    EXPECT_EQ(rig.keeper.losses(), 8);
  }
}

TEST(DeviceKeeper, TheAudioThreadHandsDevicesOverWhileItRuns) {
  FakeDevice fake;
  Inbox inbox;
  Engine engine(test_config(), nullptr, inbox, nullptr);
  DeviceKeeper keeper(
      engine, [&](std::string&) { return std::make_unique<FakeSink>(fake); }, 0.001, "");
  engine.start();
  const auto give_up = core::monotonic_ns() + core::from_seconds(30.0);
  while (!engine.figures().live && core::monotonic_ns() < give_up) {
    keeper.step(0.001);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  engine.stop();
  EXPECT_TRUE(engine.figures().live);
  EXPECT_GT(fake.heard.size(), 0U);
}

}  // namespace
}  // namespace phantom::audio_percept
