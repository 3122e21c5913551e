#include "common/teleop/link_state.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <string>

namespace phantom::teleop {
namespace {

using enum LinkState;
constexpr LinkState kAll[] = {kInit, kReady, kAligned, kCoupled, kDegraded, kStopped};

// The table as a person would write it on paper: first row that fits wins. '1' must hold, '0' must not, '-'
// either.
struct Row {
  std::optional<LinkState> from;
  std::string stop, reset, fresh, aligned, recovered, partner_aligned;
  LinkState to;
};
const Row kTable[] = {
    {std::nullopt, "1", "-", "-", "-", "-", "-", kStopped},
    {kStopped, "-", "1", "-", "-", "-", "-", kInit},
    {kStopped, "-", "-", "-", "-", "-", "-", kStopped},
    {kInit, "-", "-", "1", "-", "-", "-", kReady},
    {kInit, "-", "-", "0", "-", "-", "-", kInit},
    {kReady, "-", "-", "0", "-", "-", "-", kInit},
    {kReady, "-", "-", "1", "1", "-", "-", kAligned},
    {kReady, "-", "-", "1", "0", "-", "-", kReady},
    {kAligned, "-", "-", "0", "-", "-", "-", kInit},
    {kAligned, "-", "-", "1", "0", "-", "-", kReady},
    {kAligned, "-", "-", "1", "1", "-", "1", kCoupled},
    {kAligned, "-", "-", "1", "1", "-", "0", kAligned},
    {kCoupled, "-", "-", "1", "-", "-", "1", kCoupled},
    {kCoupled, "-", "-", "-", "-", "-", "-", kDegraded},
    {kDegraded, "-", "-", "-", "-", "1", "-", kReady},
    {kDegraded, "-", "-", "-", "-", "0", "-", kDegraded},
};

bool fits(const std::string& wish, bool is) { return wish == "-" || (wish == "1") == is; }

LinkState by_table(LinkState state, const LinkConditions& c) {
  const bool partner_aligned = c.partner == kAligned || c.partner == kCoupled;
  for (const Row& row : kTable) {
    if (row.from && *row.from != state) continue;
    if (fits(row.stop, c.stop) && fits(row.reset, c.reset) && fits(row.fresh, c.partner_fresh) &&
        fits(row.aligned, c.aligned) && fits(row.recovered, c.recovered) &&
        fits(row.partner_aligned, partner_aligned)) {
      return row.to;
    }
  }
  ADD_FAILURE() << "no row fits";
  return kStopped;
}

TEST(LinkState, EveryTransitionIsAsTheTableSays) {
  int cases = 0;
  for (const LinkState state : kAll) {
    for (const LinkState partner : kAll) {
      for (int bits = 0; bits < 32; ++bits) {
        const LinkConditions c{.partner_fresh = (bits & 1) != 0,
                               .aligned = (bits & 2) != 0,
                               .recovered = (bits & 4) != 0,
                               .stop = (bits & 8) != 0,
                               .reset = (bits & 16) != 0,
                               .partner = partner};
        EXPECT_EQ(next_link_state(state, c), by_table(state, c))
            << name_of(state) << " with partner " << name_of(partner) << ", bits " << bits;
        ++cases;
      }
    }
  }
  EXPECT_EQ(cases, 6 * 6 * 32);
}

TEST(LinkState, CouplingIsReachedOnlyFromAligned) {
  for (const LinkState state : kAll) {
    for (int bits = 0; bits < 32; ++bits) {
      for (const LinkState partner : kAll) {
        const LinkConditions c{(bits & 1) != 0, (bits & 2) != 0,  (bits & 4) != 0,
                               (bits & 8) != 0, (bits & 16) != 0, partner};
        if (next_link_state(state, c) == kCoupled) {
          EXPECT_TRUE(state == kAligned || state == kCoupled);
        }
      }
    }
  }
}

struct Pair {
  LinkTiming timing{.staleness_s = 0.02, .align_hold_s = 0.05, .recovery_s = 0.1};
  LinkMonitor master{timing}, slave{timing};
  // Both see each other's state of the tick before.
  void run(double duration_s, bool connected, bool agree) {
    for (double t = 0; t < duration_s; t += 0.001) {
      const LinkState m = master.state(), s = slave.state();
      age_s = connected ? 0.001 : age_s + 0.001;
      master.step({.partner_age_s = age_s, .partner = s, .poses_agree = agree, .requests = master_requests},
                  0.001);
      slave.step({.partner_age_s = age_s, .partner = m, .poses_agree = agree, .requests = {}}, 0.001);
    }
  }
  double age_s = std::numeric_limits<double>::infinity();
  StopRequests master_requests;
};

TEST(LinkMonitor, TwoSidesCoupleAndRecoverFromALoss) {
  Pair pair;
  pair.run(0.2, false, false);
  EXPECT_EQ(pair.master.state(), kInit);
  pair.run(0.2, true, false);
  EXPECT_EQ(pair.slave.state(), kReady);
  pair.run(0.2, true, true);
  EXPECT_EQ(pair.master.state(), kCoupled);
  EXPECT_EQ(pair.slave.state(), kCoupled);
  pair.run(0.022, false, true);
  EXPECT_EQ(pair.slave.state(), kDegraded);
  pair.run(0.05, true, true);
  EXPECT_EQ(pair.slave.state(), kDegraded);  // recovery takes its time
  pair.run(1.0, true, false);
  EXPECT_EQ(pair.slave.state(), kReady);  // not without aligned poses
  pair.run(0.5, true, true);
  EXPECT_EQ(pair.master.state(), kCoupled);
  EXPECT_EQ(pair.slave.state(), kCoupled);
}

TEST(LinkMonitor, StalenessIsNoticedWithinTheLimitAndTwoPeriods) {
  Pair pair;
  pair.run(0.5, true, true);
  ASSERT_EQ(pair.slave.state(), kCoupled);
  int ticks = 0;
  while (pair.slave.state() == kCoupled && ticks < 1000) {
    pair.run(0.0005, false, true);
    ++ticks;
  }
  EXPECT_LE(ticks, 22);
}

// A partner that lets go is heard all the time: that it was heard before does not make it recovered.
TEST(LinkMonitor, AfterALossThePartnerMustBeHeardAnew) {
  const LinkTiming timing{.recovery_s = 0.2};
  LinkMonitor monitor(timing);
  LinkObservation seen{.partner_age_s = 0.001, .partner = kCoupled, .poses_agree = true};
  for (int i = 0; i < 2000; ++i) monitor.step(seen, 0.001);
  ASSERT_EQ(monitor.state(), kCoupled);
  seen.partner = LinkState::kDegraded;
  int degraded = 0;
  while (monitor.step(seen, 0.001) == LinkState::kDegraded && degraded < 1000) ++degraded;
  EXPECT_NEAR(0.001 * degraded, timing.recovery_s, 0.003);
  EXPECT_EQ(monitor.state(), kReady);
}

TEST(LinkMonitor, AgesThatAreNotNumbersAreStale) {
  LinkMonitor monitor(LinkTiming{});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(monitor.step({.partner_age_s = nan, .partner = kCoupled, .poses_agree = true}, 0.001), kInit);
  EXPECT_EQ(monitor.step(
                {.partner_age_s = 0.0, .round_trip_s = nan, .partner = kCoupled, .poses_agree = true}, 0.001),
            kInit);
}

TEST(LinkState, PosesThatAreNotNumbersNeverAgree) {
  const core::JointArray tolerance{0.1, 0.1, 0.1};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NEAR(pose_difference({1.0, 2.0}, {1.05, 2.2}, tolerance, 2), 2.0, 1e-12);
  EXPECT_GT(pose_difference({nan, 2.0}, {1.0, 2.0}, tolerance, 2), 1.0);
  EXPECT_GT(pose_difference({1.0, 2.0}, {1.0, nan}, tolerance, 2), 1.0);
  EXPECT_EQ(pose_difference({1.0, nan}, {1.0, 2.0}, tolerance, 1), 0.0) << "beyond the arm's joints";
}

TEST(LinkMonitor, SamplesThatComeRegularlyButLateAreStale) {
  const LinkTiming timing{.staleness_s = 0.02, .round_trip_limit_s = 0.1};
  for (const bool late : {false, true}) {
    LinkMonitor monitor(timing);
    const LinkObservation in_time{
        .partner_age_s = 0.001, .round_trip_s = 0.004, .partner = kCoupled, .poses_agree = true};
    for (int i = 0; i < 500; ++i) monitor.step(in_time, 0.001);
    ASSERT_EQ(monitor.state(), kCoupled);
    LinkObservation now = in_time;
    now.round_trip_s = late ? 0.101 : 0.099;
    EXPECT_EQ(monitor.step(now, 0.001), late ? LinkState::kDegraded : kCoupled);
  }
}

TEST(LinkMonitor, NothingIsCoupledWhileTheDrivesDoNotFollow) {
  LinkMonitor monitor{LinkTiming{}};
  LinkObservation seen{
      .partner_age_s = 0.001, .partner = kCoupled, .poses_agree = true, .drives_follow = false};
  for (int i = 0; i < 500; ++i) EXPECT_EQ(monitor.step(seen, 0.001), kInit);
  seen.drives_follow = true;
  for (int i = 0; i < 500; ++i) monitor.step(seen, 0.001);
  ASSERT_EQ(monitor.state(), kCoupled);
  seen.drives_follow = false;
  EXPECT_EQ(monitor.step(seen, 0.001), LinkState::kDegraded);
}

TEST(LinkMonitor, AFaultOfTheDrivesStopsForAsLongAsItIsThereAndPosesAreAlignedAnew) {
  LinkMonitor monitor{LinkTiming{}};
  LinkObservation seen{.partner_age_s = 0.001, .partner = kCoupled, .poses_agree = true};
  for (int i = 0; i < 500; ++i) monitor.step(seen, 0.001);
  ASSERT_EQ(monitor.state(), kCoupled);
  seen.drive_fault = true;
  for (int i = 0; i < 500; ++i) EXPECT_EQ(monitor.step(seen, 0.001), LinkState::kStopped);
  seen.drive_fault = false;
  EXPECT_EQ(monitor.step(seen, 0.001), kInit);
  seen.poses_agree = false;
  for (int i = 0; i < 500; ++i) monitor.step(seen, 0.001);
  EXPECT_EQ(monitor.state(), LinkState::kReady);
}

TEST(LinkMonitor, TheCauseOfAStopIsToldForAsLongAsItLasts) {
  LinkMonitor monitor{LinkTiming{}};
  LinkObservation seen{.partner_age_s = 0.001, .partner = kCoupled, .poses_agree = true};
  monitor.step(seen, 0.001);
  EXPECT_EQ(monitor.stop_cause(), StopCause::kNone);
  seen.drive_fault = true;
  monitor.step(seen, 0.001);
  EXPECT_EQ(monitor.stop_cause(), StopCause::kDriveFault);
  seen.requests.stop();
  monitor.step(seen, 0.001);
  EXPECT_EQ(monitor.stop_cause(), StopCause::kEmergency)
      << "somebody pressed the button: that is what counts";
  seen.requests.reset();
  monitor.step(seen, 0.001);
  EXPECT_EQ(monitor.state(), kStopped);
  EXPECT_EQ(monitor.stop_cause(), StopCause::kDriveFault) << "still there";
  seen.drive_fault = false;
  monitor.step(seen, 0.001);
  EXPECT_EQ(monitor.state(), kInit);
  EXPECT_EQ(monitor.stop_cause(), StopCause::kNone);
}

TEST(LinkMonitor, WhoAnswersAnotherIsNoPartner) {
  LinkMonitor monitor{LinkTiming{}};
  LinkObservation seen{
      .partner_age_s = 0.001, .answers_another = true, .partner = kCoupled, .poses_agree = true};
  for (int i = 0; i < 500; ++i) EXPECT_EQ(monitor.step(seen, 0.001), kInit);
  seen.answers_another = false;
  for (int i = 0; i < 500; ++i) monitor.step(seen, 0.001);
  ASSERT_EQ(monitor.state(), kCoupled);
  seen.answers_another = true;
  EXPECT_EQ(monitor.step(seen, 0.001), LinkState::kDegraded);
}

TEST(LinkMonitor, EmergencyStopStaysUntilReset) {
  Pair pair;
  pair.run(0.5, true, true);
  pair.master_requests.stop();
  pair.run(0.001, true, true);
  EXPECT_EQ(pair.master.state(), kStopped);
  pair.run(0.5, true, true);
  EXPECT_EQ(pair.master.state(), kStopped);
  EXPECT_NE(pair.slave.state(), kCoupled);
  pair.master_requests.reset();
  pair.run(0.001, true, true);
  EXPECT_EQ(pair.master.state(), kInit);
  pair.run(0.5, true, true);
  EXPECT_EQ(pair.master.state(), kCoupled);
}

// Requests are read once a tick; whatever came between two ticks must have the effect that its order means.
TEST(StopRequests, AStopIsNeverMissedAndAResetNeverReleasesALaterOne) {
  const auto monitor_after = [](std::initializer_list<bool> asked /* true: stop, false: reset */, int ticks) {
    LinkMonitor monitor{LinkTiming{}};
    LinkObservation seen{.partner_age_s = 0.0};
    monitor.step(seen, 0.001);
    for (const bool stop : asked) stop ? seen.requests.stop() : seen.requests.reset();
    for (int i = 0; i < ticks; ++i) monitor.step(seen, 0.001);
    return monitor.state();
  };
  EXPECT_EQ(monitor_after({true}, 1000), LinkState::kStopped);
  EXPECT_EQ(monitor_after({true, false}, 1), LinkState::kStopped) << "stopped for a tick at least";
  EXPECT_EQ(monitor_after({true, false}, 3), LinkState::kReady) << "and the reset is not lost";
  EXPECT_EQ(monitor_after({false, true}, 1000), LinkState::kStopped)
      << "a reset does not release a later stop";
  EXPECT_EQ(monitor_after({true, false, true}, 1000), LinkState::kStopped);
  EXPECT_EQ(monitor_after({false}, 3), LinkState::kReady);
}

}  // namespace
}  // namespace phantom::teleop
