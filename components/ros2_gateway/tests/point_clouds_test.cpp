#include "components/ros2_gateway/sensors/point_clouds.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

namespace phantom::ros2_gateway {
namespace {

using testing::HasSubstr;

template <class T>
void put(std::vector<std::uint8_t>& to, T value, bool big_endian = false) {
  auto octets = std::bit_cast<std::array<std::uint8_t, sizeof(T)>>(value);
  if (big_endian) std::reverse(octets.begin(), octets.end());
  to.insert(to.end(), octets.begin(), octets.end());
}

/// A cloud of 3 × 2 points: x counts them, y = −x, z = 0.5; rows end with 8 octets of nothing.
struct Cloud {
  explicit Cloud(bool big_endian = false, bool doubles = false) {
    message.frame = "lidar";
    message.width = 3;
    message.height = 2;
    message.big_endian = big_endian;
    const std::uint32_t size = doubles ? 8 : 4;
    const int datatype = doubles ? 8 : 7;
    message.point_step = 4 + 3 * size;
    message.row_step = 3 * message.point_step + 8;
    message.fields = {{"intensity", 0, 7, 1},
                      {"x", 4, datatype, 1},
                      {"y", 4 + size, datatype, 1},
                      {"z", 4 + 2 * size, datatype, 1}};
    for (int i = 0; i < 6; ++i) {
      put(data, 9.0F, big_endian);
      for (const double value : {1.0 * i, -1.0 * i, 0.5}) {
        if (doubles) put(data, value, big_endian);
        if (!doubles) put(data, static_cast<float>(value), big_endian);
      }
      if (i % 3 == 2) data.insert(data.end(), 8, 0xff);
    }
    message.data = data;
  }
  Cloud(const Cloud&) = delete;
  CloudMessage message;
  std::vector<std::uint8_t> data;
};

TEST(PointClouds, AreReadInEitherOrderOfOctetsAndEitherPrecision) {
  for (const bool big_endian : {false, true}) {
    for (const bool doubles : {false, true}) {
      const Cloud cloud(big_endian, doubles);
      const auto points = points_of(cloud.message);
      ASSERT_TRUE(points) << points.status().message();
      EXPECT_EQ(points->frame, "lidar");
      EXPECT_EQ(points->width, 3u);
      EXPECT_EQ(points->height, 2u);
      ASSERT_EQ(points->xyz_m.size(), 18u);
      for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_EQ(points->xyz_m[3 * i], static_cast<float>(i));
        EXPECT_EQ(points->xyz_m[3 * i + 1], -static_cast<float>(i));
        EXPECT_EQ(points->xyz_m[3 * i + 2], 0.5F);
      }
    }
  }
}

TEST(PointClouds, SayWhereNothingWasMeasured) {
  for (const float none :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 2e4F}) {
    Cloud cloud;
    const auto octets = std::bit_cast<std::array<std::uint8_t, 4>>(none);
    std::copy(octets.begin(), octets.end(), cloud.data.begin() + 16 + 8);  // y of the second point
    const auto points = points_of(cloud.message);
    ASSERT_TRUE(points);
    for (std::size_t i = 3; i < 6; ++i) EXPECT_TRUE(std::isnan(points->xyz_m[i]));
    EXPECT_EQ(points->xyz_m[6], 2.0F);
  }
}

