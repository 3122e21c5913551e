#include "common/robot/skin/skin.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "common/robot/tests/test_arms.hpp"

namespace phantom::robot::skin_test {
namespace {

using testing::HasSubstr;

SkinSegment cone() {
  SkinSegment segment;
  segment.from_m = {0.0, 0.01, 0.02};
  segment.to_m = {0.1, 0.03, -0.2};
  segment.from_radius_m = 0.05;
  segment.to_radius_m = 0.02;
  segment.spin_rad = 0.3;
  return segment;
}

SkinLayout lay_out(const std::vector<LinkSkin>& skin, const SkinOptions& options = {}) {
  auto layout = lay_out_skin(test_arms::planar(), skin, options);
  if (!layout) throw std::runtime_error(layout.status().message());
  return *std::move(layout);
}

std::string refusal(const std::vector<LinkSkin>& skin, const SkinOptions& options = {}) {
  const auto layout = lay_out_skin(test_arms::planar(), skin, options);
  EXPECT_FALSE(layout.has_value());
  return layout.status().message();
}

TEST(Skin, AreasOfASegmentSumUpToItsLateralSurface) {
  const SkinLayout layout = lay_out({{"upper", {cone()}}});
  const double axis = (cone().to_m - cone().from_m).norm();
  const double lateral = std::numbers::pi * 0.07 * std::hypot(axis, 0.03);
  EXPECT_NEAR(std::accumulate(layout.area_m2.begin(), layout.area_m2.end(), 0.0), lateral, 1e-12);
  EXPECT_EQ(layout.area_m2, layout.weight);  // gain 1, weighted by area
}

TEST(Skin, SensorsLieOnTheRoundSurface) {
  const SkinSegment segment = cone();
  const SkinLayout layout = lay_out({{"upper", {segment}}});
  const Eigen::Vector3d axis = (segment.to_m - segment.from_m).normalized();
  const double length = (segment.to_m - segment.from_m).norm();
  for (std::size_t i = 0; i < layout.size(); ++i) {
    const double along = axis.dot(layout.position(i) - segment.from_m);
    const double away = (layout.position(i) - segment.from_m - along * axis).norm();
    EXPECT_GT(along, -1e-12);
    EXPECT_LT(along, length + 1e-12);
    EXPECT_NEAR(away, 0.05 - 0.03 * along / length, 1e-12);
  }
}

TEST(Skin, ChosenPitchIsBelowTheVoxelSizeAroundAndAlong) {
  for (const double pitch_vox : {0.3, 0.99, 1.0}) {
    SkinOptions options;
    options.pitch_vox = pitch_vox;
    SkinSegment tube = cone();
    tube.to_radius_m = tube.from_radius_m;
    const SkinLayout layout = lay_out({{"upper", {tube}}}, options);
    const double pitch = pitch_vox * options.voxel_size_m.reference_m();
    std::size_t sides = 1;  // sensors of the first ring lie at one distance along the axis
    const Eigen::Vector3d axis = (tube.to_m - tube.from_m).normalized();
    while (std::abs(axis.dot(layout.position(sides) - layout.position(0))) < 1e-9) ++sides;
    ASSERT_EQ(layout.size() % sides, 0U);
    for (std::size_t i = 0; i + sides < layout.size(); ++i) {
      EXPECT_LT((layout.position(i + sides) - layout.position(i)).norm(), pitch);
      if (i % sides + 1 < sides) {
        EXPECT_LT((layout.position(i + 1) - layout.position(i)).norm(), pitch);
      }
    }
    // No finer than needed: one side or ring less would be too wide.
    EXPECT_GE(2 * 0.05 * std::sin(std::numbers::pi / static_cast<double>(sides - 1)), pitch);
    EXPECT_GE((tube.to_m - tube.from_m).norm() / static_cast<double>(layout.size() / sides - 2),
              pitch - 1e-12);
  }
}

TEST(Skin, SensorsStandLinkByLinkInTheCarryingLinksFrame) {
  SkinSegment small = cone();
  const SkinLayout layout = lay_out({{"tip", {small}}, {"upper", {cone(), cone()}}});
  const std::size_t one = lay_out({{"upper", {cone()}}}).size();
  EXPECT_EQ(layout.first[1], 0U);
  EXPECT_EQ(layout.first[2], 2 * one);
  EXPECT_EQ(layout.first[3], 3 * one);
  EXPECT_EQ(layout.first[core::kMaxJoints + 1], 3 * one);
  EXPECT_EQ(layout.link_of(0), 1U);
  EXPECT_EQ(layout.link_of(2 * one - 1), 1U);
  EXPECT_EQ(layout.link_of(2 * one), 2U);
  // "tip" is fixed to the second link, 0.3 m along x.
  EXPECT_TRUE((layout.position(2 * one) - layout.position(0)).isApprox(Eigen::Vector3d(0.3, 0, 0), 1e-12));
}

TEST(Skin, NormalisationSetsTheWeights) {
  SkinSegment segment = cone();
  segment.gain = 2.5;
  SkinOptions options;
  EXPECT_DOUBLE_EQ(lay_out({{"upper", {segment}}}, options).weight[3],
                   2.5 * lay_out({{"upper", {segment}}}, options).area_m2[3]);
  options.normalisation = Normalisation::kCount;
  const SkinLayout count = lay_out({{"upper", {segment}}, {"lower", {segment}}}, options);
  EXPECT_DOUBLE_EQ(count.weight[0] * static_cast<double>(count.first[2]), 2.5);
  options.normalisation = Normalisation::kNone;
  EXPECT_DOUBLE_EQ(lay_out({{"upper", {segment}}}, options).weight[0], 2.5);
}

TEST(Skin, GivenCountsAreKeptIfFineEnough) {
  SkinSegment segment = cone();
  segment.sides = 80;
  segment.rings = 101;
  EXPECT_EQ(lay_out({{"upper", {segment}}}).size(), 8080U);
}

TEST(SkinRefuses, GivenCountsThatAreTooCoarse) {
  SkinSegment segment = cone();
  segment.sides = 12;
  EXPECT_THAT(refusal({{"upper", {cone(), segment}}}),
              HasSubstr("link 'upper': segments[1]: sides: 12; allowed: at least "));
  segment.sides.reset();
  segment.rings = 5;
  EXPECT_THAT(refusal({{"upper", {segment}}}), HasSubstr("segments[0]: rings: 5; allowed: at least "));
}

TEST(SkinRefuses, UnknownLinksAndShapesThatCannotBe) {
  EXPECT_THAT(refusal({{"hand", {cone()}}}),
              HasSubstr("link 'hand' is not in the arm; allowed: base, upper, lower, tip"));
  SkinSegment segment = cone();
  segment.to_m = segment.from_m;
  EXPECT_THAT(refusal({{"upper", {segment}}}), HasSubstr("both ends are the same point"));
  segment = cone();
  segment.from_radius_m = segment.to_radius_m = 0.0;
  EXPECT_THAT(refusal({{"upper", {segment}}}), HasSubstr("radii must be"));
  segment = cone();
  segment.gain = std::nan("");
  EXPECT_THAT(refusal({{"upper", {segment}}}), HasSubstr("gain must be"));
}

TEST(SkinRefuses, TooManySensorsAndNone) {
  SkinOptions options;
  options.max_sensors = 1000;
  EXPECT_THAT(
      refusal({{"upper", {cone()}}}, options),
      HasSubstr("link 'upper': segments[0]: needs more sensors than the 1000 that are still allowed"));
  EXPECT_THAT(refusal({}), HasSubstr("no sensors"));
  EXPECT_THAT(refusal({{"base", {cone()}}}), HasSubstr("at least one part on a moving link"));
}

}  // namespace
}  // namespace phantom::robot::skin_test
