#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "common/geometry/cross_matrix.hpp"
#include "common/survey/tests/survey_rig.hpp"

namespace phantom::survey {
namespace {

using std::numbers::pi;

TEST(RangeHead, ABeamWithoutOffsetPointsWherePanAndTiltSay) {
  RangeHead head;
  head.X_WH.translation_m = {1, 2, 3};
  EXPECT_TRUE(spot_W_m(head, {4.0, 0.0, pi / 2}).isApprox(Eigen::Vector3d(5, 2, 3), 1e-12))
      << "horizontal, along x";
  EXPECT_TRUE(spot_W_m(head, {4.0, pi / 2, pi / 2}).isApprox(Eigen::Vector3d(1, 6, 3), 1e-12)) << "along y";
  EXPECT_TRUE(spot_W_m(head, {2.0, 0.0, 0.0}).isApprox(Eigen::Vector3d(1, 2, 1), 1e-12)) << "straight down";
}

// The offset's geometry built of vectors: the arm of length r at angle ψ from backwards, the beam at right
// angles to it.
TEST(RangeHead, TheOffsetsCorrectionIsThatOfTheArmAndABeamAtRightAnglesToIt) {
  RangeHead head;
  head.beam_offset_m = 0.08;
  for (const double pan : {-2.0, 0.0, 0.7}) {
    for (const double tilt : {0.3, 1.0, pi / 2, 2.2}) {
      const Eigen::Vector3d ahead(std::cos(pan), std::sin(pan), 0), down(0, 0, -1);
      const Eigen::Vector3d arm = 0.08 * (-std::cos(tilt) * ahead + std::sin(tilt) * down);
      const Eigen::Vector3d beam = std::sin(tilt) * ahead + std::cos(tilt) * down;
      EXPECT_TRUE(spot_W_m(head, {3.5, pan, tilt}).isApprox(arm + 3.5 * beam, 1e-12));
      EXPECT_TRUE(beam_direction_W(head, {3.5, pan, tilt}).isApprox(beam, 1e-12));
    }
  }
}

TEST(RangeHead, AimIsTheInverseOfTheSpot) {
  const RangeHead head = test_head();
  std::mt19937_64 random(7);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p = random_pose(random).translation_m;
    const auto reading = aim(head, p);
    ASSERT_TRUE(reading) << reading.status().message();
    EXPECT_LT((spot_W_m(head, *reading) - p).norm(), 1e-12);
  }
  EXPECT_THAT(aim(head, head.X_WH.translation_m).status().message(), testing::HasSubstr("offset"));
}

TEST(RangeHead, TheJacobianIsThatOfFiniteDifferences) {
  const RangeHead head = test_head();
  const Reading at{3.4, 0.3, 0.9};
  const Eigen::Matrix3d J = spot_jacobian(head, at);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 3; ++i) {
    Reading less = at, more = at;
    double Reading::*const fields[] = {&Reading::range_m, &Reading::pan_rad, &Reading::tilt_rad};
    less.*fields[i] -= kStep;
    more.*fields[i] += kStep;
    const Eigen::Vector3d difference = (spot_W_m(head, more) - spot_W_m(head, less)) / (2 * kStep);
    EXPECT_LT((J.col(i) - difference).norm(), 1e-8) << i;
  }
}

class Law : public testing::TestWithParam<ErrorLaw> {};

