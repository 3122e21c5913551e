#include "common/percept/hit_susceptibility.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/percept/motion_class.hpp"

namespace phantom::percept {
namespace {

const Eigen::Vector3d kPgv(0.02, 0.0, 0.0);

TEST(MotionClass, FollowsTheAngleToTheObject) {
  const MotionThresholds thresholds;
  const auto at_degrees = [&](double angle) {
    const double a = angle * 0.017453292519943295;
    return classify_motion(kPgv, 0.1 * Eigen::Vector3d(std::cos(a), std::sin(a), 0.0), thresholds);
  };
  EXPECT_EQ(at_degrees(0), MotionClass::kDangerous);
  EXPECT_EQ(at_degrees(59), MotionClass::kDangerous);
  EXPECT_EQ(at_degrees(61), MotionClass::kNeutral);
  EXPECT_EQ(at_degrees(119), MotionClass::kNeutral);
  EXPECT_EQ(at_degrees(121), MotionClass::kSafe);
  EXPECT_EQ(at_degrees(180), MotionClass::kSafe);
}

TEST(MotionClass, HasNoneWithoutGradientOrMotion) {
  const MotionThresholds thresholds;
  EXPECT_EQ(classify_motion(Eigen::Vector3d::Zero(), {0.1, 0, 0}, thresholds), MotionClass::kNone);
  EXPECT_EQ(classify_motion(kPgv, Eigen::Vector3d::Zero(), thresholds), MotionClass::kNone);
  EXPECT_EQ(classify_motion(kPgv, {0.0019, 0, 0}, thresholds), MotionClass::kNone);
  EXPECT_FALSE(approach_cosine(kPgv, Eigen::Vector3d::Zero(), 0.0));
}

TEST(SpeedLimit, IsLinearBetweenItsPointsAndConstantOutside) {
  const SpeedLimit limit{{10.0, 20.0, 30.0}, {0.10, 0.04, 0.01}, 3};
  EXPECT_TRUE(limit.check());
  EXPECT_DOUBLE_EQ(limit.at(1.0), 0.10);
  EXPECT_DOUBLE_EQ(limit.at(10.0), 0.10);
  EXPECT_DOUBLE_EQ(limit.at(15.0), 0.07);
  EXPECT_DOUBLE_EQ(limit.at(25.0), 0.025);
  EXPECT_DOUBLE_EQ(limit.at(99.0), 0.01);
}

TEST(SpeedLimit, AsATableHoldsTheSlowerOfTwoLayers) {
  SpeedLimit limit{{10.0, 20.0, 30.0}, {0.10, 0.04, 0.01}, 3};
  const SpeedLimit line = limit;
  limit.shape = LimitShape::kTable;
  EXPECT_EQ(limit.at(5.0), 0.10);
  EXPECT_EQ(limit.at(10.0), 0.10);
  EXPECT_EQ(limit.at(10.1), 0.04);
  EXPECT_EQ(limit.at(20.0), 0.04);
  EXPECT_EQ(limit.at(29.0), 0.01);
  EXPECT_EQ(limit.at(99.0), 0.01);
  for (double mu = 0.0; mu < 40.0; mu += 0.25)
    EXPECT_LE(limit.at(mu), line.at(mu)) << "conservative at " << mu;
}

TEST(SpeedLimit, RefusesWhatIsNotConservative) {
  EXPECT_FALSE((SpeedLimit{{10.0, 20.0}, {0.1, 0.2}, 2}).check());
  EXPECT_FALSE((SpeedLimit{{20.0, 10.0}, {0.2, 0.1}, 2}).check());
  EXPECT_FALSE((SpeedLimit{{10.0}, {std::nan("")}, 1}).check());
  EXPECT_FALSE(SpeedLimit{}.check());
}

TEST(HitRules, AreThoseOfTheSpecification) {
  const HitThresholds thresholds;  // unsafe 32, moderate 13; limit 0.10 m/s at 9 to 0.02 m/s at 32
  const auto rule = [&](double mu, double speed, std::optional<double> cosine) {
    return assess_hit({mu, speed, cosine}, thresholds);
  };
  // 1: very close, whatever the motion
  EXPECT_EQ(rule(32.0, 0.0, std::nullopt), HitRule::kVeryClose);
  EXPECT_EQ(rule(100.0, 1.0, -1.0), HitRule::kVeryClose);
  // 2: moderately close: any motion above the limit, whatever its direction
  EXPECT_EQ(rule(13.0, 0.2, -1.0), HitRule::kModerateMoving);
  EXPECT_EQ(rule(31.9, 0.03, std::nullopt), HitRule::kModerateMoving);
  EXPECT_EQ(rule(13.0, 0.01, 1.0), HitRule::kNone);
  // 3: farther: above the limit and towards the object only
  EXPECT_EQ(rule(9.0, 0.2, 0.6), HitRule::kFarNearing);
  EXPECT_EQ(rule(9.0, 0.2, 0.4), HitRule::kNone);
  EXPECT_EQ(rule(9.0, 0.2, std::nullopt), HitRule::kNone);
  EXPECT_EQ(rule(9.0, 0.09, 0.6), HitRule::kNone);
  // free space
  EXPECT_EQ(rule(0.0, 5.0, 1.0), HitRule::kNone);
}

HitCandidate candidate(double mu, double speed) {
  HitCandidate result;
  result.situation = {mu, speed, 0.9};
  result.object = 1;
  result.link = 4;
  result.position_W_m = {mu, speed, 0.0};
  return result;
}

TEST(HitMonitor, LatchesTheLookAtPointAndClearsAfterQuiet) {
  HitMonitor monitor({}, {});
  AlertEvents events = monitor.step(candidate(13.0, 0.3), 0.01);
  ASSERT_TRUE(events.raised);
  EXPECT_FALSE(events.cleared);
  EXPECT_EQ(events.raised->number, 1U);
  EXPECT_EQ(events.raised->rule, HitRule::kModerateMoving);
  const Eigen::Vector3d latched = events.raised->at.position_W_m;

  events = monitor.step(candidate(20.0, 0.3), 0.01);  // moves on: latched
  EXPECT_FALSE(events.raised || events.cleared);
  EXPECT_EQ(monitor.active()->at.position_W_m, latched);

  for (int i = 0; i < 49; ++i) {
    events = monitor.step(std::nullopt, 0.01);
    EXPECT_FALSE(events.raised || events.cleared) << i;
  }
  events = monitor.step(std::nullopt, 0.0101);
  ASSERT_TRUE(events.cleared);
  EXPECT_EQ(events.cleared->number, 1U);
  EXPECT_FALSE(monitor.active());
}

TEST(HitMonitor, AWaveringSpeedDoesNotMakeItFlicker) {
  HitMonitor monitor({}, {});
  const double limit = HitThresholds{}.limit.at(20.0);
  int changes = 0;
  for (int i = 0; i < 400; ++i) {
    const AlertEvents events = monitor.step(candidate(20.0, limit * (i % 2 == 0 ? 1.05 : 0.8)), 0.01);
    changes += (events.raised ? 1 : 0) + (events.cleared ? 1 : 0);
  }
  EXPECT_EQ(changes, 1);
}

TEST(HitMonitor, ReplacesTheAlertForRuleOneOnceButNotOften) {
  HitMonitor monitor({}, {});
  ASSERT_TRUE(monitor.step(candidate(13.0, 0.3), 0.01).raised);
  EXPECT_FALSE(monitor.step(candidate(50.0, 0.0), 0.01).raised);  // too soon
  AlertEvents events = monitor.step(candidate(50.0, 0.0), 0.6);
  ASSERT_TRUE(events.raised && events.cleared);
  EXPECT_EQ(events.cleared->number, 1U);
  EXPECT_EQ(events.raised->number, 2U);
  EXPECT_EQ(events.raised->rule, HitRule::kVeryClose);
  EXPECT_FALSE(monitor.step(candidate(50.0, 0.0), 60.0).raised);  // stays
}

TEST(HitMonitor, NeverRaisesMoreOftenThanTheLeastInterval) {
  AlertTiming timing;
  timing.clear_after_s = 0.001;
  HitMonitor monitor({}, timing);
  int raises = 0;
  for (int i = 0; i < 1000; ++i) {  // 10 s of on and off
    raises +=
        monitor.step(i % 2 == 0 ? std::optional(candidate(50.0, 0.3)) : std::nullopt, 0.01).raised ? 1 : 0;
  }
  EXPECT_LE(raises, 21);
  EXPECT_GE(raises, 15);
}

TEST(HitMonitor, ATimeThatIsNoNumberDoesNotStopItsClock) {
  HitMonitor monitor({}, {});
  ASSERT_TRUE(monitor.step(candidate(50.0, 0.0), 0.01).raised);
  monitor.step(std::nullopt, std::nan(""));
  monitor.step(std::nullopt, -1.0);
  bool cleared = false;
  for (int i = 0; i < 100 && !cleared; ++i) cleared = monitor.step(std::nullopt, 0.01).cleared.has_value();
  EXPECT_TRUE(cleared);
}

TEST(HitMonitor, ClosesAtOnceWhenNothingIsKnown) {
  HitMonitor monitor({}, {});
  EXPECT_FALSE(monitor.close().cleared);
  ASSERT_TRUE(monitor.step(candidate(50.0, 0.0), 0.01).raised);
  EXPECT_EQ(monitor.close().cleared->number, 1U);
  EXPECT_FALSE(monitor.active());
  EXPECT_FALSE(monitor.close().cleared);
}

}  // namespace
}  // namespace phantom::percept
