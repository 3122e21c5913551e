// The arm's drives go on under their last targets while the servo is held up: with the guard of its loop, and
// without it, on drives that have no speed limit of their own.
#include <gtest/gtest.h>

#include <random>

#include "components/slave_io/tests/arm_bench.hpp"

namespace phantom::slave_io {
namespace {

using can::DriveMode;
using teleop::LinkState;

constexpr double kOverspeed = 1.25;  // of a joint's greatest speed, that the guard lets

/// Drives with the patience of a busy desktop, so that they themselves bear gaps of a tenth of a second.
Config starvable(DriveMode mode) {
  Config config = can_config(mode);
  can::DriveTiming& timing = config.can->group.timing;
  timing.heartbeat_timeout_s = timing.target_timeout_s = 0.5;
  timing.most_missed = 100;
  return config;
}
/// Without whatever guards a loop that is held up.
Config unguarded(Config config) {
  config.loop.late_limit_s = 1e9;
  config.held = {};
  return config;
}

struct StarvedRun {
  std::string trouble;     // of the drives, at the end
  double fastest = 0.0;    ///< greatest speed of a joint ÷ its limit
  bool uncoupled = false;  ///< the loop was found starved
  bool recovered = false;  ///< coupled again by itself, on schedule
};

/// The master swings at a third of the joints' greatest speed. After a second the servo is away again and
/// again for `gap_s()`, and runs `ticks()` times in between, for `duration_s`.
template <class Gap, class Ticks>
StarvedRun starve(const Config& config, double duration_s, Gap gap_s, Ticks ticks) {
  ArmBench bench(config);
  for (const auto& drive : bench.drives) drive->misbehaviour.ignore_max_speed = true;
  EXPECT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
  const core::Nanoseconds begin_ns = bench.now_ns;
  double lead_s = 1e9;
  const auto run = [&](int count) {
    constexpr double kSwing_rad_s = 5.0;
    for (int i = 0; i < count; ++i) {
      const double t = std::min(core::seconds(bench.now_ns + bench.period_ns - begin_ns), lead_s);
      for (std::size_t j = 1; j < shipped_arm().arm.joint_count(); ++j) {
        const double away = shipped_arm().home[j] > 0.0 ? -1.0 : 1.0;
        const double speed = away * shipped_arm().arm.joints()[j].max_speed / 3.0;
        bench.master.velocity[j] = t < lead_s ? speed * std::sin(kSwing_rad_s * t) : 0.0;
        bench.master.position[j] =
            shipped_arm().home[j] + speed / kSwing_rad_s * (1.0 - std::cos(kSwing_rad_s * t));
      }
      bench.tick();
    }
  };
  run(static_cast<int>(1.0 / config.period_s));
  EXPECT_EQ(bench.state(), LinkState::kCoupled);
  StarvedRun was;
  bench.fastest = 0.0;
  while (core::seconds(bench.now_ns - begin_ns) < 1.0 + duration_s) {
    for (double left_s = gap_s(); left_s > config.period_s; left_s -= config.period_s) bench.miss();
    run(ticks());
    was.uncoupled = was.uncoupled || bench.last.outputs.loop.starved;
    if (bench.last.outputs.loop.starved) {
      EXPECT_NE(bench.state(), LinkState::kCoupled);
    }
  }
  was.fastest = bench.fastest;
  lead_s = core::seconds(bench.now_ns - begin_ns);
  bench.arm->health();
  run(static_cast<int>(2.5 / config.period_s));
  was.recovered = bench.state() == LinkState::kCoupled;
  was.trouble = bench.arm->health().message;
  return was;
}

TEST(StarvedLoop, SR18_InTorqueModeTheArmStaysWithinItsSpeedsWhereWithoutTheGuardItSwingsFarBeyond) {
  for (const double gap_s : {0.02, 0.03, 0.05, 0.08}) {
    for (const int ticks : {1, 2}) {
      SCOPED_TRACE(testing::Message() << gap_s << " s, ticks in between: " << ticks);
      const auto gap = [&] { return gap_s; };
      const auto some = [&] { return ticks; };
      const StarvedRun with = starve(starvable(DriveMode::kTorque), 2.0, gap, some);
      EXPECT_LT(with.fastest, kOverspeed);
      EXPECT_TRUE(with.uncoupled);
      EXPECT_TRUE(with.recovered) << "by itself, once it runs on schedule";
      if (ticks == 1) {
        EXPECT_GT(starve(unguarded(starvable(DriveMode::kTorque)), 2.0, gap, some).fastest, 3.0);
      }
    }
  }
}

// Too short to be counted as late, but longer than the loops bear at full gain.
TEST(StarvedLoop, SR18_GapsThatAreNotLateMakeTheLoopsSofterAndTheArmFollowsOn) {
  for (const double gap_s : {0.006, 0.008, 0.01}) {
    SCOPED_TRACE(gap_s);
    const auto gap = [&] { return gap_s; };
    const auto one = [] { return 1; };
    const StarvedRun with = starve(starvable(DriveMode::kTorque), 4.0, gap, one);
    EXPECT_LT(with.fastest, 0.6);
    EXPECT_FALSE(with.uncoupled);
    EXPECT_TRUE(with.recovered) << "it has been coupled all the time";
    EXPECT_GT(starve(unguarded(starvable(DriveMode::kTorque)), 4.0, gap, one).fastest, kOverspeed);
  }
}

TEST(StarvedLoop, SR18_WhereTheDrivesCloseTheirLoopsThemselvesTheArmStaysWithinItsSpeedsToo) {
  for (const auto mode : {DriveMode::kVelocity, DriveMode::kPosition}) {
    for (const double gap_s : {0.02, 0.05, 0.08}) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(mode) << ", " << gap_s << " s");
      const StarvedRun with = starve(
          starvable(mode), 2.0, [&] { return gap_s; }, [] { return 2; });
      EXPECT_LT(with.fastest, kOverspeed);
      EXPECT_TRUE(with.uncoupled);
      EXPECT_TRUE(with.recovered) << with.trouble;
    }
  }
}