// The stated covariance is that of the simulated spots: their normalised squared error has mean 3.
TEST_P(Law, TheStatedCovarianceIsThatOfTheSpots) {
  const RangeHead head = test_head();
  HeadErrors errors;
  errors.law = GetParam();
  errors.targeting_m = 0.001;
  const Eigen::Vector3d p(0.1, -0.05, 0.2);
  std::mt19937_64 random(11);
  const Eigen::Matrix3d stated = spot_covariance_m2(head, errors, *aim(head, p));
  Eigen::Matrix3d found = Eigen::Matrix3d::Zero();
  constexpr int kRuns = 20000;
  for (int i = 0; i < kRuns; ++i) {
    const Eigen::Vector3d off = spot_W_m(head, *simulate_reading(head, errors, p, random)) - p;
    found += off * off.transpose() / kRuns;
  }
  // Standard error of an entry of a sample's covariance: at most √(2/n) of the variances.
  EXPECT_LT((found - stated).cwiseAbs().maxCoeff(),
            5 * std::sqrt(2.0 / kRuns) * stated.diagonal().maxCoeff());
  EXPECT_NEAR((stated.inverse() * found).trace(), 3.0, 5 * std::sqrt(6.0 / kRuns));
}

/// Unit normal of a face at a point, turned away from the head by an incidence.
Eigen::Vector3d normal_at(const RangeHead& head, const Eigen::Vector3d& p, double incidence_rad) {
  const Eigen::Vector3d beam = beam_direction_W(head, *aim(head, p));
  return geometry::rotation_about(beam.unitOrthogonal(), incidence_rad) * -beam;
}

// Of a face that the beam meets at a slant the spots stay on the face: their range scatters with the tangent
// of the incidence. Without any error of range and angles nothing leaves the face's plane.
TEST_P(Law, OnATiltedFaceTheStatedCovarianceIsThatOfTheSpotsToo) {
  const RangeHead head = test_head();
  HeadErrors errors;
  errors.law = GetParam();
  errors.targeting_m = 0.001;
  errors.spot_m = 0.001;
  errors.spot_per_m = 0.0003;
  const Eigen::Vector3d p(0.1, -0.05, 0.2);
  const Reading at = *aim(head, p);
  const Eigen::Vector3d beam = beam_direction_W(head, at);
  std::mt19937_64 random(12);
  constexpr int kRuns = 20000;
  for (const double incidence_rad : {0.0, 0.8, 1.3}) {
    const Eigen::Vector3d normal = normal_at(head, p, incidence_rad);
    const Eigen::Matrix3d stated = spot_covariance_m2(head, errors, at, normal);
    Eigen::Matrix3d found = Eigen::Matrix3d::Zero();
    for (int i = 0; i < kRuns; ++i) {
      const Eigen::Vector3d off = spot_W_m(head, *simulate_reading(head, errors, p, random, normal)) - p;
      found += off * off.transpose() / kRuns;
    }
    EXPECT_LT((found - stated).cwiseAbs().maxCoeff(),
              5 * std::sqrt(2.0 / kRuns) * stated.diagonal().maxCoeff());
    EXPECT_NEAR((stated.inverse() * found).trace(), 3.0, 5 * std::sqrt(6.0 / kRuns));
    const double slant_m =
        std::tan(incidence_rad) * sigma_of(errors.law, targeting_bound_m(errors, at.range_m));
    EXPECT_NEAR(std::sqrt(beam.dot(stated * beam)), std::hypot(sigma_of(errors.law, errors.range_m), slant_m),
                2e-6);
    HeadErrors aiming = errors;
    aiming.range_m = aiming.pan_rad = aiming.tilt_rad = 0.0;
    for (int i = 0; i < 20; ++i)
      EXPECT_NEAR(normal.dot(spot_W_m(head, *simulate_reading(head, aiming, p, random, normal)) - p), 0.0,
                  1e-12);
  }
}
INSTANTIATE_TEST_SUITE_P(Every, Law,
                         testing::Values(ErrorLaw::kUniform, ErrorLaw::kNormal, ErrorLaw::kExtreme));

