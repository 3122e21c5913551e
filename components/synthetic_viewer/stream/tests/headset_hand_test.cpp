// A headset's controller as the hand: what is believed of it, whose it is, and what the handle does.
#include "components/synthetic_viewer/stream/headset_hand.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "components/synthetic_viewer/stream/tests/hand_messages.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::synthetic_viewer {
namespace {

using Eigen::Vector3d;
using test::hand_message;
using test::HandMessage;
using testing::HasSubstr;

constexpr std::uint64_t kPage = 1, kOther = 2;
constexpr core::Nanoseconds kHandPeriod = 2 * core::kNsPerMillisecond;

/// A base that is turned: about z by 90°, so that its x is W's y.
Eigen::Matrix3d turned_base() { return geometry::rotation_from_vector({0, 0, M_PI_2}); }

class Hand : public testing::Test {
 protected:
  /// Runs for `ms`; the page sends every 12 ms how the hand goes on.
  void run(int ms, const Vector3d& velocity_m_s = Vector3d::Zero(),
           const Vector3d& turn_rad_s = Vector3d::Zero()) {
    for (int k = 0; k < ms / 2; ++k) {
      now_ += kHandPeriod;
      message_.position_m += 0.002 * velocity_m_s;
      message_.R_WC = geometry::rotation_from_vector(0.002 * turn_rad_s) * message_.R_WC;
      if (sends_ && k % 6 == 0) {
        EXPECT_TRUE(send()) << send_status_.message();
      }
      const geometry::Pose before = handle_.hand.pose;
      handle_ = hand_.step(felt_, 0.002, now_);
      EXPECT_LT(
          (handle_.hand.pose.translation_m - before.translation_m - 0.002 * handle_.hand.twist.head<3>())
              .norm(),
          1e-12)
          << "it jumps nowhere";
    }
  }
  bool send() {
    ++message_.number;
    message_.page_s = core::seconds(now_) - 900.0;
    send_status_ = hand_.take(kPage, hand_message(message_), now_);
    return send_status_.operator bool();
  }
  void grip(bool held) {
    message_.grip = held;
    run(12);
  }
  /// The hand is held, seen let go, and leads.
  void lead() {
    ASSERT_TRUE(hand_.claim(kPage, now_));
    run(60);
    ASSERT_EQ(word(), "ready");
    grip(true);
    ASSERT_EQ(word(), "leads");
  }
  std::string word(std::uint64_t page = kPage) const { return name_of(hand_.word(page)); }
  /// Nothing leads; the handle stands.
  void expect_let_go(const std::string& why) {
    EXPECT_EQ(word(), why);
    EXPECT_FALSE(handle_.hand.clutch);
    EXPECT_FALSE(handle_.hand.valid) << "master_io lets go at the sample";
  }
  /// It leads again only once the button was let go.
  void expect_back_only_after_the_button_was_let_go() {
    run(100);
    EXPECT_FALSE(handle_.hand.clutch) << "the button was held all the time";
    EXPECT_THAT(word(), testing::AnyOf("clutch_in", "jumped"));
    grip(false);
    run(40);
    EXPECT_TRUE(handle_.hand.valid);
    grip(true);
    EXPECT_TRUE(handle_.hand.clutch) << word();
  }

