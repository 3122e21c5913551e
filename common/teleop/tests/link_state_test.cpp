#include "common/teleop/coupling/link_state.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <string>

namespace phantom::teleop {
namespace {

using enum LinkState;
constexpr LinkState kAll[] = {kInit, kReady, kAligned, kCoupled, kDegraded, kStopped};

// The table as a person would write it on paper: first row that fits wins. '1' must hold, '0' must not, '-'
// either.
struct Row {
  std::optional<LinkState> from;
  std::string stop, partner_stopped, fresh, aligned, recovered, partner_aligned;
  LinkState to;
};
const Row kTable[] = {
    {std::nullopt, "1", "-", "-", "-", "-", "-", kStopped},
    {kStopped, "0", "-", "-", "-", "-", "-", kInit},
    {kInit, "-", "0", "1", "-", "-", "-", kReady},
    {kInit, "-", "-", "-", "-", "-", "-", kInit},
    {kReady, "-", "-", "0", "-", "-", "-", kInit},
    {kReady, "-", "1", "-", "-", "-", "-", kInit},
    {kReady, "-", "-", "1", "1", "-", "-", kAligned},
    {kReady, "-", "-", "1", "0", "-", "-", kReady},
    {kAligned, "-", "-", "0", "-", "-", "-", kInit},
    {kAligned, "-", "1", "-", "-", "-", "-", kInit},
    {kAligned, "-", "-", "1", "0", "-", "-", kReady},
    {kAligned, "-", "-", "1", "1", "-", "1", kCoupled},
    {kAligned, "-", "-", "1", "1", "-", "0", kAligned},
    {kCoupled, "-", "-", "1", "-", "-", "1", kCoupled},
    {kCoupled, "-", "-", "-", "-", "-", "-", kDegraded},
    {kDegraded, "-", "0", "1", "-", "1", "-", kReady},
    {kDegraded, "-", "-", "-", "-", "-", "-", kDegraded},
};

bool fits(const std::string& wanted, bool is) { return wanted == "-" || (wanted == "1") == is; }

LinkState by_table(LinkState state, const LinkConditions& c) {
  const bool partner_aligned = c.partner == kAligned || c.partner == kCoupled;
  for (const Row& row : kTable) {
    if (row.from && *row.from != state) continue;
    if (fits(row.stop, c.stop) && fits(row.partner_stopped, c.partner == kStopped) &&
        fits(row.fresh, c.partner_fresh) && fits(row.aligned, c.aligned) &&
        fits(row.recovered, c.recovered) && fits(row.partner_aligned, partner_aligned)) {
      return row.to;
    }
  }
  ADD_FAILURE() << "no row fits";
  return kStopped;
}

TEST(LinkState, SR06_SR07_EveryTransitionIsAsTheTableSays) {
  int cases = 0;
  for (const LinkState state : kAll) {
    for (const LinkState partner : kAll) {
      for (int bits = 0; bits < 16; ++bits) {
        const LinkConditions c{.partner_fresh = (bits & 1) != 0,
                               .aligned = (bits & 2) != 0,
                               .recovered = (bits & 4) != 0,
                               .stop = (bits & 8) != 0,
                               .partner = partner};
        EXPECT_EQ(next_link_state(state, c), by_table(state, c))
            << name_of(state) << " with partner " << name_of(partner) << ", bits " << bits;
        ++cases;
      }
    }
  }
  EXPECT_EQ(cases, 6 * 6 * 16);
}

TEST(LinkState, SR06_CouplingIsReachedOnlyFromAligned) {
  for (const LinkState state : kAll) {
    for (int bits = 0; bits < 16; ++bits) {
      for (const LinkState partner : kAll) {
        const LinkConditions c{(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0, (bits & 8) != 0, partner};
        if (next_link_state(state, c) == kCoupled) {
          EXPECT_TRUE(state == kAligned || state == kCoupled);
        }
      }
    }
  }
}

struct Pair {
  LinkTiming timing{.staleness_s = 0.02, .align_hold_s = 0.05, .recovery_s = 0.1};
  LinkMonitor master{timing, StopLatch(1, {})}, slave{timing, StopLatch(2, {})};
  // Both see each other's state of the tick before.
  void run(double duration_s, bool connected, bool agree) {
    for (double t = 0; t < duration_s; t += 0.001) {
      if (connected) {
        m = master.state(), s = slave.state();
        m_stop = master.stop().id, s_stop = slave.stop().id;
      }
      age_s = connected ? 0.001 : age_s + 0.001;
      master.step({.partner_age_s = age_s,
                   .partner = s,
                   .partner_stop = s_stop,
                   .poses_agree = agree,
                   .stop_requests = master_stops,
                   .reset = reset_both ? &master_reset : nullptr},
                  0.001);
      slave.step({.partner_age_s = age_s,
                  .partner = m,
                  .partner_stop = m_stop,
                  .poses_agree = agree,
                  .reset = reset_both ? &slave_reset : nullptr},
                 0.001);
      reset_both = false;
    }
  }
  void reset() {
    master_reset = {master.stop().id, slave.stop().id};
    slave_reset = {slave.stop().id, master.stop().id};
    reset_both = true;
  }
  double age_s = std::numeric_limits<double>::infinity();
  LinkState m = kInit, s = kInit;  // as the other side heard it last
  StopId m_stop = 0, s_stop = 0;
  std::uint32_t master_stops = 0;
  StopReset master_reset, slave_reset;
  bool reset_both = false;
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

TEST(LinkMonitor, SR07_StalenessIsNoticedWithinTheLimitAndTwoPeriods) {
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
  LinkMonitor monitor(timing, StopLatch(1, {}));
  LinkObservation seen{.partner_age_s = 0.001, .partner = kCoupled, .poses_agree = true};
  for (int i = 0; i < 2000; ++i) monitor.step(seen, 0.001);
  ASSERT_EQ(monitor.state(), kCoupled);
  seen.partner = LinkState::kDegraded;
  int degraded = 0;
  while (monitor.step(seen, 0.001).state == LinkState::kDegraded && degraded < 1000) ++degraded;
  EXPECT_NEAR(0.001 * degraded, timing.recovery_s, 0.003);
  EXPECT_EQ(monitor.state(), kReady);
}

TEST(LinkMonitor, SR07_SR11_AgesThatAreNotNumbersAreStale) {
  LinkMonitor monitor(LinkTiming{}, StopLatch(1, {}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  LinkObservation seen{.partner_age_s = nan, .partner = kCoupled, .poses_agree = true};
  EXPECT_EQ(monitor.step(seen, 0.001).state, kInit);
  seen.partner_age_s = 0.0;
  seen.round_trip_s = nan;
  EXPECT_EQ(monitor.step(seen, 0.001).state, kInit);
}

TEST(LinkState, SR06_SR11_PosesThatAreNotNumbersNeverAgree) {
  const core::JointArray tolerance{0.1, 0.1, 0.1};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NEAR(pose_difference({1.0, 2.0}, {1.05, 2.2}, tolerance, 2), 2.0, 1e-12);
  EXPECT_GT(pose_difference({nan, 2.0}, {1.0, 2.0}, tolerance, 2), 1.0);
  EXPECT_GT(pose_difference({1.0, 2.0}, {1.0, nan}, tolerance, 2), 1.0);
  EXPECT_EQ(pose_difference({1.0, nan}, {1.0, 2.0}, tolerance, 1), 0.0) << "beyond the arm's joints";
}

TEST(LinkMonitor, SR07_SamplesThatComeRegularlyButLateAreStale) {
  const LinkTiming timing{.staleness_s = 0.02, .round_trip_limit_s = 0.1};
  for (const bool late : {false, true}) {
    LinkMonitor monitor(timing, StopLatch(1, {}));
    const LinkObservation in_time{
        .partner_age_s = 0.001, .round_trip_s = 0.004, .partner = kCoupled, .poses_agree = true};
    for (int i = 0; i < 500; ++i) monitor.step(in_time, 0.001);
    ASSERT_EQ(monitor.state(), kCoupled);
    LinkObservation now = in_time;
    now.round_trip_s = late ? 0.101 : 0.099;
    EXPECT_EQ(monitor.step(now, 0.001).state, late ? LinkState::kDegraded : kCoupled);
  }
}

// As a lost partner; but power, too, is withdrawn, as long as it lasts.
// Tries slave_io: the servo's loop is held up
TEST(LinkMonitor, SR18_AStarvedLoopUncouplesWithoutPowerAndRecoversAsAfterALoss) {
  LinkMonitor monitor({.staleness_s = 0.02, .align_hold_s = 0.01, .recovery_s = 0.1}, StopLatch(1, {}));
  LinkObservation seen{.partner_age_s = 0.001, .partner = kReady, .poses_agree = true};
  LinkDecision now;
  const auto run = [&](double duration_s) {
    for (double t = 0; t < duration_s; t += 0.001) now = monitor.step(seen, 0.001);
  };
  run(0.05);
  ASSERT_EQ(now.state, kAligned);
  seen.partner = kAligned;
  run(0.01);
  ASSERT_EQ(now.state, kCoupled);
  ASSERT_TRUE(now.power);
  seen.loop_starved = true;
  run(0.001);
  EXPECT_EQ(now.state, kDegraded) << "in the same tick";
  EXPECT_FALSE(now.power);
  seen.partner = kReady;
  run(1.0);
  EXPECT_EQ(now.state, kDegraded);
  EXPECT_FALSE(now.power);
  EXPECT_EQ(now.stop.id, 0U) << "it is no stop";
  seen.loop_starved = false;
  run(0.09);
  EXPECT_EQ(now.state, kDegraded) << "the time of recovery begins anew";
  EXPECT_TRUE(now.power);
  run(0.05);
  EXPECT_EQ(now.state, kAligned) << "through ready, with poses that agree";
  seen.partner = kAligned;
  run(0.002);
  EXPECT_EQ(now.state, kCoupled);
  seen.loop_starved = true;
  seen.stop_requests = 1;
  run(0.001);
  EXPECT_EQ(now.state, kStopped) << "a stop takes precedence";
}

// As after a loss, on both sides: the side itself in the same tick, its partner when it hears of it.
TEST(LinkMonitor, SR19_WithoutPermissionOfBothSidesNothingIsCoupledAndCouplingNeedsAlignedPosesAgain) {
  for (const bool own : {true, false}) {
    LinkMonitor monitor({.staleness_s = 0.02, .align_hold_s = 0.01, .recovery_s = 0.1}, StopLatch(1, {}));
    LinkObservation seen{.partner_age_s = 0.001, .partner = kCoupled, .poses_agree = true};
    bool& permitted = own ? seen.permitted : seen.partner_permitted;
    LinkDecision now;
    const auto run = [&](double duration_s) {
      for (double t = 0; t < duration_s; t += 0.001) now = monitor.step(seen, 0.001);
    };
    permitted = false;
    run(1.0);
    EXPECT_EQ(now.state, kInit) << "not even aligned: the arm does not come to the master either";
    EXPECT_EQ(now.peer_motion_inhibited, !own);
    permitted = true;
    run(0.1);
    ASSERT_EQ(now.state, kCoupled);
    EXPECT_FALSE(now.peer_motion_inhibited);
    permitted = false;
    run(0.001);
    EXPECT_EQ(now.state, kDegraded) << "in the same tick";
    EXPECT_TRUE(now.power) << "the arm is held";
    EXPECT_EQ(now.stop.id, 0U) << "it is no stop";
    run(5.0);
    EXPECT_EQ(now.state, kDegraded);
    permitted = true;
    seen.poses_agree = false;
    run(0.09);
    EXPECT_EQ(now.state, kDegraded) << "the time of recovery begins when it is held again";
    run(5.0);
    EXPECT_EQ(now.state, kReady);
    seen.poses_agree = true;
    run(0.1);
    EXPECT_EQ(now.state, kCoupled);
  }
}

// Two sides with a switch each, that are pressed and let go at random, over a wire that loses and delays.
TEST(LinkMonitor, SR19_NoSequenceOfInputsCouplesWithoutPermissionOfEverySwitch) {
  std::mt19937 random(11);
  const auto chance = [&random](double share) {
    return static_cast<double>(random()) < share * 4294967296.0;
  };
  int coupled = 0, uncoupled = 0;
  for (int walk = 0; walk < 40; ++walk) {
    const LinkTiming timing{.staleness_s = 0.0205, .align_hold_s = 0.003, .recovery_s = 0.01};
    std::array<LinkMonitor, 2> sides{LinkMonitor(timing, StopLatch(1, {})),
                                     LinkMonitor(timing, StopLatch(2, {}))};
    struct Sample {
      LinkState state = kInit;
      bool permitted = false;
    };
    std::array<Sample, 2> known;  // of the partner
    std::array<double, 2> age_s{INFINITY, INFINITY};
    std::array<int, 2> withheld_ticks{1000, 1000};  // for which a side has not permitted
    std::array<bool, 2> held{};
    for (int tick = 0; tick < 3000; ++tick) {
      for (auto& one : held) one = chance(0.01) ? !one : one;
      const bool wire = !chance(0.2), agree = !chance(0.02);
      for (std::size_t s = 0; s < 2; ++s) {
        age_s[s] += 0.001;
        const LinkState before = sides[s].state();
        const auto now = sides[s].step({.partner_age_s = age_s[s],
                                        .partner = known[s].state,
                                        .poses_agree = agree,
                                        .permitted = held[s],
                                        .partner_permitted = known[s].permitted},
                                       0.001);
        withheld_ticks[s] = held[s] ? 0 : withheld_ticks[s] + 1;
        ++(now.state == kCoupled ? coupled : uncoupled);
        if (now.state == kCoupled) {
          ASSERT_TRUE(held[s]) << "in the tick in which it is let go";
          // Whatever is lost: not longer than a partner may be stale, and a tick.
          ASSERT_LE(withheld_ticks[1 - s], 22);
          ASSERT_TRUE(before == kCoupled || (before == kAligned && agree)) << "only from an aligned pose";
        }
        if (wire) {
          known[1 - s] = {now.state, held[s]};
          age_s[1 - s] = 0.0;
        }
      }
    }
  }
  EXPECT_GT(coupled, 1000);
  EXPECT_GT(uncoupled, 1000);
}

TEST(LinkMonitor, SR06_NothingIsCoupledWhileTheDrivesDoNotFollow) {
  LinkMonitor monitor{LinkTiming{}, StopLatch(1, {})};
  LinkObservation seen{
      .partner_age_s = 0.001, .partner = kCoupled, .poses_agree = true, .drives_operational = false};
  for (int i = 0; i < 500; ++i) EXPECT_EQ(monitor.step(seen, 0.001).state, kInit);
  seen.drives_operational = true;
  for (int i = 0; i < 500; ++i) monitor.step(seen, 0.001);
  ASSERT_EQ(monitor.state(), kCoupled);
  seen.drives_operational = false;
  EXPECT_EQ(monitor.step(seen, 0.001).state, LinkState::kDegraded);
}

TEST(LinkMonitor, SR05_AFaultOfTheDrivesStopsUntilItIsGoneAndResetAndPosesAreAlignedAnew) {
  LinkMonitor monitor{LinkTiming{}, StopLatch(1, {})};
  LinkObservation seen{.partner_age_s = 0.001, .partner = kCoupled, .poses_agree = true};
  for (int i = 0; i < 500; ++i) monitor.step(seen, 0.001);
  ASSERT_EQ(monitor.state(), kCoupled);
  seen.drive_fault = true;
  for (int i = 0; i < 500; ++i) EXPECT_EQ(monitor.step(seen, 0.001).state, LinkState::kStopped);
  EXPECT_EQ(monitor.stop().cause, StopCause::kDriveFault);
  seen.drive_fault = false;
  for (int i = 0; i < 500; ++i) EXPECT_EQ(monitor.step(seen, 0.001).state, LinkState::kStopped);
  const StopReset reset{.own = monitor.stop().id};
  seen.reset = &reset;
  EXPECT_EQ(monitor.step(seen, 0.001).state, kInit);
  EXPECT_EQ(monitor.stop().cause, StopCause::kNone);
  seen.reset = nullptr;
  seen.poses_agree = false;
  for (int i = 0; i < 500; ++i) monitor.step(seen, 0.001);
  EXPECT_EQ(monitor.state(), LinkState::kReady);
}

// Nobody has power before he knows that the other side is not stopped, and nobody keeps it after.
// Tries slave_io: master stopped
TEST(LinkMonitor, SR04_PowerIsForASideWhosePartnerIsHeardAndNotStopped) {
  LinkMonitor monitor{LinkTiming{}, StopLatch(1, {})};
  LinkObservation seen{.partner = kInit, .drives_operational = false};
  EXPECT_FALSE(monitor.step(seen, 0.001).power) << "nobody is heard";
  seen.partner_age_s = 0.001;
  EXPECT_TRUE(monitor.step(seen, 0.001).power);
  seen.partner_age_s = 10.0;
  EXPECT_TRUE(monitor.step(seen, 0.001).power) << "silent: the arm holds where it is";
  seen.partner = kStopped;
  seen.partner_stop = 5;
  EXPECT_FALSE(monitor.step(seen, 0.001).power);
  const StopReset reset{.own = monitor.stop().id, .partner = 5};
  seen.reset = &reset;
  const LinkDecision released = monitor.step(seen, 0.001);
  EXPECT_EQ(released.state, kInit);
  EXPECT_FALSE(released.power) << "the partner does not say yet that it is released";
  seen.reset = nullptr;
  seen.partner = kInit;
  EXPECT_TRUE(monitor.step(seen, 0.001).power);
  seen.stop_requests = 1;
  EXPECT_FALSE(monitor.step(seen, 0.001).power) << "stopped itself, with a partner that does not know it yet";
}

TEST(LinkMonitor, TheHoldTimeOfTheAlignmentCountsOnlyWhileThePartnerIsFresh) {
  LinkMonitor monitor{LinkTiming{.staleness_s = 0.02, .align_hold_s = 0.05}, StopLatch(1, {})};
  LinkObservation seen{.partner_age_s = 10.0, .partner = kReady, .poses_agree = true};
  for (int i = 0; i < 200; ++i) EXPECT_EQ(monitor.step(seen, 0.001).state, kInit);
  seen.partner_age_s = 0.001;
  for (int i = 0; i < 49; ++i) EXPECT_EQ(monitor.step(seen, 0.001).state, kReady) << i;
  for (int i = 0; i < 3; ++i) monitor.step(seen, 0.001);
  EXPECT_EQ(monitor.state(), kAligned);
}

TEST(LinkMonitor, WithAPartnerThatIsStoppedNothingIsAlignedAlsoIfItsStopWasReleasedHere) {
  LinkMonitor monitor{LinkTiming{}, StopLatch(1, {})};
  LinkObservation seen{.partner_age_s = 0.001, .partner = kStopped, .partner_stop = 5, .poses_agree = true};
  monitor.step(seen, 0.001);
  const StopReset reset{.own = monitor.stop().id, .partner = 5};
  seen.reset = &reset;
  monitor.step(seen, 0.001);
  seen.reset = nullptr;
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(monitor.step(seen, 0.001).state, kInit);
}

TEST(LinkMonitor, SR15_AStopThatThePartnerDoesNotConfirmIsTold) {
  LinkMonitor monitor{LinkTiming{}, StopLatch(1, {})};
  LinkObservation seen{.partner_age_s = 0.001, .partner = kReady, .stop_requests = 1};
  int quiet = 0;
  while (!monitor.step(seen, 0.001).partner_unconfirmed && quiet < 1000) ++quiet;
  EXPECT_NEAR(0.001 * quiet, kConfirmWithin_s, 0.003);
  seen.partner = kStopped;
  EXPECT_FALSE(monitor.step(seen, 0.001).partner_unconfirmed);
  seen.partner = kInit;  // released there, not here
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(monitor.step(seen, 0.001).partner_unconfirmed);
  ++seen.stop_requests;  // a new stop needs a new word
  for (int i = 0; i < 1000; ++i) monitor.step(seen, 0.001);
  EXPECT_TRUE(monitor.step(seen, 0.001).partner_unconfirmed);
}

// Tries slave_io: the master answers another slave_io
// Tries master_io: the slave answers another master_io
TEST(LinkMonitor, SR11_WhoAnswersAnotherIsNoPartner) {
  LinkMonitor monitor{LinkTiming{}, StopLatch(1, {})};
  LinkObservation seen{
      .partner_age_s = 0.001, .echoes_other_session = true, .partner = kCoupled, .poses_agree = true};
  for (int i = 0; i < 500; ++i) EXPECT_EQ(monitor.step(seen, 0.001).state, kInit);
  seen.echoes_other_session = false;
  for (int i = 0; i < 500; ++i) monitor.step(seen, 0.001);
  ASSERT_EQ(monitor.state(), kCoupled);
  seen.echoes_other_session = true;
  EXPECT_EQ(monitor.step(seen, 0.001).state, LinkState::kDegraded);
}

// Tries slave_io: the master works with another arm or cell
// Tries master_io: the slave works with another arm or cell
TEST(LinkMonitor, SR21_WithAnotherArmNothingIsCoupledAndAStopIsHeeded) {
  LinkMonitor monitor{LinkTiming{}, StopLatch(1, {})};
  LinkObservation seen{.partner_age_s = 0.001, .other_model = true, .partner = kCoupled, .poses_agree = true};
  for (int i = 0; i < 500; ++i) EXPECT_EQ(monitor.step(seen, 0.001).state, kInit);
  seen.other_model = false;
  for (int i = 0; i < 500; ++i) monitor.step(seen, 0.001);
  ASSERT_EQ(monitor.state(), kCoupled);
  seen.other_model = true;
  EXPECT_EQ(monitor.step(seen, 0.001).state, LinkState::kDegraded);
  seen.partner = kStopped;
  seen.partner_stop = 7;
  EXPECT_EQ(monitor.step(seen, 0.001).state, kStopped);
}

TEST(LinkMonitor, SR02_SR03_AStopOfOneSideStopsBothUntilAResetNamesBoth) {
  Pair pair;
  pair.run(0.5, true, true);
  pair.master_stops = 1;
  pair.run(0.003, true, true);
  EXPECT_EQ(pair.master.state(), kStopped);
  EXPECT_EQ(pair.slave.state(), kStopped);
  EXPECT_EQ(pair.slave.stop().cause, StopCause::kPartner);
  pair.run(0.5, true, true);
  EXPECT_EQ(pair.master.state(), kStopped);
  pair.reset();
  pair.run(0.5, true, true);
  EXPECT_EQ(pair.master.state(), kCoupled);
  EXPECT_EQ(pair.slave.state(), kCoupled);
}

// Others take a while to be found by a process that starts.
TEST(LinkMonitor, AStopFromBeforeTheStartIsNotShoutedAboutBeforeThePartnerIsHeard) {
  LinkMonitor monitor{LinkTiming{}, StopLatch(1, {77, StopCause::kEmergency})};
  LinkObservation seen;
  for (int i = 0; i < 5000; ++i) ASSERT_FALSE(monitor.step(seen, 0.001).partner_unconfirmed);
  seen.partner_age_s = 0.001;
  seen.partner = kReady;
  for (int i = 0; i < 1000; ++i) monitor.step(seen, 0.001);
  EXPECT_TRUE(monitor.step(seen, 0.001).partner_unconfirmed);
}

// The cable is out while somebody stops the master: the slave hears of it before it does anything else.
TEST(LinkMonitor, SR02_AStopWhileTheCableWasOutIsInForceOnBothSidesOnceItIsBack) {
  Pair pair;
  pair.run(0.5, true, true);
  pair.run(8.0, false, true);
  pair.master_stops = 1;
  pair.run(0.1, false, true);
  ASSERT_EQ(pair.master.state(), kStopped);
  ASSERT_EQ(pair.slave.state(), kDegraded);
  for (int ms = 0; ms < 3000; ++ms) {
    pair.run(0.001, true, true);
    ASSERT_EQ(pair.slave.state(), kStopped) << ms << " ms after";
  }
}

}  // namespace
}  // namespace phantom::teleop
