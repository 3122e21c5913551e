#include "components/synthetic_viewer/scene/aids.hpp"

#include <gtest/gtest.h>

#include "components/synthetic_viewer/scene/tests/colour_vision.hpp"

namespace phantom::synthetic_viewer {
namespace {

/// Length of the arrow in a frame that holds one: its shaft's and its head's.
double length_m(const Frame& frame) {
  EXPECT_EQ(frame.items.size(), 2U);
  double sum_m = 0.0;
  for (const auto& item : frame.items) sum_m += static_cast<double>(item.W_from_mesh.col(2).head<3>().norm());
  return sum_m;
}

double drawn_m(const Aids& aids, const PgvArrow& arrow) {
  Frame frame;
  add_arrows(frame, aids, arrow);
  return length_m(frame);
}

Aids near(std::optional<double> pgs_Pa_s_per_m, double gap_m = 0.08) {
  Aids aids;
  aids.pgv = {0.0, 0.003, 0.0};
  aids.pgs_Pa_s_per_m = pgs_Pa_s_per_m;
  aids.gap_m = gap_m;
  return aids;
}

// Thesis 6.6.3a: "PGV with length inversely related to PGS"; figure 6.16: the longer, the stronger.
TEST(Arrows, ThatOfTheGradientIsTheShorterTheStrongerItIsOrTheLonger) {
  const PgvArrow inverse, direct{PgvLength::kStrength, 8.0};
  double before_m = 1.0, direct_before_m = 0.0;
  for (const double pgs : {1.0, 2.0, 7.0, 12.0, 20.0}) {
    EXPECT_NEAR(drawn_m(near(pgs), inverse), 0.15 / (1.0 + pgs / 8.0), 1e-6) << pgs;
    EXPECT_LT(drawn_m(near(pgs), inverse), before_m) << pgs;
    before_m = drawn_m(near(pgs), inverse);
    EXPECT_GE(drawn_m(near(pgs), direct), direct_before_m) << pgs;
    direct_before_m = drawn_m(near(pgs), direct);
  }
  EXPECT_NEAR(drawn_m(near(8.0), direct), 0.075, 1e-6);
  EXPECT_NEAR(drawn_m(near(1e5), inverse), 0.03, 1e-6) << "still seen";
  EXPECT_NEAR(drawn_m(near(1e5), direct), 0.15, 1e-4);
}

TEST(Arrows, ByTheGapOrWhereTheStrengthIsNotKnownItSaysTheDistance) {
  EXPECT_NEAR(drawn_m(near(7.0), {PgvLength::kGap, 8.0}), 0.08, 1e-6);
  EXPECT_NEAR(drawn_m(near(std::nullopt), {}), 0.08, 1e-6);
  EXPECT_NEAR(drawn_m(near(std::nullopt, 3.0), {}), 0.12, 1e-6);
}

TEST(Arrows, ThatOfTheMotionIsAsLongAsTheWayOfTheNextHalfSecond) {
  for (const auto& [speed_m_s, wanted_m] : {std::pair{0.02, 0.06}, {0.2, 0.10}, {0.4, 0.20}, {3.0, 0.30}}) {
    Aids aids;
    aids.velocity_m_s = {speed_m_s, 0.0, 0.0};
    EXPECT_NEAR(drawn_m(aids, {}), wanted_m, 1e-6) << speed_m_s;
  }
  Frame still;
  add_arrows(still, {}, {});
  EXPECT_TRUE(still.items.empty());
}

TEST(Arrows, ThatOfTheMotionHasAHeadForEachStepOfDangerAndNoneLeavesIt) {
  for (const auto& [motion, heads] : {std::pair{MotionClass::kNone, 1U},
                                      {MotionClass::kSafe, 1U},
                                      {MotionClass::kNeutral, 2U},
                                      {MotionClass::kDangerous, 3U}}) {
    for (const double speed_m_s : {0.01, 0.3, 3.0}) {
      Aids aids;
      aids.velocity_m_s = {0.0, speed_m_s, 0.0};
      aids.motion = motion;
      Frame frame;
      add_arrows(frame, aids, {});
      ASSERT_EQ(frame.items.size(), 1 + heads);
      const float tip_m = std::clamp(0.5F * static_cast<float>(speed_m_s), 0.06F, 0.30F);
      float behind_m = tip_m;
      for (std::size_t head = 1; head <= heads; ++head) {
        const Eigen::Matrix4f& cone = frame.items[head].W_from_mesh;
        EXPECT_EQ(frame.items[head].mesh, kCone);
        EXPECT_NEAR(cone(1, 3) + cone.col(2).head<3>().norm(), behind_m, 1e-5F);
        EXPECT_GE(cone(1, 3), 0.0F) << "none is behind its foot";
        behind_m -= 0.55F * cone.col(2).head<3>().norm();
      }
    }
  }
}

test::LinearColour colour_of(const Colour& colour) { return {colour[0], colour[1], colour[2]}; }

TEST(Aids, ColoursOfMotionAndClosenessDifferForEveryColourVision) {
  std::vector<test::LinearColour> motions{{0.10, 0.45, 0.85}};  // the PGV's arrow stands beside them
  for (const MotionClass motion :
       {MotionClass::kNone, MotionClass::kSafe, MotionClass::kNeutral, MotionClass::kDangerous})
    motions.push_back(colour_of(motion_colour(motion)));
  for (std::size_t a = 0; a < motions.size(); ++a) {
    for (std::size_t b = a + 1; b < motions.size(); ++b)
      EXPECT_GE(test::least_difference(motions[a], motions[b]), 25) << a << " and " << b;
  }
  for (const auto& [a, b] : {std::pair{0.0, 0.5}, std::pair{0.5, 1.0}, std::pair{0.0, 1.0}})
    EXPECT_GE(test::least_difference(colour_of(closeness_colour(a)), colour_of(closeness_colour(b))), 35)
        << a << " and " << b;
}

}  // namespace
}  // namespace phantom::synthetic_viewer