  HeadsetHand hand_{0.1, turned_base()};
  HeadsetHand::Felt felt_{robot::Spatial::Zero(), true, true};
  HeadsetHand::Handle handle_;
  HandMessage message_;
  core::Status send_status_ = core::Status::ok();
  bool sends_ = true;
  core::Nanoseconds now_ = 1000 * core::kNsPerSecond;
};

TEST_F(Hand, MovesTheHandleInTheAxesOfTheBaseAsFarAsTheHandMoves) {
  lead();
  run(400, {0.3, 0.1, -0.2}, {0, 0, 0.5});
  run(400);  // it has come to where the hand is
  const Vector3d moved = handle_.hand.pose.translation_m;
  EXPECT_NEAR(moved.x(), 0.04, 1e-4) << "along the base's x lies W's y";
  EXPECT_NEAR(moved.y(), -0.12, 1e-4);
  EXPECT_NEAR(moved.z(), -0.08, 1e-4);
  const Vector3d turned = geometry::rotation_vector(handle_.hand.pose.rotation);
  EXPECT_NEAR(turned.z(), 0.2, 1e-3);
  EXPECT_LT(turned.head<2>().norm(), 1e-6);
  EXPECT_LT(handle_.hand.twist.norm(), 1e-3);
}

TEST_F(Hand, FollowsWithoutLagAtASteadySpeed) {
  lead();
  const Vector3d begun = message_.position_m;
  run(600, {0.4, 0, 0});
  const double hand_m = (message_.position_m - begun).x(), handle_m = -handle_.hand.pose.translation_m.y();
  EXPECT_NEAR(hand_m - handle_m, 0.0, 0.4 * 0.015) << "one frame of the headset behind";
  EXPECT_NEAR(handle_.hand.twist[1], -0.4, 0.02);
}

TEST_F(Hand, MovesNothingWhileTheButtonIsLetGoAndGoesOnFromWhereItStands) {
  lead();
  run(200, {0, 0, 0.2});
  grip(false);
  run(100);
  const Vector3d stands = handle_.hand.pose.translation_m;
  run(600, {0, 0.5, 0});
  EXPECT_LT((handle_.hand.pose.translation_m - stands).norm(), 1e-6) << "the hand goes elsewhere";
  EXPECT_TRUE(handle_.hand.valid);
  EXPECT_FALSE(handle_.hand.clutch);
  grip(true);
  EXPECT_TRUE(handle_.hand.clutch);
  run(200);
  EXPECT_LT((handle_.hand.pose.translation_m - stands).norm(), 1e-6) << "nothing jumps";
}

// Tries synthetic_viewer: a controller that leads is not tracked
TEST_F(Hand, LetsGoAtOnceOfAControllerThatIsNotTracked) {
  lead();
  run(100, {0.2, 0, 0});
  message_.tracked = false;
  run(2, {0.2, 0, 0});
  expect_let_go("untracked");
  message_.tracked = true;
  message_.position_m.x() += 0.5;  // wherever it comes back
  expect_back_only_after_the_button_was_let_go();
}

// Tries synthetic_viewer: no poses come of a controller that leads
TEST_F(Hand, LetsGoOfAPageThatIsSilentWithinItsTime) {
  lead();
  run(120, {0.2, 0, 0});
  sends_ = false;
  run(100);
  int lasted_ms = 100;
  while (handle_.hand.clutch && lasted_ms < 1000) run(2), lasted_ms += 2;
  EXPECT_LE(lasted_ms, 104);
  expect_let_go("silent");
  sends_ = true;
  expect_back_only_after_the_button_was_let_go();
  sends_ = false;
  run(1900);
  EXPECT_FALSE(hand_.claim(kOther, now_)) << "it may come back";
  run(200);
  EXPECT_EQ(word(), "free");
  EXPECT_TRUE(hand_.claim(kOther, now_));
  EXPECT_EQ(word(), "elsewhere");
}

// Tries synthetic_viewer: its poses were held up
TEST_F(Hand, LetsGoOfPosesThatWereHeldUp) {
  lead();
  run(100, {0.2, 0, 0});
  for (int k = 0; k < 8; ++k) {  // what was held up comes at once, and goes on so
    now_ += 10 * kHandPeriod;
    ++message_.number;
    message_.page_s += 0.001;
    message_.position_m.x() += 0.01;
    EXPECT_TRUE(hand_.take(kPage, hand_message(message_), now_));
    handle_ = hand_.step(felt_, 0.02, now_);
  }
  expect_let_go("late");
  expect_back_only_after_the_button_was_let_go();
}

// Tries synthetic_viewer: its pose jumps
TEST_F(Hand, LetsGoOfAPoseThatJumps) {
  lead();
  run(100, {0.2, 0, 0});
  const Vector3d before = handle_.hand.pose.translation_m;
  message_.position_m.y() += 0.3;
  run(2);
  expect_let_go("jumped");
  run(100);
  EXPECT_LT((handle_.hand.pose.translation_m - before).norm(), 0.01);
  expect_back_only_after_the_button_was_let_go();
  message_.R_WC = geometry::rotation_from_vector({1.0, 0, 0}) * message_.R_WC;
  run(2);
  expect_let_go("jumped");
}

// Tries synthetic_viewer: a second page asks for the hand
TEST_F(Hand, IsOfOnePageAtATimeUntilThatGoes) {
  lead();
  EXPECT_FALSE(hand_.claim(kOther, now_));
  EXPECT_EQ(word(kOther), "elsewhere");
  HandMessage foreign;
  foreign.position_m.x() = 0.5;
  EXPECT_TRUE(hand_.take(kOther, hand_message(foreign), now_));
  hand_.leave(kOther);
  run(20);
  EXPECT_EQ(word(), "leads") << "what others send is nothing";
  hand_.leave(kPage);
  sends_ = false;
  run(2);
  expect_let_go("free");
  EXPECT_TRUE(hand_.claim(kOther, now_));
  EXPECT_EQ(word(kOther), "clutch_in");
}

// Tries synthetic_viewer: master_io does not take the hand
TEST_F(Hand, MovesNothingThatWasHeldWhileMasterIoDidNotTakeIt) {
  lead();
  felt_.taken = felt_.leads = false;
  run(200, {0.1, 0, 0});
  EXPECT_EQ(word(), "not_taken");
  EXPECT_FALSE(handle_.hand.clutch);
  EXPECT_TRUE(handle_.hand.valid) << "so that it can be taken";
  felt_.taken = true;
  run(100, {0.1, 0, 0});
  EXPECT_FALSE(handle_.hand.clutch);
  EXPECT_EQ(word(), "clutch_in");
  grip(false);
  grip(true);
  EXPECT_TRUE(handle_.hand.clutch);
  EXPECT_EQ(word(), "not_coupled");
}

TEST_F(Hand, IsAtRestWhileNobodyHasItAndNoClutchCanBeFading) {
  sends_ = false;
  run(2);
  EXPECT_EQ(word(), "free");
  EXPECT_TRUE(handle_.hand.valid) << "a session is ready before somebody has put the headset on";
  EXPECT_FALSE(handle_.hand.clutch);
  EXPECT_EQ(handle_.grip_opening, -1.0);
  ASSERT_TRUE(hand_.claim(kPage, now_));
  run(2);
  EXPECT_FALSE(handle_.hand.valid) << "until its button was seen let go";
  sends_ = true;
  lead();
  hand_.leave(kPage);
  sends_ = false;
  run(2400);
  expect_let_go("free");
  run(200);
  EXPECT_TRUE(handle_.hand.valid);
  EXPECT_FALSE(handle_.hand.clutch);
}

TEST_F(Hand, BeginsWithTheButtonLetGo) {
  ASSERT_TRUE(hand_.claim(kPage, now_));
  message_.grip = true;
  run(200, {0.1, 0, 0});
  EXPECT_FALSE(handle_.hand.clutch);
  EXPECT_EQ(word(), "clutch_in");
}

TEST_F(Hand, IsSlowedDownByDragAndDoesNotGoOnOnceTheHandStands) {
  lead();
  felt_.wrench[1] = 8.0;  // against the motion along the base's −y
  run(600, {0.3, 0, 0});
  const double behind_m = (message_.position_m.x() - 0.0) + handle_.hand.pose.translation_m.y();
  EXPECT_NEAR(behind_m, 8.0 / 1600.0, 0.006) << "the spring of the hand";
  felt_.wrench[1] = 0.0;
  run(100, {4.0, 0, 0});  // faster than the handle may be
  const double left_m = handle_.hand.pose.translation_m.y();
  run(400);
  EXPECT_LT(std::abs(handle_.hand.pose.translation_m.y() - left_m), 0.055);
  felt_.wrench.setConstant(std::numeric_limits<double>::quiet_NaN());
  run(20, {0.1, 0, 0});
  EXPECT_TRUE(handle_.hand.twist.allFinite());
}

TEST_F(Hand, TellsHowFarTheTriggerIsPulled) {
  lead();
  message_.trigger = 0.25;
  run(20);
  EXPECT_NEAR(handle_.grip_opening, 0.75, 1e-4);
}

// Tries synthetic_viewer: a message of the hand that is none
TEST_F(Hand, RefusesWhatIsNoPose) {
  const auto refused = [](const std::string& octets) { return controller_pose(octets).status().message(); };
  const std::string good = hand_message({});
  EXPECT_TRUE(controller_pose(good));
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_THAT(refused(good.substr(0, size)), HasSubstr("44 octets")) << size;
  EXPECT_THAT(refused(good + 'x'), HasSubstr("44 octets"));
  EXPECT_THAT(refused('\1' + good.substr(1)), HasSubstr("the first 3"));
  EXPECT_THAT(refused(good.substr(0, 1) + '\4' + good.substr(2)), HasSubstr("unknown flag"));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    HandMessage message;
    message.position_m.y() = bad;
    EXPECT_THAT(refused(hand_message(message)), HasSubstr("a number that is none"));
    message = {};
    message.page_s = bad;
    EXPECT_THAT(refused(hand_message(message)), HasSubstr("a number that is none"));
    message = {};
    message.R_WC(0, 0) = bad;
    EXPECT_NE(refused(hand_message(message)), "");
  }
  HandMessage far;
  far.position_m.z() = -10.5;
  EXPECT_THAT(refused(hand_message(far)), HasSubstr("10 m"));
  std::string no_turn = good;
  no_turn.replace(28, 16, 16, '\0');
  EXPECT_THAT(refused(no_turn), HasSubstr("quaternion"));

  lead();
  message_.number = 0;  // does not rise
  EXPECT_FALSE(send());
  EXPECT_THAT(send_status_.message(), HasSubstr("to rise"));
  sends_ = false;
  run(2);
  expect_let_go("free");
}

TEST_F(Hand, StepsWithoutTheHeap) {
  lead();
  const phantom::test::HeapGuard guard;
  hand_.step(felt_, 0.05, now_);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