// Tries ros2_gateway: a cloud or an image whose fields, sizes or numbers are not as its definition has them
TEST(PointClouds, AreRefusedBeforeAnythingIsAllocated) {
  const auto refusal = [](const std::function<void(CloudMessage&)>& change) {
    Cloud cloud;
    change(cloud.message);
    return points_of(cloud.message).status().message();
  };
  EXPECT_THAT(refusal([](auto& m) { m.width = 4; }), HasSubstr("a row has 56 octets; allowed: at least 64"));
  EXPECT_THAT(refusal([](auto& m) { m.height = 3; }), HasSubstr("data has 112 octets; allowed: 168"));
  EXPECT_THAT(refusal([](auto& m) { m.width = 0; }), HasSubstr("0 x 2 points"));
  EXPECT_THAT(refusal([](auto& m) { m.width = 4'294'967'295, m.height = 4'294'967'295; }),
              HasSubstr("allowed: 1 to"));
  EXPECT_THAT(refusal([](auto& m) { m.point_step = 4'294'967'295; }),
              HasSubstr("allowed: at least 12884901885"));
  EXPECT_THAT(refusal([](auto& m) { m.row_step = 4'294'967'295; }), HasSubstr("data has 112"));
  EXPECT_THAT(refusal([](auto& m) { m.fields[2].name = "Y"; }), HasSubstr("no field y"));
  EXPECT_THAT(refusal([](auto& m) { m.fields[2].datatype = 5; }), HasSubstr("field y has datatype 5"));
  EXPECT_THAT(refusal([](auto& m) { m.fields[2].count = 2; }), HasSubstr("count 2"));
  EXPECT_THAT(refusal([](auto& m) { m.fields[3].offset = 4'294'967'290; }),
              HasSubstr("beyond point_step 16"));
  EXPECT_THAT(refusal([](auto& m) { m.fields[3].offset = 13; }), HasSubstr("beyond point_step"));
  EXPECT_THAT(refusal([](auto& m) { m.frame.clear(); }), HasSubstr("frame_id has 0"));
  EXPECT_THAT(refusal([](auto& m) { m.frame.assign(256, 'f'); }), HasSubstr("frame_id has 256"));
  // 60 million points of no octet each, announced in a message of a hundred octets.
  EXPECT_THAT(refusal([](auto& m) { m.width = 60'000'000, m.point_step = 0, m.row_step = 56; }),
              HasSubstr("allowed: 1 to"));
}

/// An image of 3 × 2 depths: 1 m, 2 m … 6 m.
struct Image {
  explicit Image(bool in_mm, bool big_endian = false) {
    message = {"camera", 2, 3, in_mm ? "16UC1" : "32FC1", big_endian, in_mm ? 6u : 12u, {}};
    for (int i = 1; i <= 6; ++i) {
      if (in_mm) put(data, static_cast<std::uint16_t>(1000 * i), big_endian);
      if (!in_mm) put(data, static_cast<float>(i), big_endian);
    }
    message.data = data;
  }
  Image(const Image&) = delete;
  ImageMessage message;
  std::vector<std::uint8_t> data;
};
const Pinhole kCamera{
    .frame = "camera", .height = 2, .width = 3, .f_x_px = 10, .f_y_px = 20, .c_x_px = 1, .c_y_px = 0.5};

// The literal twin: what projects to the pixel's middle at that depth.
TEST(DepthImages, ArePointsThatProjectToTheirPixels) {
  for (const bool in_mm : {false, true}) {
    for (const bool big_endian : {false, true}) {
      const Image image(in_mm, big_endian);
      const auto points = points_of(image.message, kCamera);
      ASSERT_TRUE(points) << points.status().message();
      for (std::size_t i = 0; i < 6; ++i) {
        const float* p = points->xyz_m.data() + 3 * i;
        EXPECT_FLOAT_EQ(p[2], static_cast<float>(i + 1));
        EXPECT_NEAR(kCamera.f_x_px * p[0] / p[2] + kCamera.c_x_px, static_cast<double>(i % 3), 1e-6);
        EXPECT_NEAR(kCamera.f_y_px * p[1] / p[2] + kCamera.c_y_px, static_cast<double>(i / 3), 1e-6);
      }
    }
  }
}

TEST(DepthImages, SayWhereNothingWasMeasured) {
  for (const float none :
       {0.0F, -1.0F, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Image image(false);
    const auto octets = std::bit_cast<std::array<std::uint8_t, 4>>(none);
    std::copy(octets.begin(), octets.end(), image.data.begin());
    const auto points = points_of(image.message, kCamera);
    ASSERT_TRUE(points);
    EXPECT_TRUE(std::isnan(points->xyz_m[2])) << none;
    EXPECT_EQ(points->xyz_m[5], 2.0F);
  }
}

TEST(DepthImages, AreRefusedWithTheReason) {
  const auto refusal = [](const std::function<void(ImageMessage&)>& change) {
    Image image(true);
    change(image.message);
    return points_of(image.message, kCamera).status().message();
  };
  EXPECT_THAT(refusal([](auto& m) { m.encoding = "rgb8"; }),
              HasSubstr("encoding is 'rgb8'; allowed: 16UC1 (mm), 32FC1 (m)"));
  EXPECT_THAT(refusal([](auto& m) { m.encoding = "32FC1"; }),
              HasSubstr("a row has 6 octets; allowed: at least 12"));
  EXPECT_THAT(refusal([](auto& m) { m.height = 4'294'967'295; }), HasSubstr("allowed: 1 to"));
  EXPECT_THAT(refusal([](auto& m) { m.frame = "other"; }), HasSubstr("frame or size"));
  EXPECT_THAT(refusal([](auto& m) { m.step = 8; }), HasSubstr("data has 12 octets; allowed: 16"));
}

TEST(Cameras, AreThoseOfTheRectifiedPictureOrRefused) {
  CameraMessage message{
      .frame = "camera", .height = 480, .width = 640, .p = {500, 0, 320, 0, 0, 510, 240, 0, 0, 0, 1, 0}};
  const auto camera = pinhole_of(message);
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->f_x_px, 500);
  EXPECT_EQ(camera->f_y_px, 510);
  EXPECT_EQ(camera->c_x_px, 320);
  EXPECT_EQ(camera->c_y_px, 240);
  const auto refused = [&](const std::function<void(CameraMessage&)>& change) {
    CameraMessage other = message;
    change(other);
    return !pinhole_of(other).has_value();
  };
  EXPECT_TRUE(refused([](auto& m) { m.p[0] = 0; }));
  EXPECT_TRUE(refused([](auto& m) { m.p[5] = -1; }));
  EXPECT_TRUE(refused([](auto& m) { m.p[2] = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](auto& m) { m.p[1] = 3; }));
  EXPECT_TRUE(refused([](auto& m) { m.binning_x = 2; }));
  EXPECT_TRUE(refused([](auto& m) { m.has_region = true; }));
  EXPECT_TRUE(refused([](auto& m) { m.height = 0; }));
}

}  // namespace
}  // namespace phantom::ros2_gateway
