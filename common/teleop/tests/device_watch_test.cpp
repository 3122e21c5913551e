#include "common/teleop/coupling/device_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <string>

#include "common/teleop/guards/stability_guard.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace {

constexpr core::Nanoseconds kMs = 1'000'000;
constexpr double kWatchTick_s = 0.001;
const DeviceWatchParameters kParameters{.staleness_s = 0.02, .round_trip_limit_s = 0.03, .loop_s = 0.002};

/// A device that answers in 2 ms, seen at every tick.
struct WatchRig {
  DeviceWatch watch{kParameters};
  DeviceReading reading{.session = 7, .ready = true};
  DeviceVerdict last;
  core::Nanoseconds now_ns = 1000 * kMs;
  core::Nanoseconds loop_ns = 2 * kMs;
  bool heard = true;

  const DeviceVerdict& tick(int count = 1) {
    for (int i = 0; i < count; ++i) {
      now_ns += kMs;
      if (heard) {
        reading.received_ns = reading.measured_ns = now_ns;
        reading.answers_ns = now_ns - loop_ns;
        for (std::size_t k = 0; k < 3; ++k)
          reading.handle.position_m[k] += kWatchTick_s * reading.handle.velocity_m_s[k];
      }
      const test::HeapGuard guard;
      last = watch.step(reading, now_ns, kWatchTick_s);
    }
    return last;
  }
  WatchRig() {
    tick(2);
    reading.clutch = true;
    tick();
  }
};

TEST(DeviceWatch, ADeviceIsTakenOnceItsClutchWasSeenOut) {
  WatchRig rig;
  EXPECT_EQ(rig.last.trouble, DeviceTrouble::kNone);
  EXPECT_TRUE(rig.last.hand.valid && rig.last.hand.clutch);
  EXPECT_EQ(rig.last.longer_s, 0.0);

  WatchRig held;
  held.watch = DeviceWatch(kParameters);
  EXPECT_EQ(held.tick(500).trouble, DeviceTrouble::kClutchIn) << "held closed from the start";
  EXPECT_FALSE(held.last.hand.valid);
  held.reading.clutch = false;
  EXPECT_EQ(held.tick().trouble, DeviceTrouble::kNone);
}

TEST(DeviceWatch, SilenceIsSeenWithinATickOfTheStalenessAndTheClutchMustBeLetOutAfterIt) {
  WatchRig rig;
  rig.heard = false;
  EXPECT_EQ(rig.tick(20).trouble, DeviceTrouble::kNone);
  EXPECT_EQ(rig.tick(1).trouble, DeviceTrouble::kSilent);
  EXPECT_FALSE(rig.last.hand.valid);
  EXPECT_EQ(rig.last.hand.twist.norm(), 0.0);
  rig.tick(3000);
  rig.heard = true;
  EXPECT_EQ(rig.tick(100).trouble, DeviceTrouble::kClutchIn);
  rig.reading.clutch = false;
  EXPECT_EQ(rig.tick().trouble, DeviceTrouble::kNone);
  EXPECT_LE(rig.last.longer_s, kParameters.round_trip_limit_s) << "a silence of 3 s is no loop of 3 s";
  rig.reading.clutch = true;
  EXPECT_EQ(rig.tick().trouble, DeviceTrouble::kNone);
  rig.tick(300);
  EXPECT_EQ(rig.last.longer_s, 0.0) << "it is forgotten";
}

TEST(DeviceWatch, ADeviceThatIsNotReadyOrDoesNotAnswerIsNotTaken) {
  WatchRig rig;
  rig.reading.ready = false;
  EXPECT_EQ(rig.tick().trouble, DeviceTrouble::kNotReady);
  rig.reading.ready = true;
  rig.reading.clutch = false;
  EXPECT_EQ(rig.tick().trouble, DeviceTrouble::kNone);
  rig.now_ns += kMs;
  rig.reading.received_ns = rig.reading.measured_ns = rig.now_ns;
  rig.reading.answers_ns = 0;
  EXPECT_EQ(rig.watch.step(rig.reading, rig.now_ns, kWatchTick_s).trouble, DeviceTrouble::kUnanswered);
}

