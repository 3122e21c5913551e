#include "common/survey/simulated_ranger.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "common/survey/tests/survey_rig.hpp"

namespace phantom::survey {
namespace {

using testing::HasSubstr;

HeadErrors spot_only(double spot_m) {
  HeadErrors errors;
  errors.range_m = errors.pan_rad = errors.tilt_rad = errors.targeting_m = 0.0;
  errors.spot_m = spot_m;
  return errors;
}

/// A rectangle in the plane through `middle`, spanned by ±u and ±v.
geometry::TriangleMesh rectangle(const Eigen::Vector3f& middle, const Eigen::Vector3f& u,
                                 const Eigen::Vector3f& v) {
  geometry::TriangleMesh mesh;
  mesh.vertices_m = {middle - u - v, middle + u - v, middle + u + v, middle - u + v};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

/// A head at the origin that looks along x at pan 0 and tilt 90 degrees.
RangeHead plain_head() { return {}; }

constexpr double kLevel_rad = std::numbers::pi / 2;

TEST(SimulatedRanger, ReadsTheSurfaceWhereItPointsAlsoWithAnOffsetBeam) {
  RangeHead head = test_head();
  const Eigen::Vector3d p(0.1, -0.05, 0.2);
  const Reading at = *aim(head, p);
  const Eigen::Vector3d beam = beam_direction_W(head, at);
  const auto wall = rectangle(p.cast<float>(), beam.unitOrthogonal().cast<float>(),
                              beam.cross(beam.unitOrthogonal()).cast<float>());
  SimulatedRanger ranger(head, spot_only(0.0), RangerScene(wall), 1);
  ranger.aim(at.pan_rad, at.tilt_rad);
  const auto reading = ranger.measure();
  ASSERT_TRUE(reading) << reading.status().message();
  EXPECT_LT((spot_W_m(head, *reading) - p).norm(), 1e-4) << "steps of 0.1 mm and 1e-5 rad";
}

// Against the literal: half the spot on a near wall, half on one a metre behind it.
TEST(SimulatedRanger, OverAnEdgeTheBackgroundIsMixedIn) {
  geometry::TriangleMesh scene = rectangle({2, 0.5, 0}, {0, 0.5, 0}, {0, 0, 1});  // y from 0 to 1
  scene.append(rectangle({3, 0, 0}, {0, 5, 0}, {0, 0, 5}));
  RangerOptions options;
  options.rays = 4001;
  SimulatedRanger ranger(plain_head(), spot_only(0.01), RangerScene(scene), 1, options);
  const auto range_at_m = [&](double y_m) {
    ranger.aim(std::atan2(y_m, 2.0), kLevel_rad);
    return ranger.measure()->range_m;
  };
  EXPECT_NEAR(range_at_m(0.02), std::hypot(2.0, 0.02), 2e-4) << "wholly on the near wall";
  EXPECT_NEAR(range_at_m(-0.02), std::hypot(3.0, 0.03), 3e-4) << "wholly beside it";
  EXPECT_NEAR(range_at_m(0.0), 2.5, 0.02) << "half of it";
  EXPECT_NEAR(range_at_m(0.005), 2.0 + 0.1955, 0.02) << "a segment of half the radius' height: 19.55 %";
}

// A slanted face: the mean over the spot is near the middle's range, that of its rim is off by the tangent.
TEST(SimulatedRanger, TheSpotsMiddleCountsOnASlantedFace) {
  const double slant_rad = 1.2;
  const Eigen::Vector3f along(static_cast<float>(std::sin(slant_rad)),
                              static_cast<float>(std::cos(slant_rad)), 0);
  SimulatedRanger ranger(plain_head(), spot_only(0.005), RangerScene(rectangle({2, 0, 0}, along, {0, 0, 1})),
                         1);
  ranger.aim(0.0, kLevel_rad);
  EXPECT_NEAR(ranger.measure()->range_m, 2.0, 3e-4);
  const auto hit =
      RangerScene(rectangle({2, 0, 0}, along, {0, 0, 1})).nearest({0, 0.005, 0}, {1, 0, 0}, 10.0);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->range_m, 2.0 + 0.005 * std::tan(slant_rad), 1e-5);
  EXPECT_NEAR(hit->cosine, std::cos(slant_rad), 1e-6);
}

TEST(SimulatedRanger, ErrorsStayWithinTheDataSheetAndChangeFromReadingToReading) {
  HeadErrors errors;
  errors.range_m = 0.0025;
  SimulatedRanger ranger(plain_head(), errors, RangerScene(rectangle({2, 0, 0}, {0, 5, 0}, {0, 0, 5})), 3);
  double least = 10.0, most = 0.0, sum = 0.0;
  constexpr int kReadings = 2000;
  ranger.aim(0.0, kLevel_rad);
  for (int i = 0; i < kReadings; ++i) {
    const double range_m = ranger.measure()->range_m;
    least = std::min(least, range_m), most = std::max(most, range_m), sum += range_m / kReadings;
  }
  EXPECT_NEAR(least, 2.0 - 0.0025, 2e-4);
  EXPECT_NEAR(most, 2.0 + 0.0025, 2e-4);
  EXPECT_NEAR(sum, 2.0, 5 * 0.0025 / std::sqrt(3.0 * kReadings));
  // At a slant of 80 degrees the error of aiming is seen in the range, and stays until the head turns.
  const Eigen::Vector3f along(static_cast<float>(std::sin(1.4)), static_cast<float>(std::cos(1.4)), 0);
  errors.range_m = 1e-6;
  errors.pan_rad = 0.001;
  SimulatedRanger slanted(plain_head(), errors, RangerScene(rectangle({2, 0, 0}, along, {0, 0, 5})), 4);
  double spread_turned = 0.0, spread_still = 0.0;
  for (int i = 0; i < 50; ++i) {
    slanted.aim(0.0, kLevel_rad);
    const double first_m = slanted.measure()->range_m, again_m = slanted.measure()->range_m;
    spread_turned = std::max(spread_turned, std::abs(first_m - 2.0));
    spread_still = std::max(spread_still, std::abs(first_m - again_m));
  }
  EXPECT_GT(spread_turned, 0.008) << "up to 2 m · 0.001 · tan 80 degrees = 11.6 mm";
  EXPECT_LT(spread_turned, 0.0125);
  EXPECT_LT(spread_still, 0.0026) << "a tenth of it, on both sides";
  EXPECT_GT(spread_still, 0.0005);
}

TEST(SimulatedRanger, WithoutAnEchoOrBeyondItsRangesItSaysSo) {
  RangeHead head = plain_head();
  head.max_range_m = 1.5;
  SimulatedRanger ranger(head, spot_only(0.001), RangerScene(rectangle({2, 0, 0}, {0, 1, 0}, {0, 0, 1})), 1);
  ranger.aim(0.0, kLevel_rad);
  EXPECT_THAT(ranger.measure().status().message(),
              HasSubstr("the echo is from 2.000 m; allowed: 0.05 to 1.5 m"));
  ranger.aim(2.0, kLevel_rad);
  EXPECT_THAT(ranger.measure().status().message(), HasSubstr("no echo"));
  SimulatedRanger nothing(head, spot_only(0.001), RangerScene(geometry::TriangleMesh()), 1);
  EXPECT_THAT(nothing.measure().status().message(), HasSubstr("no echo"));
}

}  // namespace
}  // namespace phantom::survey
