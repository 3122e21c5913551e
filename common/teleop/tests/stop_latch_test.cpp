#include "common/teleop/coupling/stop_latch.hpp"

#include <gtest/gtest.h>

#include <array>
#include <deque>
#include <limits>
#include <optional>
#include <random>
#include <set>

#include "common/teleop/coupling/link_state.hpp"

namespace phantom::teleop {
namespace {

using enum LinkState;

StopRecord after(StopLatch& latch, const StopSigns& signs) {
  latch.step(signs);
  return latch.record();
}

TEST(StopLatch, SR01_EachRequestAndEachFaultIsAStopOfItsOwn) {
  StopLatch latch(1, {});
  EXPECT_FALSE(latch.stopped());
  std::set<StopId> ids;
  for (std::uint32_t requests = 1; requests <= 100; ++requests) {
    ids.insert(after(latch, {.requests = requests}).id);
    EXPECT_EQ(after(latch, {.requests = requests}).id, latch.record().id)
        << "the same as long as nothing is new";
  }
  ids.insert(after(latch, {.requests = 100, .drive_fault = true}).id);
  after(latch, {.requests = 100});
  ids.insert(after(latch, {.requests = 100, .drive_fault = true}).id);
  EXPECT_EQ(ids.size(), 102U);
  EXPECT_EQ(ids.count(0), 0U);
  EXPECT_EQ(latch.record().cause, StopCause::kEmergency)
      << "somebody pressed the button: that is what counts";
}

TEST(StopLatch, SR03_AResetReleasesTheStopThatItNamesAndNoOther) {
  StopLatch latch(2, {});
  const StopId first = after(latch, {.requests = 1}).id;
  const StopId second = after(latch, {.requests = 2}).id;
  for (const StopId wrong : {StopId{0}, first, second + 1}) {
    const StopReset reset{.own = wrong};
    EXPECT_EQ(latch.step({.requests = 2, .reset = &reset}), ResetOutcome::kRefused);
    EXPECT_EQ(latch.record().id, second);
  }
  const StopReset reset{.own = second};
  EXPECT_EQ(latch.step({.requests = 2, .reset = &reset}), ResetOutcome::kReleased);
  EXPECT_FALSE(latch.stopped());
}

// Requests are read once a tick: whatever came between two ticks, a stop is never undone by what came with
// it.
TEST(StopLatch, SR01_SR03_AStopAndAResetInOneTickStop) {
  StopLatch latch(3, {});
  const StopReset nothing_to_release{};
  latch.step({.requests = 1, .reset = &nothing_to_release});
  EXPECT_TRUE(latch.stopped());
  const StopReset the_first{.own = latch.record().id};
  latch.step({.requests = 2, .reset = &the_first});
  EXPECT_TRUE(latch.stopped()) << "the second stop is a later one";
}

TEST(StopLatch, SR05_AResetDuringAFaultReleasesWhenTheFaultIsGone) {
  StopLatch latch(4, {});
  const StopReset reset{.own = after(latch, {.drive_fault = true}).id};
  EXPECT_EQ(latch.step({.drive_fault = true, .reset = &reset}), ResetOutcome::kReleased);
  EXPECT_EQ(latch.record().id, reset.own);
  EXPECT_EQ(latch.record().cause, StopCause::kDriveFault);
  EXPECT_FALSE(after(latch, {}).id != 0);
  EXPECT_TRUE(after(latch, {.drive_fault = true}).id != reset.own) << "the next fault is another stop";
}

TEST(StopLatch, SR02_APartnersStopStopsUnlessAResetHasNamedIt) {
  StopLatch latch(5, {});
  const StopId own = after(latch, {.partner_stopped = true, .partner_stop = 77}).id;
  EXPECT_NE(own, 0U);
  EXPECT_EQ(latch.record().cause, StopCause::kPartner);
  EXPECT_EQ(after(latch, {}).id, own) << "it stays when the partner goes on";
  const StopReset does_not_know{.own = own};
  latch.step({.partner_stopped = true, .partner_stop = 77, .reset = &does_not_know});
  EXPECT_TRUE(latch.stopped()) << "the partner's stop was not named";
  const StopReset names_both{.own = latch.record().id, .partner = 77};
  latch.step({.partner_stopped = true, .partner_stop = 77, .reset = &names_both});
  EXPECT_FALSE(latch.stopped());
  EXPECT_EQ(after(latch, {.partner_stopped = true, .partner_stop = 77}).id, 0U)
      << "it is on its way to release it";
  EXPECT_NE(after(latch, {.partner_stopped = true, .partner_stop = 78}).id, 0U) << "that one is new";
}

TEST(StopLatch, SR02_APartnerThatIsStoppedWithoutANameStops) {
  StopLatch latch(6, {});
  EXPECT_NE(after(latch, {.partner_stopped = true, .partner_stop = 0}).id, 0U);
}

TEST(StopLatch, SR03_OutlivesItsProcess) {
  StopLatch before(7, {});
  const StopRecord kept = after(before, {.requests = 1});
  StopLatch now(8, kept);
  EXPECT_EQ(now.record(), kept);
  EXPECT_EQ(after(now, {}), kept) << "this process was asked for none yet";
  const StopReset reset{.own = kept.id};
  now.step({.reset = &reset});
  EXPECT_FALSE(now.stopped());
}

// Two sides with nothing between them but a wire that delays, loses and is cut, processes that are killed and
// started again, people who stop, and who reset what they see. The judge knows every stop that was ever in
// force and which of them were named by a reset.
class Cell {
 public:
  explicit Cell(unsigned seed) : random_(seed) {
    for (Side& side : sides_) start(side);
  }

