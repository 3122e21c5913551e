#include "components/ros2_gateway/twist_master.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "tests/support/heap_guard.hpp"

namespace phantom::ros2_gateway {
namespace {

using testing::HasSubstr;
constexpr core::Nanoseconds kMillisecond = core::kNsPerMillisecond;
constexpr core::Nanoseconds kUtc = 1'700'000'000 * core::kNsPerSecond;  // minus the monotonic time
using Axes = std::array<double, 3>;

class TwistMasterTest : public testing::Test {
 protected:
  core::Status twist(const Axes& linear, const Axes& angular = {}, std::uint8_t publisher = 1) {
    return master_.take_twist({kUtc + now_, {publisher}}, linear, angular, now_, kUtc + now_);
  }
  /// Commands for `ms`, every 10 ms, or not at all; the handle is stepped every 2 ms.
  void run(int ms, const Axes* linear = nullptr, const robot::Spatial& wrench = robot::Spatial::Zero(),
           const Axes& angular = {}) {
    for (int k = 0; k < ms / 2; ++k) {
      now_ += 2 * kMillisecond;
      if (linear != nullptr && k % 5 == 0) {
        EXPECT_TRUE(twist(*linear, angular));
      }
      const Eigen::Vector3d before = handle_.pose.translation_m;
      handle_ = master_.step(wrench, taken_, 0.002, now_);
      // Where it stands is where its speed has brought it: master_io would take the device for one that
      // jumped.
      EXPECT_LT((handle_.pose.translation_m - before - 0.002 * handle_.twist.head<3>()).norm(), 1e-12);
    }
  }
  bool taken_ = true;  // by master_io
  TwistMasterRules rules_;
  TwistMaster master_{rules_};
  teleop::HandState handle_;
  core::Nanoseconds now_ = 1000 * core::kNsPerSecond;
};

TEST_F(TwistMasterTest, LeadsAtTheSpeedThatIsCommanded) {
  const Axes rest{}, forward{0.05, 0.0, -0.02}, turn{0.0, 0.0, 0.3};
  run(50, &rest);
  EXPECT_TRUE(handle_.clutch);
  run(400, &forward, robot::Spatial::Zero(), turn);
  EXPECT_TRUE(handle_.clutch);
  EXPECT_NEAR(handle_.twist[0], 0.05, 1e-6);
  EXPECT_NEAR(handle_.twist[2], -0.02, 1e-6);
  EXPECT_NEAR(handle_.twist[5], 0.3, 1e-6);
  const Eigen::AngleAxisd turned(handle_.pose.rotation);
  EXPECT_NEAR(turned.angle(), 0.3 * 0.4, 0.3 * 0.03) << "but for the time that it takes to come to its speed";
  EXPECT_GT(turned.axis().z(), 0.999);
}

TEST_F(TwistMasterTest, IsSlowedDownByDragAndNeverFasterThanItsLimit) {
  const Axes rest{}, fast{3.0, 4.0, 0.0};
  run(50, &rest);
  run(500, &fast);
  EXPECT_NEAR(handle_.twist[0], 0.06, 1e-6) << "0.1 m/s in the command's direction";
  EXPECT_NEAR(handle_.twist[1], 0.08, 1e-6);
  robot::Spatial drag = robot::Spatial::Zero();
  drag[0] = -3.0;
  run(500, &fast, drag);
  EXPECT_NEAR(handle_.twist[0], 0.06 - 3.0 / rules_.push_N_s_per_m, 1e-6);
  drag[0] = std::numeric_limits<double>::quiet_NaN();
  run(10, &fast, drag);
  EXPECT_TRUE(handle_.twist.allFinite());
}

// Tries ros2_gateway: commands that stop coming
TEST_F(TwistMasterTest, LetsGoWithinTheStalenessAndUntilItWasSeenAtRest) {
  const Axes rest{}, forward{0.05, 0.0, 0.0};
  run(50, &rest);
  run(300, &forward);
  ASSERT_TRUE(handle_.clutch);
  int lasted_ms = 0;
  while (handle_.clutch && lasted_ms < 1000) run(2), lasted_ms += 2;
  EXPECT_LE(lasted_ms, 202);
  EXPECT_GE(lasted_ms, 180);
  run(300, &forward);
  EXPECT_FALSE(handle_.clutch) << "it was not seen at rest since";
  run(20, &rest);
  run(100, &forward);
  EXPECT_TRUE(handle_.clutch);
}

// Tries ros2_gateway: master_io does not take the commands, or dies
TEST_F(TwistMasterTest, LetsTheClutchOutWhileItIsNotTaken) {
  const Axes rest{}, forward{0.05, 0.0, 0.0};
  taken_ = false;
  run(500, &rest);
  EXPECT_FALSE(handle_.clutch);
  taken_ = true;
  run(50, &rest);
  EXPECT_TRUE(handle_.clutch);
  run(200, &forward);
  taken_ = false;
  run(100, &forward);
  EXPECT_TRUE(handle_.clutch) << "an answer that is late is no loss";
  run(200, &forward);
  EXPECT_FALSE(handle_.clutch);
  taken_ = true;
  run(200, &forward);
  EXPECT_FALSE(handle_.clutch) << "it was not seen at rest since";
  run(50, &rest);
  EXPECT_TRUE(handle_.clutch);
}

// As a clutch fades out, what the handle does still moves the arm.
TEST_F(TwistMasterTest, StandsAsItIsLetGoAndGoesBackToTheMiddleLater) {
  const Axes rest{}, forward{0.1, 0.0, 0.0};
  run(50, &rest);
  run(2000, &forward);
  run(400);
  ASSERT_FALSE(handle_.clutch);
  const double stands_m = handle_.pose.translation_m[0];
  EXPECT_GT(stands_m, 0.15);
  run(1600);
  EXPECT_NEAR(handle_.pose.translation_m[0], stands_m, 1e-4);
  EXPECT_LT(handle_.twist.norm(), 1e-9);
  run(4000);
  EXPECT_LT(handle_.pose.translation_m.norm(), 0.02);
}

TEST_F(TwistMasterTest, DoesNotBeginWithACommandThatStands) {
  const Axes forward{0.05, 0.0, 0.0};
  run(500, &forward);
  EXPECT_FALSE(handle_.clutch);
  EXPECT_LT(handle_.pose.translation_m.norm(), 1e-12);
}

TEST_F(TwistMasterTest, ComesBackToTheMiddleWhereItsWayEnds) {
  const Axes rest{}, forward{1.0, 0.0, 0.0};
  rules_.largest_speed_m_s = 1.0;
  master_ = TwistMaster(rules_);
  run(50, &rest);
  double farthest = 0.0;
  for (int s = 0; s < 48; ++s) {
    run(500, &forward);
    farthest = std::max(farthest, handle_.pose.translation_m[0]);
  }
  EXPECT_GT(farthest, 8.0);
  EXPECT_LT(farthest, 9.5) << "10 m is the topic's bound";
  EXPECT_FALSE(handle_.clutch) << "the same command does not go on by itself";
  EXPECT_LT(handle_.pose.translation_m.norm(), 0.02);
  run(20, &rest);
  run(100, &forward);
  EXPECT_TRUE(handle_.clutch);
}

// Tries ros2_gateway: a command with a number that is none; of another frame than `master.frame`
// Tries ros2_gateway: not newer than the last; of a second publisher
TEST_F(TwistMasterTest, RefusesWhatIsNoCommand) {
  const Axes rest{};
  run(50, &rest);
  now_ += kMillisecond;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(twist({0.0, bad, 0.0}).message(), HasSubstr("a number that is none"));
    EXPECT_THAT(twist({}, {bad, 0.0, 0.0}).message(), HasSubstr("a number that is none"));
  }
  EXPECT_THAT(twist({}, {}, 2).message(), HasSubstr("a second publisher"));
  EXPECT_TRUE(twist({}));
  EXPECT_THAT(twist({}).message(), HasSubstr("not newer"));
  const auto stamped = [&](double late_s) {
    return master_.take_twist({kUtc + now_ - core::from_seconds(late_s), {1}}, {}, {}, now_, kUtc + now_)
        .message();
  };
  now_ += kMillisecond;
  EXPECT_THAT(stamped(0.6), HasSubstr("ago; allowed: 0.5"));
  EXPECT_THAT(stamped(-0.6), HasSubstr("ahead"));
  now_ += 300 * kMillisecond;
  EXPECT_TRUE(twist({}, {}, 2)) << "the first has been silent";
  EXPECT_THAT(twist({}, {}, 1).message(), HasSubstr("a second publisher"));
}

TEST_F(TwistMasterTest, IsLedByAJoyWhileItsButtonIsHeld) {
  const auto joy = [&](std::array<float, 3> axes, bool held) {
    const std::array<std::int32_t, 5> buttons{0, 0, 0, 0, held ? 1 : 0};
    return master_.take_joy({0, {1}}, axes, buttons, now_, kUtc + now_);
  };
  const auto go = [&](std::array<float, 3> axes, bool held) {
    for (int k = 0; k < 200; ++k) {
      now_ += 2 * kMillisecond;
      EXPECT_TRUE(joy(axes, held));
      handle_ = master_.step(robot::Spatial::Zero(), true, 0.002, now_);
    }
  };
  go({0.0F, 1.0F, 0.0F}, true);
  EXPECT_FALSE(handle_.clutch) << "held from the start";
  go({0.5F, 1.0F, -1.0F}, false);
  EXPECT_FALSE(handle_.clutch);
  go({0.0F, 1.0F, -1.0F}, true);
  EXPECT_TRUE(handle_.clutch);
  EXPECT_NEAR(handle_.twist[0], 0.1, 1e-6);
  EXPECT_NEAR(handle_.twist[5], -0.5, 1e-6);
  const std::array<std::int32_t, 4> few{};
  EXPECT_THAT(master_.take_joy({0, {1}}, std::array<float, 3>{}, few, now_, kUtc).message(),
              HasSubstr("no button 4 among 4"));
  const std::array<std::int32_t, 5> enough{};
  EXPECT_THAT(master_.take_joy({0, {1}}, std::array<float, 2>{}, enough, now_, kUtc).message(),
              HasSubstr("no axis 2 among 2"));
}

TEST_F(TwistMasterTest, StepsWithoutTheHeap) {
  const Axes rest{};
  run(50, &rest);
  const phantom::test::HeapGuard guard;
  master_.step(robot::Spatial::Ones(), true, 0.002, now_);
}

}  // namespace
}  // namespace phantom::ros2_gateway
