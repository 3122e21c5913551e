#include "components/synthetic_viewer/state/delay_stages.hpp"

#include <gtest/gtest.h>

namespace phantom::synthetic_viewer {
namespace {

constexpr core::Nanoseconds kStagesNow_ns = 100 * core::kNsPerSecond, kStageMs = core::kNsPerSecond / 1000;

/// Clocks of slave and phantom that have nothing to do with this host's.
constexpr core::Nanoseconds kSlaveClock_ns = -40 * core::kNsPerSecond,
                            kPhantomClock_ns = 7 * core::kNsPerSecond;
constexpr std::uint64_t kSlave = 11, kPhantom = 12;

ViewerState a_running_system() {
  ViewerState state;
  state.arm.stamp = {500, kStagesNow_ns + kSlaveClock_ns - kStageMs, kSlave};
  state.arm.received_ns = kStagesNow_ns;
  state.percept.stamp = {50, kStagesNow_ns + kPhantomClock_ns - 2 * kStageMs, kPhantom};
  state.percept.slave_echo = {495, state.arm.stamp.monotonic_ns - 9 * kStageMs, kSlave};
  state.percept.received_ns = kStagesNow_ns - 2 * kStageMs;
  state.master.drag_echo = {4000, state.percept.stamp.monotonic_ns - 5 * kStageMs, kPhantom};
  state.master.received_ns = kStagesNow_ns - kStageMs;
  ComponentSample slave_io;
  slave_io.component = "slave_io";
  slave_io.loops.push_back({"servo", 0.001, 1000, 5, 300, 400, 12, 40, 1000, 2});
  state.components["slave_io@desk"] = slave_io;
  return state;
}

TEST(DelayStages, AddUpWhateverTheClocksOfTheHostsAre) {
  const auto stages = delay_stages(a_running_system(), {}, kStagesNow_ns);
  EXPECT_STREQ(stages[0].name, "encoder");
  EXPECT_NEAR(stages[0].age_s, 0.0013, 1e-9) << "a period and the latest wake-ups";
  EXPECT_NEAR(stages[0].budget_s, 0.002, 1e-9);
  EXPECT_NEAR(stages[1].age_s, 0.007, 1e-9)
      << "the sample that is echoed came 9 ms before the newest, the percept 2 ms";
  EXPECT_NEAR(stages[2].age_s, 0.006, 1e-9);
  EXPECT_NEAR(stages[3].age_s, 0.001, 1e-9);
  for (const DelayStage& stage : stages) EXPECT_LT(stage.age_s, stage.budget_s) << stage.name;
}

TEST(DelayStages, AStageThatTakesLongIsTheOneThatIsOver) {
  ViewerState state = a_running_system();
  state.percept.slave_echo.monotonic_ns -= 300 * kStageMs;
  const auto stages = delay_stages(state, {}, kStagesNow_ns);
  for (const DelayStage& stage : stages)
    EXPECT_EQ(stage.age_s > stage.budget_s, std::string(stage.name) == "sensing") << stage.name;
}

TEST(DelayStages, WhatIsNotKnownIsNotANumber) {
  for (const DelayStage& stage : delay_stages({}, {}, kStagesNow_ns))
    EXPECT_EQ(stage.age_s, -1.0) << stage.name;
  ViewerState state = a_running_system();
  state.percept.slave_echo.session = kSlave + 1;  // of a slave that was restarted since
  state.master.drag_echo.sequence_number = 0;
  const auto stages = delay_stages(state, {}, kStagesNow_ns);
  EXPECT_EQ(stages[1].age_s, -1.0);
  EXPECT_EQ(stages[2].age_s, -1.0);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