TEST(DeviceWatch, TheLoopIsAsLongAsTheActingWrenchIsOldAndTooLongIsALoss) {
  WatchRig rig;
  rig.loop_ns = 8 * kMs;
  EXPECT_NEAR(rig.tick().longer_s, 0.006, 1e-9) << "at once";
  rig.loop_ns = 2 * kMs;
  EXPECT_NEAR(rig.tick(10).longer_s, 0.005, 1e-9) << "forgotten at 0.1 s per second";
  EXPECT_EQ(rig.tick(60).longer_s, 0.0);
  rig.loop_ns = 31 * kMs;  // its states go on coming: what they answer is too old
  EXPECT_EQ(rig.tick().trouble, DeviceTrouble::kLate);
  rig.loop_ns = 2 * kMs;
  rig.reading.clutch = false;
  EXPECT_EQ(rig.tick().trouble, DeviceTrouble::kNone);
}

TEST(DeviceWatch, ADeviceThatStopsTakingWrenchesIsLateThoughItsStatesCome) {
  WatchRig rig;
  const core::Nanoseconds answered_ns = rig.reading.answers_ns;
  int ticks = 0;
  for (; rig.last.trouble == DeviceTrouble::kNone && ticks < 100; ++ticks) {
    rig.loop_ns = rig.now_ns + kMs - answered_ns;
    rig.tick();
  }
  EXPECT_EQ(rig.last.trouble, DeviceTrouble::kLate);
  EXPECT_LE(ticks, 30);
}

TEST(DeviceWatch, APoseThatJumpsIsNotFollowed) {
  using Change = std::function<void(HandleMotion&)>;
  const Change jumps[] = {
      [](HandleMotion& h) { h.position_m[1] += 0.006; }, [](HandleMotion& h) { h.position_m[0] -= 2.0; },
      [](HandleMotion& h) { h.position_m[2] = std::nan(""); },
      [](HandleMotion& h) {
        Eigen::Map<Eigen::Matrix3d>(h.R_DH.data()) = geometry::rotation_from_rpy(0.06, 0, 0);
      }};
  for (const Change& jump : jumps) {
    WatchRig rig;
    rig.reading.handle.velocity_m_s = {0.5, 0, 0};
    rig.tick(50);
    ASSERT_EQ(rig.last.trouble, DeviceTrouble::kNone);
    jump(rig.reading.handle);
    EXPECT_EQ(rig.tick().trouble, DeviceTrouble::kJumped);
    EXPECT_FALSE(rig.last.hand.valid);
    if (std::isnan(rig.reading.handle.position_m[2])) continue;  // the codec refuses it anyway
    EXPECT_EQ(rig.tick(1000).trouble, DeviceTrouble::kJumped) << "with the clutch in";
    rig.reading.clutch = false;
    EXPECT_EQ(rig.tick().trouble, DeviceTrouble::kNone);
  }
}

TEST(DeviceWatch, AHandsOwnMotionIsNoJump) {
  WatchRig rig;
  double t = 0.0;
  const auto place = [&] {
    for (std::size_t k = 0; k < 3; ++k) {  // 5 Hz, ± 5 cm: 1.6 m/s, 49 m/s²
      rig.reading.handle.velocity_m_s[k] =
          0.05 * 31.4 * std::cos(31.4 * (t - 0.004));  // behind a filter of 4 ms
      rig.reading.handle.position_m[k] =
          0.05 * std::sin(31.4 * t) - kWatchTick_s * rig.reading.handle.velocity_m_s[k];
    }
    t += kWatchTick_s;
  };
  rig.watch = DeviceWatch(kParameters);
  rig.reading.clutch = false;
  for (int i = 0; i < 2000; ++i) {
    place();
    rig.tick();
    ASSERT_EQ(rig.last.trouble, DeviceTrouble::kNone) << "at " << t;
    if (i % 100 != 99) continue;
    rig.heard = false;  // 15 samples are lost
    for (int lost = 0; lost < 15; ++lost) {
      rig.tick();
      t += kWatchTick_s;
    }
    rig.heard = true;
  }
}

TEST(DeviceWatch, AnotherProcessInItsPlaceIsALossToo) {
  WatchRig rig;
  rig.reading.session = 8;
  EXPECT_EQ(rig.tick().trouble, DeviceTrouble::kRestarted);
  rig.reading.clutch = false;
  EXPECT_EQ(rig.tick().trouble, DeviceTrouble::kNone);
}

TEST(DeviceWatch, EveryTroubleHasItsSentence) {
  EXPECT_STREQ(sentence(DeviceTrouble::kNone), "");
  for (int i = 1; i <= static_cast<int>(DeviceTrouble::kClutchIn); ++i)
    EXPECT_GT(std::string(sentence(static_cast<DeviceTrouble>(i))).size(), 20U) << i;
}

