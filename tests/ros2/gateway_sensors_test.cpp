// What ros2_gateway hands on of the sensors and cameras of a ROS 2 domain, beside another vendor's DDS.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <optional>

#include "common/core/clock.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "tests/ros2/gateway_rig.hpp"

namespace phantom::ros2 {
namespace {

test::Cloud three_points() {
  test::Cloud cloud{.frame = "lidar",
                    .stamp_ns = core::utc_ns(),
                    .height = 1,
                    .width = 3,
                    .point_step = 16,
                    .row_step = 48,
                    .fields = {{"x", 0, 7, 1}, {"y", 4, 7, 1}, {"z", 8, 7, 1}, {"intensity", 12, 7, 1}},
                    .data = {}};
  const float values[] = {1, 2, 3, 9, NAN, 2, 3, 9, 4, 5, 6, 9};
  cloud.data.resize(sizeof(values));
  std::memcpy(cloud.data.data(), values, sizeof(values));
  return cloud;
}

// Tries ros2_gateway: a cloud or an image whose fields, sizes or numbers are not as its definition has them
TEST_F(GatewayData, HandsOnTheCloudOfASensor) {
  config_.points.cloud = "cloud";
  start();
  Heard<msg::SensorPoints> points(participant_, dds::kSensorPoints);
  std::int64_t stamp_ns = 0;
  ASSERT_TRUE(dds::eventually([&] {
    test::Cloud cloud = three_points();
    stamp_ns = cloud.stamp_ns;
    node_.publish_cloud(cloud);
    return !points.all().empty();
  }));
  const auto first = points.all().front();
  EXPECT_EQ(first.frame, "lidar");
  EXPECT_EQ(first.width, 3u);
  EXPECT_NEAR(static_cast<double>(first.measured_utc_ns), static_cast<double>(stamp_ns), 30e9);
  ASSERT_EQ(first.xyz_m.size(), 9u);
  EXPECT_EQ(first.xyz_m[1], 2.0F);
  EXPECT_TRUE(std::isnan(first.xyz_m[3]) && std::isnan(first.xyz_m[4]));
  EXPECT_EQ(first.xyz_m[8], 6.0F);
  // None of these comes through; what is sound after them does.
  for (const auto& damage : std::vector<std::function<void(test::Cloud&)>>{
           [](auto& c) { c.width = 4'000'000'000; }, [](auto& c) { c.height = 2; },
           [](auto& c) { c.fields.pop_back(), c.fields.pop_back(); },
           [](auto& c) { c.fields.resize(100, c.fields[0]); }, [](auto& c) { c.stamp_ns -= 10'000'000'000; },
           [](auto& c) { c.data.clear(); }}) {
    test::Cloud cloud = three_points();
    cloud.frame = "damaged";
    damage(cloud);
    node_.publish_cloud(cloud);
  }
  EXPECT_TRUE(dds::eventually([&] {
    test::Cloud cloud = three_points();
    cloud.frame = "again";
    node_.publish_cloud(cloud);
    return points.last().frame == "again";
  }));
  for (const auto& one : points.all()) EXPECT_NE(one.frame, "damaged");
}

// Tries ros2_gateway: depth images without their camera_info
TEST_F(GatewayData, HandsOnDepthImagesAsPoints) {
  config_.points.depth = "depth";
  config_.points.camera_info = "camera_info";
  start();
  Heard<msg::SensorPoints> points(participant_, dds::kSensorPoints);
  const auto send = [&] { node_.publish_depth("camera", 2, 1, {2.0F, 0.0F}); };
  for (int k = 0; k < 20; ++k) send();
  EXPECT_TRUE(points.all().empty()) << "where its pixels look is not known";
  ASSERT_TRUE(dds::eventually([&] {
    node_.publish_camera("camera", 2, 1, {100, 0, 1, 0, 0, 100, 0.5, 0, 0, 0, 1, 0});
    send();
    return !points.all().empty();
  }));
  const auto one = points.last();
  EXPECT_EQ(one.frame, "camera");
  ASSERT_EQ(one.xyz_m.size(), 6u);
  EXPECT_FLOAT_EQ(one.xyz_m[0], -1.0F * 2.0F / 100.0F);
  EXPECT_FLOAT_EQ(one.xyz_m[1], -0.5F * 2.0F / 100.0F);
  EXPECT_FLOAT_EQ(one.xyz_m[2], 2.0F);
  EXPECT_TRUE(std::isnan(one.xyz_m[5]));
}

TEST_F(GatewayData, HandsOnTheImagesOfTwoDepthCameras) {
  config_.depth_cameras.resize(2);
  auto& above = config_.depth_cameras[0];
  above.name = "above";
  above.topics.depth = "depth";
  above.topics.camera_info = "camera_info";
  auto& left = config_.depth_cameras[1];
  left.name = "left";
  left.topics.cloud = "cloud";
  left.topics.camera_info = "camera_info";
  start();
  Heard<msg::DepthImage> images(participant_, dds::kDepthImage);
  const auto of = [&](const std::string& name) {
    std::optional<messages::DepthImage> found;
    for (const auto& image : images.all())
      if (image.camera == name) found = image;
    return found;
  };
  ASSERT_TRUE(dds::eventually([&] {
    node_.publish_camera("lidar", 2, 1, {100, 0, 0.5, 0, 0, 100, 0, 0, 0, 0, 1, 0});
    node_.publish_depth("lidar", 2, 1, {2.0F, 0.0F});
    test::Cloud cloud = three_points();
    const float values[] = {-0.005F, 0, 1, 9, NAN, 2, 3, 9, 0.01F, 0, 2, 9};
    std::memcpy(cloud.data.data(), values, sizeof(values));
    node_.publish_cloud(cloud);
    return of("above") && of("left");
  }));
  EXPECT_THAT(of("above")->depth_mm, testing::ElementsAre(2000, 0));
  EXPECT_THAT(of("left")->depth_mm, testing::ElementsAre(1000, 2000));
  EXPECT_EQ(of("left")->fx_px, 100.0);
  EXPECT_GE(of("above")->age_s, 0.0);
  EXPECT_LE(of("above")->age_s, 10.0);
}

/// A picture whose left half is red and whose right half is blue, in the order of an Image's encoding.
std::vector<std::uint8_t> red_and_blue(const char* encoding, std::uint32_t width, std::uint32_t height,
                                       std::uint32_t step) {
  std::vector<std::uint8_t> data(std::size_t{step} * height, 7);
  const std::size_t red = std::string(encoding) == "rgb8" ? 0 : 2;
  for (std::size_t row = 0; row < height; ++row)
    for (std::size_t x = 0; x < width; ++x)
      for (std::size_t c = 0; c < 3; ++c)
        data[row * step + 3 * x + c] = c == (x < width / 2 ? red : 2 - red) ? 230 : 20;
  return data;
}
void expect_red_and_blue(const messages::CameraPicture& picture) {
  const cv::Mat image = cv::imdecode(picture.jpeg, cv::IMREAD_COLOR);
  ASSERT_EQ(image.size(), cv::Size(static_cast<int>(picture.width), static_cast<int>(picture.height)));
  for (const auto& [x, channel] : {std::pair{4, 2}, {image.cols - 5, 0}})
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(image.at<cv::Vec3b>(image.rows / 2, x)[c], c == channel ? 230 : 20, 25) << x << ' ' << c;
}

// Tries ros2_gateway: a camera's picture of another encoding
TEST_F(GatewayData, HandsOnThePicturesOfACamera) {
  config_.camera.image_topic = "image";
  config_.camera.name = "gate";
  config_.camera.rate_Hz = 120.0;
  start();
  Heard<msg::CameraPicture> pictures(participant_, dds::kCameraPicture);
  const core::Nanoseconds begin_ns = core::utc_ns();
  for (const char* encoding : {"rgb8", "bgr8"}) {
    const std::uint32_t width = encoding[0] == 'r' ? 64 : 66;
    // None of these comes through; what is sound after them does.
    for (int k = 0; k < 20; ++k) {
      node_.publish_image("bayer_rggb8", 64, 50, 64, std::vector<std::uint8_t>(64 * 50));
      node_.publish_image("yuv422", 64, 50, 128, std::vector<std::uint8_t>(128 * 50));
      node_.publish_image("rgb8", 4'000'000'000, 4'000'000'000, 12, {1, 2, 3});
      node_.publish_image("rgb8", 64, 50, 190, std::vector<std::uint8_t>(190 * 50));
    }
    ASSERT_TRUE(dds::eventually([&] {
      node_.publish_image(encoding, width, 48, 200, red_and_blue(encoding, width, 48, 200));
      return !pictures.all().empty() && pictures.last().width == width;
    })) << encoding;
    const auto picture = pictures.last();
    EXPECT_EQ(picture.camera, "gate");
    EXPECT_GE(picture.exposed_utc_ns, begin_ns);
    EXPECT_LE(picture.exposed_utc_ns, core::utc_ns());
    expect_red_and_blue(picture);
  }
  for (const auto& picture : pictures.all()) EXPECT_EQ(picture.height, 48u);
}

TEST_F(GatewayData, HandsOnACamerasCompressedPicturesAndJpegAsItCame) {
  config_.camera.compressed_topic = "image/compressed";
  config_.camera.largest_stamp_age_s = 0.0;
  config_.camera.rate_Hz = 120.0;
  start();
  Heard<msg::CameraPicture> pictures(participant_, dds::kCameraPicture);
  const auto data = red_and_blue("bgr8", 64, 48, 192);
  const cv::Mat image(48, 64, CV_8UC3, const_cast<std::uint8_t*>(data.data()));
  std::vector<std::uint8_t> jpeg, png;
  cv::imencode(".jpg", image, jpeg);
  for (int k = 0; k < 20; ++k) node_.publish_compressed("16UC1; compressedDepth png", {1, 2, 3, 4});
  ASSERT_TRUE(dds::eventually([&] {
    node_.publish_compressed("rgb8; jpeg compressed bgr8", jpeg);
    return !pictures.all().empty();
  }));
  for (const auto& picture : pictures.all()) EXPECT_EQ(picture.jpeg, jpeg);
  EXPECT_EQ(pictures.last().camera, "camera");
  EXPECT_EQ(pictures.last().exposed_utc_ns, 0) << "a clock that is not trusted is not handed on";
  cv::imencode(".png", image, png);
  ASSERT_TRUE(dds::eventually([&] {
    node_.publish_compressed("png", png);
    return pictures.last().jpeg != jpeg;
  }));
  expect_red_and_blue(pictures.last());
}

}  // namespace
}  // namespace phantom::ros2