TEST(StarvedLoop, SR18_WhateverThePatternOfGapsTheArmStaysWithinItsSpeeds) {
  double worst = 0.0, worst_without = 0.0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 chance(seed);
    std::uniform_real_distribution<double> longest_s(0.004, 0.09);
    const double most_s = longest_s(chance);
    std::uniform_real_distribution<double> gap_s(0.002, most_s);
    std::geometric_distribution<int> more(std::uniform_real_distribution<double>(0.02, 0.9)(chance));
    const auto run = [&](const Config& config) {
      return starve(
                 config, 2.0, [&] { return gap_s(chance); }, [&] { return 1 + more(chance); })
          .fastest;
    };
    const double with = run(starvable(DriveMode::kTorque));
    EXPECT_LT(with, kOverspeed) << "gaps of up to " << most_s << " s";
    worst = std::max(worst, with);
    worst_without = std::max(worst_without, run(unguarded(starvable(DriveMode::kTorque))));
  }
  RecordProperty("worst", std::to_string(worst));
  RecordProperty("worst_without", std::to_string(worst_without));
  EXPECT_GT(worst_without, 3.0) << "some of these patterns need the guard";
}

// Tries slave_io: the servo's loop is held up
TEST(StarvedLoop, SR18_TheUncoupledArmIsHeldByItsDrivesWhichNeedNoLoop) {
  ArmBench bench(starvable(DriveMode::kTorque));
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled));
  for (int gap = 0; gap < 3; ++gap) {
    for (int i = 0; i < 20; ++i) bench.miss();
    bench.tick();
  }
  ASSERT_EQ(bench.state(), LinkState::kDegraded);
  EXPECT_EQ(bench.last.stop.id, 0U) << "it is no stop";
  for (int i = 0; i < 50; ++i) bench.miss();
  for (const auto& drive : bench.drives)
    EXPECT_EQ(drive->power(), simulated_drive::SimulatedDrive::Power::kQuickStop);
}

}  // namespace
}  // namespace phantom::slave_io
