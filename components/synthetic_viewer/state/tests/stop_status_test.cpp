#include "components/synthetic_viewer/state/stop_status.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "components/synthetic_viewer/page/page_state.hpp"

namespace phantom::synthetic_viewer {
namespace {

using teleop::Side;
using Level = SideView::Level;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr core::Nanoseconds kMs = core::kNsPerMillisecond, kStart_ns = 100 * core::kNsPerSecond;

class Stops : public ::testing::Test {
 protected:
  void heard(Side side, LinkState link, core::Nanoseconds at_ns, StopCause cause = StopCause::kNone) {
    board_.take_state(side, link, cause, link == LinkState::kStopped ? 77 : 0, at_ns);
  }
  void both_coupled(core::Nanoseconds at_ns) {
    for (const Side side : teleop::kSides) heard(side, LinkState::kCoupled, at_ns);
  }
  static const SideView& of(const StopView& view, Side side) {
    return view.sides[static_cast<std::size_t>(side)];
  }
  StopStatus board_;
};

TEST_F(Stops, NothingIsSaidWhileNobodyStops) {
  both_coupled(kStart_ns);
  EXPECT_EQ(board_.at(kStart_ns + 10 * kMs), StopView());
}

// Tries synthetic_viewer: a stop that nobody confirms
TEST_F(Stops, SR15_ASideThatHasNotConfirmedIsShoutedAfterThreeTenthsOfASecondAndForAsLongAsItTakes) {
  both_coupled(kStart_ns);
  teleop::CommandAnswers request(true, true, kStart_ns);
  board_.take_request(request);
  EXPECT_FALSE(board_.at(kStart_ns + 200 * kMs).alarm);
  EXPECT_EQ(board_.at(kStart_ns + 200 * kMs).headline, "STOPPING");
  request.take_reply(Side::kMaster, true, "stopped");
  board_.take_request(request);
  for (const core::Nanoseconds later_ns : {301 * kMs, 3600 * core::kNsPerSecond}) {
    const core::Nanoseconds now_ns = kStart_ns + later_ns;
    heard(Side::kMaster, LinkState::kStopped, now_ns, StopCause::kEmergency);
    heard(Side::kSlave, LinkState::kCoupled, now_ns);
    const StopView view = board_.at(now_ns);
    EXPECT_TRUE(view.in_force);
    EXPECT_TRUE(view.alarm);
    EXPECT_EQ(view.headline, "STOP NOT CONFIRMED");
    EXPECT_EQ(sides_text(view), "master: stopped (emergency stop) | slave: HAS NOT CONFIRMED THE STOP");
    EXPECT_EQ(of(view, Side::kMaster).level, Level::kStopped);
  }
  board_.take_request(std::nullopt);
  heard(Side::kSlave, LinkState::kStopped, kStart_ns + core::kNsPerSecond, StopCause::kEmergency);
  EXPECT_FALSE(board_.at(kStart_ns + core::kNsPerSecond).alarm);
}

// The viewer alone in the domain.
// Tries synthetic_viewer: a stop that nobody confirms
TEST_F(Stops, AStopThatNobodyHearsIsShoutedOfBoth) {
  board_.take_request(teleop::CommandAnswers(true, true, kStart_ns));
  const StopView view = board_.at(kStart_ns + 301 * kMs);
  EXPECT_TRUE(view.alarm);
  for (const Side side : teleop::kSides)
    EXPECT_EQ(of(view, side).text, "HAS NOT CONFIRMED THE STOP (never heard)");
}

TEST_F(Stops, ARefusedStopIsShoutedWithItsReason) {
  both_coupled(kStart_ns);
  teleop::CommandAnswers request(true, true, kStart_ns);
  request.take_reply(Side::kSlave, false, "the drives do not answer");
  board_.take_request(request);
  both_coupled(kStart_ns + 350 * kMs);
  EXPECT_EQ(of(board_.at(kStart_ns + 350 * kMs), Side::kSlave).text,
            "REFUSED THE STOP: the drives do not answer");
}

// By key, signal, another page or a drives' fault: the viewer did not ask.
// Tries synthetic_viewer: a side stops
TEST_F(Stops, AStopOfOneSideIsShoutedOnceTheOtherShouldHaveFollowed) {
  both_coupled(kStart_ns);
  heard(Side::kSlave, LinkState::kStopped, kStart_ns, StopCause::kDriveFault);
  heard(Side::kMaster, LinkState::kCoupled, kStart_ns + 250 * kMs);
  EXPECT_FALSE(board_.at(kStart_ns + 250 * kMs).alarm);
  EXPECT_EQ(board_.at(kStart_ns + 250 * kMs).headline, "STOPPED: the arm's drives are in fault");
  heard(Side::kMaster, LinkState::kCoupled, kStart_ns + 350 * kMs);
  heard(Side::kSlave, LinkState::kStopped, kStart_ns + 350 * kMs, StopCause::kDriveFault);
  const StopView view = board_.at(kStart_ns + 350 * kMs);
  EXPECT_TRUE(view.alarm);
  EXPECT_EQ(view.headline, "ONLY ONE SIDE IS STOPPED");
  EXPECT_EQ(of(view, Side::kMaster).text, "IS NOT STOPPED (COUPLED)");
  heard(Side::kMaster, LinkState::kStopped, kStart_ns + 400 * kMs, StopCause::kPartner);
  EXPECT_FALSE(board_.at(kStart_ns + 400 * kMs).alarm);
  EXPECT_EQ(of(board_.at(kStart_ns + 400 * kMs), Side::kMaster).text, "stopped (because the other side is)");
}

// Both are reset; one is a moment later than the other.
TEST_F(Stops, AResetDoesNotRaiseTheAlarmBetweenTheSides) {
  for (const Side side : teleop::kSides) heard(side, LinkState::kStopped, kStart_ns, StopCause::kEmergency);
  const core::Nanoseconds hour_ns = kStart_ns + 3600 * core::kNsPerSecond;
  heard(Side::kMaster, LinkState::kInit, hour_ns);
  heard(Side::kSlave, LinkState::kStopped, hour_ns, StopCause::kEmergency);
  EXPECT_FALSE(board_.at(hour_ns + 20 * kMs).alarm);
  heard(Side::kSlave, LinkState::kInit, hour_ns + 30 * kMs);
  EXPECT_FALSE(board_.at(hour_ns + 40 * kMs).in_force);
}

TEST_F(Stops, SR15_ASideThatIsSilentMayNotBeStopped) {
  both_coupled(kStart_ns);
  const core::Nanoseconds later_ns = kStart_ns + 5 * core::kNsPerSecond;
  heard(Side::kMaster, LinkState::kStopped, later_ns, StopCause::kEmergency);
  const StopView view = board_.at(later_ns);
  EXPECT_TRUE(view.alarm);
  EXPECT_EQ(view.headline, "STOP NOT CONFIRMED");
  EXPECT_EQ(of(view, Side::kSlave).text, "MAY NOT BE STOPPED (silent for 5 s)");
}

TEST_F(Stops, SR03_ResetsNameTheStopsOfTheNewestStates) {
  EXPECT_EQ(board_.stop_of(Side::kSlave), 0U);
  heard(Side::kSlave, LinkState::kStopped, kStart_ns);
  EXPECT_EQ(board_.stop_of(Side::kSlave), 77U);
  EXPECT_EQ(board_.stop_of(Side::kMaster), 0U);
  heard(Side::kSlave, LinkState::kInit, kStart_ns + kMs);
  EXPECT_EQ(board_.stop_of(Side::kSlave), 0U);
}

TEST_F(Stops, ASecondProcessIsToldOfWhileItIsThere) {
  board_.take_second("slave_state", kStart_ns);
  EXPECT_THAT(board_.at(kStart_ns + kMs).notices,
              ElementsAre("two processes send slave_state: only the first is heeded; end one of them"));
  EXPECT_FALSE(board_.at(kStart_ns + kMs).in_force);
  EXPECT_TRUE(board_.at(kStart_ns + 3 * core::kNsPerSecond).notices.empty());
}

// Tries synthetic_viewer: two processes send one topic
TEST_F(Stops, ThePictureSaysTheSameInItsBanner) {
  ViewerState state;
  board_.take_request(teleop::CommandAnswers(true, true, kStart_ns));
  state.stops = board_.at(kStart_ns + 301 * kMs);
  EXPECT_THAT(banner_text(state, {}, kStart_ns), HasSubstr("STOP NOT CONFIRMED\nmaster: HAS NOT CONFIRMED"));
  EXPECT_THAT(
      banner_text(state, {}, kStart_ns, Language::kGerman),
      HasSubstr("HALT NICHT BESTÄTIGT\nBedienarm: HAT DEN HALT NICHT BESTÄTIGT (hat sich nie gemeldet)"));
  state.stops = {};
  state.stops.notice_words = {{"notice.more", {}}};
  EXPECT_EQ(banner_text(state, {}, kStart_ns), "more processes than these send what only one may send");
}

TEST_F(Stops, ThePageIsToldAllOfIt) {
  both_coupled(kStart_ns);
  board_.take_second("percept", kStart_ns);
  board_.take_request(teleop::CommandAnswers(true, true, kStart_ns));
  const auto json = nlohmann::json::parse(stop_json(board_.at(kStart_ns + 301 * kMs)));
  EXPECT_TRUE(json.at("in_force"));
  EXPECT_TRUE(json.at("alarm"));
  EXPECT_EQ(json.at("headline"), "STOP NOT CONFIRMED");
  EXPECT_EQ(json.at("sides").at("slave").at("level"), "alarm");
  EXPECT_EQ(json.at("sides").at("slave").at("text"), "HAS NOT CONFIRMED THE STOP");
  EXPECT_EQ(json.at("notices").size(), 1U);
}

TEST(StopStatus, NamesFromTheNetworkDoNotMakeItGrow) {
  StopStatus board;
  for (int i = 0; i < 10'000; ++i) board.take_second("component_status as x@" + std::to_string(i), 1'000);
  ASSERT_EQ(board.at(1'001).notices.size(), StopStatus::kMaxSeconds + 1);
  EXPECT_EQ(board.at(1'001).notices.back(), "more processes than these send what only one may send");
  EXPECT_EQ(board.forgotten(), 10'000 - StopStatus::kMaxSeconds);
  const core::Nanoseconds later_ns = 1'000 + StopStatus::kSecond_ns;
  board.take_second("percept", later_ns);
  EXPECT_EQ(board.at(later_ns + 1).notices.size(), 1U);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
