#include "components/ros2_gateway/sensors/depth_images.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "common/messages/living.hpp"
#include "components/ros2_gateway/sensors/sensor_rules.hpp"

namespace phantom::ros2_gateway::depth_images_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr DepthRange kRange{0.3, 4.0};

Pinhole camera(std::uint32_t width = 4, std::uint32_t height = 2) {
  return {"optical", height, width, 100.0, 110.0, 0.5 * width - 0.5, 0.5 * height - 0.5};
}

struct Depths {
  explicit Depths(std::vector<float> depths_m) : octets(4 * depths_m.size()) {
    std::memcpy(octets.data(), depths_m.data(), octets.size());
    message = {"optical", 2, 4, "32FC1", false, 16, octets};
  }
  std::vector<std::uint8_t> octets;
  ImageMessage message;
};

/// A cloud of x, y, z as float32.
struct Points {
  Points(std::vector<float> xyz_m, std::string frame = "optical") : octets(4 * xyz_m.size()) {
    std::memcpy(octets.data(), xyz_m.data(), octets.size());
    const auto count = static_cast<std::uint32_t>(xyz_m.size() / 3);
    message.frame = std::move(frame);
    message.height = 1;
    message.width = count;
    message.point_step = 12;
    message.row_step = 12 * count;
    message.fields = {{"x", 0, 7, 1}, {"y", 4, 7, 1}, {"z", 8, 7, 1}};
    message.data = octets;
  }
  std::vector<std::uint8_t> octets;
  CloudMessage message;
};

TEST(DepthImages, AnImagesDepthsAreRoundedToMillimetresAndWhatIsNoneIsNone) {
  const Depths depths({1.0F, 1.0004F, 1.0006F, NAN, -1.0F, INFINITY, 65.6F, 0.0F});
  const auto image = depth_image_of(depths.message, camera(), kRange);
  ASSERT_TRUE(image) << image.status().message();
  EXPECT_THAT(image->depth_mm, ElementsAre(1000, 1000, 1001, 0, 0, 0, 0, 0));
  EXPECT_EQ(image->width, 4U);
  EXPECT_EQ(image->height, 2U);
  EXPECT_EQ(image->fx_px, 100.0);
  EXPECT_EQ(image->fy_px, 110.0);
  EXPECT_EQ(image->cx_px, 1.5);
  EXPECT_EQ(image->min_depth_m, 0.3);
  EXPECT_EQ(image->max_depth_m, 4.0);
}

// Every pixel of an image becomes a point in the middle of its ray, and the points the image again.
TEST(DepthImages, ACloudOfAnImageIsThatImage) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> depth_mm(0, 4000);
  for (int k = 0; k < 50; ++k) {
    std::vector<float> depths_m(8);
    for (float& depth_m : depths_m) {
      const int mm = depth_mm(random);
      depth_m = mm < 500 ? NAN : 1e-3F * static_cast<float>(mm);
    }
    const Depths depths(depths_m);
    const auto direct = depth_image_of(depths.message, camera(), kRange);
    const auto points = points_of(depths.message, camera());
    ASSERT_TRUE(direct && points);
    auto shuffled = points->xyz_m;  // a cloud need not be in the order of pixels
    for (std::size_t i = shuffled.size() / 3; i-- > 1;) {
      const std::size_t j = std::uniform_int_distribution<std::size_t>(0, i)(random);
      for (std::size_t c = 0; c < 3; ++c) std::swap(shuffled[3 * i + c], shuffled[3 * j + c]);
    }
    const Points cloud(shuffled);
    const auto image = depth_image_of(cloud.message, camera(), kRange);
    ASSERT_TRUE(image) << image.status().message();
    EXPECT_EQ(image->depth_mm, direct->depth_mm);
  }
}

TEST(DepthImages, OfPointsOnOneRayTheNearestIsSeenAndWhatIsBesideOrBehindIsNot) {
  const Points cloud({0.0F,  0.0F, 2.0F, 0.0F, 0.0F, 1.0F,  0.0F, 0.0F, 3.0F, 0.0F, 0.0F,
                      -1.0F, 9.0F, 0.0F, 1.0F, 0.0F, -9.0F, 1.0F, NAN,  0.0F, 1.0F});
  const auto image = depth_image_of(cloud.message, camera(5, 3), kRange);
  ASSERT_TRUE(image);
  for (std::size_t i = 0; i < image->depth_mm.size(); ++i)
    EXPECT_EQ(image->depth_mm[i], i == 7 ? 1000 : 0) << i;
}

TEST(DepthImages, WhatDoesNotFitIsRefused) {
  const Points elsewhere({0.0F, 0.0F, 1.0F}, "lidar");
  const auto cloud = depth_image_of(elsewhere.message, camera(), kRange);
  EXPECT_THAT(cloud.status().message(), HasSubstr("in frame 'lidar'; allowed: its camera's, 'optical'"));
  const auto huge = depth_image_of(elsewhere.message, camera(4000, 4000), kRange);
  EXPECT_FALSE(huge);
  const Depths depths(std::vector<float>(8, 1.0F));
  EXPECT_THAT(depth_image_of(depths.message, camera(4000, 4000), kRange).status().message(),
              HasSubstr("16000000 pixels; allowed: at most 1000000"));
  EXPECT_THAT(depth_image_of(depths.message, camera(5000, 2), kRange).status().message(),
              HasSubstr("5000 x 2 pixels; allowed: at most 4096 each"));
  EXPECT_FALSE(depth_image_of(depths.message, camera(3, 2), kRange)) << "another size than the camera's";
}

TEST(DepthImages, AreAsOldAsTheirStampSaysOrWhereThatIsNotJudgedAsTheLatency) {
  DepthCameraRules rules;
  rules.latency_s = 0.08;
  const core::Nanoseconds now_ns = 1'700'000'000 * core::kNsPerSecond, ms = core::kNsPerMillisecond;
  EXPECT_NEAR(age_of_image_s(rules, now_ns - 40 * ms, now_ns, 5 * ms), 0.04, 1e-9);
  EXPECT_EQ(age_of_image_s(rules, now_ns + 40 * ms, now_ns, 5 * ms), 0.0) << "no image is of the future";
  rules.topics.largest_stamp_age_s = 3600.0;
  EXPECT_EQ(age_of_image_s(rules, now_ns - 60'000 * ms, now_ns, 5 * ms), 10.0) << "the topic's most";
  rules.topics.largest_stamp_age_s = 0.0;
  EXPECT_NEAR(age_of_image_s(rules, 0, now_ns, 5 * ms), 0.085, 1e-9);
}

}  // namespace
}  // namespace phantom::ros2_gateway::depth_images_test
