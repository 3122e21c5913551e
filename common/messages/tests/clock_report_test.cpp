#include "common/messages/clock_report.hpp"

#include <gtest/gtest.h>

namespace phantom::messages {
namespace {

core::Health told(ClockReport& report, std::optional<double> difference_s) {
  core::Health health{core::ComponentState::kRunning, "coupled", {}, {}};
  report.add_to(health, difference_s, core::kNsPerSecond);
  return health;
}

// Tries slave_io: its host's wall clock differs from the master's
// Tries master_io: its host's wall clock differs from the slave's; from phantom_sensing's
// Tries phantom_sensing: its host's wall clock differs from the slave's
TEST(ClockReport, SR24_SaysBySecondsOrDaysWhoseClockIsAhead) {
  ClockReport report("master_io");
  const core::Health ahead = told(report, 5.04);
  EXPECT_EQ(ahead.message,
            "coupled; clocks differ by 5.0 s: this host's is ahead of that of master_io's host");
  ASSERT_EQ(ahead.figures.size(), 1u);
  EXPECT_EQ(ahead.figures[0].name, "clock_ahead_of_master_io");
  EXPECT_EQ(ahead.figures[0].value, 5.04);
  EXPECT_EQ(ahead.state, core::ComponentState::kRunning);
  EXPECT_EQ(told(report, -631e6).message,
            "coupled; clocks differ by 7303 days: this host's is behind that of master_io's host");
}

TEST(ClockReport, SmallDifferencesAreAFigureAndTheNetworksDelayIsNone) {
  ClockReport report("slave_io");
  EXPECT_EQ(told(report, 0.4).message, "coupled");
  EXPECT_EQ(told(report, 0.4).figures.size(), 1u);
  EXPECT_TRUE(told(report, 0.01).figures.empty());
  EXPECT_TRUE(told(report, std::nullopt).figures.empty());
}

}  // namespace
}  // namespace phantom::messages