  void step() {
    if (chance(300)) cut_ = !cut_;
    for (std::size_t s = 0; s < 2; ++s) {
      Side& side = sides_[s];
      if (chance(500)) start(side);  // killed: what it knew is gone, but for what was kept
      if (chance(400)) ++side.requests;
      if (chance(400)) side.fault = !side.fault;
      if (chance(150)) look(side);
      if (chance(150)) side.asked.push_back(named(s));
    }
    const std::array<Word, 2> words{word(sides_[0]), word(sides_[1])};
    for (std::size_t s = 0; s < 2; ++s) {
      hear(sides_[s], words[1 - s]);
      tick(sides_[s], s);
    }
  }
  /// From now on nobody stops anything, and people reset what they see until nothing is stopped.
  bool settles() {
    cut_ = false;
    for (Side& side : sides_) side.fault = false;
    for (int i = 0; i < 400; ++i) {
      if (i % 20 == 10) {
        for (Side& side : sides_) look(side);
        for (std::size_t s = 0; s < 2; ++s) sides_[s].asked.push_back(named(s));
      }
      const std::array<Word, 2> words{word(sides_[0]), word(sides_[1])};
      for (std::size_t s = 0; s < 2; ++s) {
        hear(sides_[s], words[1 - s]);
        tick(sides_[s], s);
      }
    }
    return sides_[0].monitor->state() == kCoupled && sides_[1].monitor->state() == kCoupled;
  }
  int releases = 0, couplings = 0;

 private:
  struct Word {
    LinkState state = kInit;
    StopId stop = 0;
  };
  struct Side {
    std::optional<LinkMonitor> monitor;
    StopRecord kept;
    std::deque<std::optional<Word>> wire;  // what the other side said, on its way here
    std::optional<Word> heard;
    double age_s = 1e9;
    std::uint32_t requests = 0, requests_given = 0;
    bool fault = false;
    StopId seen_by_people = 0;
    std::deque<StopReset> asked;
  };

  bool chance(unsigned one_in) { return random_() % one_in == 0; }
  void start(Side& side) {
    side.monitor.emplace(LinkTiming{.staleness_s = 0.01, .align_hold_s = 0.002, .recovery_s = 0.005},
                         StopLatch(random_(), side.kept));
    side.heard.reset();
    side.age_s = 1e9;
    side.requests = side.requests_given = 0;
    side.asked.clear();
  }
  void look(Side& side) { side.seen_by_people = side.monitor->stop().id; }
  StopReset named(std::size_t s) const { return {sides_[s].seen_by_people, sides_[1 - s].seen_by_people}; }
  static Word word(const Side& side) { return {side.monitor->state(), side.monitor->stop().id}; }
  void hear(Side& side, const Word& said) {
    const bool lost = cut_ || chance(3);
    side.wire.push_back(lost ? std::nullopt : std::optional(said));
    side.age_s += 0.001;
    while (side.wire.size() > 1 + random_() % 4) {
      if (const auto arrived = side.wire.front()) {
        side.heard = arrived;
        side.age_s = 0.001;
      }
      side.wire.pop_front();
    }
  }
  void tick(Side& side, std::size_t s) {
    std::optional<StopReset> reset;
    if (!side.asked.empty()) {
      reset = side.asked.front();
      side.asked.pop_front();
    }
    const StopRecord before = side.monitor->stop();
    const LinkState state_before = side.monitor->state();
    const bool asked_anew = side.requests != side.requests_given;
    side.requests_given = side.requests;
    const auto decision = side.monitor->step(
        {.partner_age_s = side.heard ? side.age_s : std::numeric_limits<double>::infinity(),
         .partner = side.heard ? side.heard->state : kInit,
         .partner_stop = side.heard ? side.heard->stop : 0,
         .poses_agree = true,
         .stop_requests = side.requests,
         .reset = reset ? &*reset : nullptr,
         .drive_fault = side.fault},
        0.001);
    side.kept = decision.stop;
    if (reset && reset->own == before.id) named_[s].insert(before.id);
    if (before.id != 0 && decision.stop.id == 0) {
      ++releases;
      EXPECT_TRUE(named_[s].contains(before.id)) << "a stop ended that no reset named";
    }
    if (asked_anew) {
      EXPECT_TRUE(decision.stop.id != 0 && decision.stop.id != before.id) << "a stop was lost";
    }
    EXPECT_EQ(decision.state == kStopped, decision.stop.id != 0);
    EXPECT_FALSE(decision.power && decision.stop.id != 0);
    if (decision.state == kAligned || decision.state == kCoupled) {
      EXPECT_NE(side.heard->state, kStopped) << "with a partner that is stopped";
      EXPECT_FALSE(side.fault);
    }
    if (decision.state == kCoupled && state_before != kCoupled) {
      EXPECT_EQ(state_before, kAligned);
      ++couplings;
    }
  }

  std::mt19937 random_;
  bool cut_ = false;
  std::array<Side, 2> sides_;
  std::array<std::set<StopId>, 2> named_;
};

TEST(StopLatch, SR03_SR09_NoStopEverEndsUnnamedWhateverTheWireAndTheProcessesDo) {
  int releases = 0, couplings = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    Cell cell(seed);
    for (int i = 0; i < 30'000; ++i) cell.step();
    ASSERT_FALSE(testing::Test::HasFailure()) << "seed " << seed;
    EXPECT_TRUE(cell.settles()) << "seed " << seed << ": there is a way out by a person";
    releases += cell.releases;
    couplings += cell.couplings;
  }
  EXPECT_GT(releases, 1000) << "the test has seen what it is about";
  EXPECT_GT(couplings, 400);
}

}  // namespace
}  // namespace phantom::teleop
