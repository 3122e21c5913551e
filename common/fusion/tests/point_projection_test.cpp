#include "common/fusion/point_projection.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace phantom::fusion::point_projection_test {
namespace {

using testing::Each;
using testing::ElementsAre;

const PinholeCamera kCamera{64, 48, 60.0, 65.0, 31.0, 23.5, 0.2, 8.0};

TEST(WholeMillimetres, AreRoundedAndNothingElseIsADepth) {
  EXPECT_EQ(whole_mm(1.0004), 1000);
  EXPECT_EQ(whole_mm(1.0006), 1001);
  EXPECT_EQ(whole_mm(65.535), 65535);
  for (const double none : {65.536, 0.0, 0.0004, -1.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_EQ(whole_mm(none), 0) << none;
}

// Points in the middle of the pixels' rays make the image that they came from, in any order.
TEST(PointProjection, PointsOfAnImageMakeThatImage) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> depth(0, 7000);
  std::vector<std::uint16_t> image(kCamera.pixels());
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < image.size(); ++i) {
    const int mm = depth(random);
    image[i] = static_cast<std::uint16_t>(mm < 300 ? 0 : mm);
    if (image[i] == 0) continue;
    const Eigen::Vector3d at =
        1e-3 * image[i] * kCamera.direction(static_cast<double>(i % 64), static_cast<double>(i / 64));
    points.push_back(at.cast<float>());
  }
  std::shuffle(points.begin(), points.end(), random);
  std::vector<float> xyz;
  for (const auto& p : points) xyz.insert(xyz.end(), {p.x(), p.y(), p.z()});
  EXPECT_EQ(depths_of_points(xyz, kCamera), image);
}

TEST(PointProjection, OfPointsOnOneRayTheNearestIsSeenAndOthersAreLeftOut) {
  const PinholeCamera camera{3, 1, 100.0, 100.0, 1.0, 0.0, 0.2, 8.0};
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const std::vector<float> seen{0, 0, 2, 0, 0, 1, 0, 0, 3};
  EXPECT_THAT(depths_of_points(seen, camera), ElementsAre(0, 1000, 0));
  const std::vector<float> unseen{0, 0, -1, 9,   0, 1, 0,  -9,    1, nan, 0, 1, 0, 0,     nan, inf,   0,
                                  1, 0, 0,  inf, 0, 0, 70, 1e30F, 0, 1,   0, 0, 0, -0.0F, 0,   1e-30F};
  EXPECT_THAT(depths_of_points(unseen, camera), Each(0));
  EXPECT_THAT(depths_of_points({}, camera), Each(0));
}

}  // namespace
}  // namespace phantom::fusion::point_projection_test