/// Length, in s of swinging, of a mass that a damping B brakes through a loop: the device samples every
/// `device_s` and holds, the servo ticks every T, and each way takes `way_s`. Returns the size of the
/// velocity after 2 s, from 1.
double velocity_after(double damping, double mass, double device_s, double way_s, double& loop_s) {
  constexpr double kFine_s = 1e-5, kServo_s = 0.001;
  struct Word {
    double at_s, value, made_s;
  };
  std::deque<Word> up, down;
  double v = 1.0, force = 0.0, force_made_s = 0.0, seen_v = 0.0, seen_made_s = -1.0, greatest = 0.0;
  loop_s = 0.0;
  for (int i = 0; i < 200000; ++i) {
    const double t = i * kFine_s;
    const auto due = [t](double period) { return std::fmod(t + 1e-9, period) < kFine_s; };
    if (due(device_s)) {
      up.push_back({t + way_s, v, force_made_s});
      while (!down.empty() && down.front().at_s <= t) {
        force = down.front().value;
        force_made_s = down.front().made_s;
        down.pop_front();
      }
    }
    if (due(kServo_s)) {
      while (!up.empty() && up.front().at_s <= t) {
        seen_v = up.front().value;
        seen_made_s = up.front().made_s;
        up.pop_front();
      }
      if (seen_made_s > 0.0) loop_s = std::max(loop_s, t - seen_made_s);
      down.push_back({t + way_s, -damping * seen_v, t});
    }
    v += force / mass * kFine_s;
    if (!std::isfinite(v)) return std::numeric_limits<double>::infinity();
    if (t > 1.8) greatest = std::max(greatest, std::abs(v));
  }
  return greatest;
}

// The length of the loop as the watch measures it bounds the stable damping, whatever the ways and the rates
// are.
TEST(DeviceWatch, DampingWithinTheLimitOfTheMeasuredLoopComesToRest) {
  constexpr double kMass = 0.2, kT = 0.001;
  for (const double device_s : {0.00025, 0.0005, 0.001, 0.002, 0.004}) {
    for (const double way_s : {0.0, 0.0002, 0.0007, 0.0015, 0.003, 0.006}) {
      double loop_s = 0.0, again_s = 0.0;
      velocity_after(1e-6, kMass, device_s, way_s, loop_s);
      ASSERT_GE(loop_s, kT - 1e-9);
      const double limit = damping_stability_limit(kMass, kT, 1.0) * damping_share(1.0, loop_s / kT - 2.0);
      EXPECT_LT(velocity_after(kUsableShareOfDampingLimit * limit, kMass, device_s, way_s, again_s), 1e-3)
          << "device " << device_s << " s, way " << way_s << " s, loop " << loop_s << " s";
      EXPECT_GT(velocity_after(3.0 * limit, kMass, device_s, way_s, again_s), 1.0)
          << "the limit is not far from the edge: device " << device_s << " s, way " << way_s << " s";
    }
  }
}

// Slow enough that no single sample differs by what a jump is.
TEST(DeviceWatch, AVelocityOfTheWrongSignOrUnitIsFoundOverSamples) {
  for (const double factor : {-1.0, 0.0, 1000.0, 57.3}) {
    WatchRig rig;
    rig.reading.handle.velocity_m_s = {0.0, 0.15, 0.0};
    rig.tick(300);
    ASSERT_EQ(rig.last.trouble, DeviceTrouble::kNone);
    int ticks = 0;
    for (; rig.last.trouble == DeviceTrouble::kNone && ticks < 500; ++ticks) {
      rig.reading.handle.position_m[1] += kWatchTick_s * 0.15 * (1.0 - factor);  // moves on as before
      rig.reading.handle.velocity_m_s[1] = 0.15 * factor;
      rig.tick();
    }
    EXPECT_LT(ticks, 150) << factor;
    EXPECT_TRUE(rig.last.trouble == DeviceTrouble::kDisagrees || rig.last.trouble == DeviceTrouble::kJumped)
        << factor;
    EXPECT_FALSE(rig.last.hand.valid);
    const DeviceTrouble found = rig.last.trouble;
    rig.reading.handle.velocity_m_s = {};
    EXPECT_EQ(rig.tick(500).trouble, found) << "until the clutch is let out";
    rig.reading.clutch = false;
    EXPECT_EQ(rig.tick().trouble, DeviceTrouble::kNone);
  }
}

}  // namespace
}  // namespace phantom::teleop