// The spot's radius at 3.5 m counts as an error of aiming; a face whose normal is unknown is met at 60
// degrees.
TEST(RangeHead, AFaceThatIsNotKnownIsMetAtASlant) {
  const RangeHead head = test_head();
  HeadErrors errors;
  errors.targeting_m = 0.003;
  errors.spot_m = 0.0005;
  errors.spot_per_m = 0.001;
  const Reading at{3.5, 0.3, 0.9};
  EXPECT_NEAR(spot_radius_m(errors, 3.5), 0.004, 1e-12);
  EXPECT_NEAR(targeting_bound_m(errors, 3.5), std::sqrt(57e-6), 1e-12) << "3 mm, and 4 mm as one sigma";
  const Eigen::Vector3d beam = beam_direction_W(head, at);
  const double plain = beam.dot(spot_covariance_m2(head, errors, at) * beam),
               unknown = beam.dot(spot_covariance_unknown_face_m2(head, errors, at) * beam);
  EXPECT_NEAR(unknown - plain, 57e-6, 1e-8) << "tan² 60° = 3, σ² = b²/3";
}

// Against the literal: many heads, mounted with errors, that all read the same.
TEST(RangeHead, TheMountingsCovarianceIsThatOfAPointSeenByManyMountings) {
  const RangeHead head = test_head();
  HeadErrors errors;
  errors.mounting_m = 0.002;
  errors.mounting_rad = 0.1 * core::kRadPerDegree;
  const Eigen::Vector3d p(0.1, -0.05, 0.2);
  const Reading at = *aim(head, p);
  Eigen::Matrix<double, 3, 6> J;
  J << -geometry::cross_matrix(p - head.X_WH.translation_m), Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d stated = J * mounting_covariance(errors) * J.transpose();
  EXPECT_NEAR(std::sqrt(stated.trace() / 2), 0.1 * core::kRadPerDegree / std::numbers::sqrt3 * 3.5, 5e-4)
      << "0.1 degrees are 6 mm at 3.5 m";
  std::mt19937_64 random(13);
  constexpr int kRuns = 20000;
  Eigen::Matrix3d found = Eigen::Matrix3d::Zero();
  for (int i = 0; i < kRuns; ++i) {
    const Eigen::Vector3d off = spot_W_m(simulate_mounting(head, errors, random), at) - p;
    found += off * off.transpose() / kRuns;
  }
  EXPECT_LT((found - stated).cwiseAbs().maxCoeff(),
            5 * std::sqrt(2.0 / kRuns) * stated.diagonal().maxCoeff());
}

TEST(RangeHead, ReadingsThatAreNoneAreNamed) {
  const RangeHead head;
  const auto said = [&](Reading reading) { return check_reading(head, reading).message(); };
  EXPECT_THAT(said({0.0, 0, 1}), testing::HasSubstr("range 0 m; allowed: 0.05 to 30 m"));
  EXPECT_THAT(said({std::nan(""), 0, 1}), testing::HasSubstr("range nan m"));
  EXPECT_THAT(said({-1, 0, 1}), testing::HasSubstr("range -1 m"));
  EXPECT_THAT(said({3500, 0, 1}), testing::HasSubstr("range 3500 m"));
  EXPECT_THAT(said({3, std::nan(""), 1}), testing::HasSubstr("pan"));
  EXPECT_THAT(said({3, 0, 4}), testing::HasSubstr("tilt"));
  EXPECT_TRUE(check_reading(head, {3, 0, 1}));
}

TEST(ChiSquare, TailsAreThoseOfTheTables) {
  EXPECT_NEAR(chi_square_tail(3.841459, 1), 0.05, 1e-6);
  EXPECT_NEAR(chi_square_tail(5.991465, 2), 0.05, 1e-6);
  EXPECT_NEAR(chi_square_tail(11.34487, 3), 0.01, 1e-6);
  EXPECT_NEAR(chi_square_tail(12.59159, 6), 0.05, 1e-6);
  EXPECT_NEAR(chi_square_tail(24.99579, 15), 0.05, 1e-6);
  EXPECT_EQ(chi_square_tail(0.0, 4), 1.0);
}

}  // namespace
}  // namespace phantom::survey
