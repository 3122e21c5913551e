#include "components/ros2_gateway/sensors/camera_pictures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <random>

namespace phantom::ros2_gateway {
namespace {

using testing::HasSubstr;

struct Sent {
  ImageMessage image{.frame = {}, .height = 32, .width = 40, .encoding = "mono8", .step = 44, .data = {}};
  std::vector<std::uint8_t> data = std::vector<std::uint8_t>(44 * 32, 100);
  core::Expected<messages::CameraPicture> picture(int quality = 90) {
    image.data = data;
    return picture_of(image, quality);
  }
  std::string refusal() { return picture().status().message(); }
};

std::vector<std::uint8_t> file_of(const char* kind, int width_px = 40, int height_px = 32) {
  std::vector<std::uint8_t> octets;
  cv::Mat pixels(height_px, width_px, CV_8UC3);
  cv::randu(pixels, 0, 255);
  cv::imencode(kind, pixels, octets);
  return octets;
}

TEST(PictureOfARosCamera, GreyOnesLoseTheEndOfTheirRows) {
  Sent sent;
  for (std::size_t row = 0; row < 32; ++row) std::fill_n(sent.data.begin() + 44 * row + 40, 4, 255);
  const auto picture = sent.picture();
  ASSERT_TRUE(picture) << picture.status().message();
  const cv::Mat seen = cv::imdecode(picture->jpeg, cv::IMREAD_UNCHANGED);
  ASSERT_EQ(seen.size(), cv::Size(40, 32));
  EXPECT_EQ(seen.channels(), 1);
  EXPECT_NEAR(seen.at<std::uint8_t>(31, 39), 100, 4);
}

// Tries ros2_gateway: a camera's picture of another encoding
TEST(PictureOfARosCamera, WhatIsNotTakenIsRefusedWithWhatIsAllowed) {
  Sent sent;
  sent.image.encoding = "bayer_grbg8";
  EXPECT_EQ(sent.refusal(), "encoding is 'bayer_grbg8'; allowed: rgb8, bgr8, mono8");
  sent.image.encoding = std::string(1'000'000, 'x');
  EXPECT_LT(sent.refusal().size(), 100U);
  sent = {};
  sent.image.width = sent.image.height = 4'294'967'295;
  EXPECT_THAT(sent.refusal(), HasSubstr("allowed: 16 to 8192 each"));
  sent = {};
  sent.image.width = 8192, sent.image.height = 2049;
  EXPECT_THAT(sent.refusal(), HasSubstr("16777216 in all"));
  sent = {};
  sent.image.step = 39;
  EXPECT_EQ(sent.refusal(), "a row has 39 octets; allowed: at least 40");
  sent = {};
  sent.data.pop_back();
  EXPECT_EQ(sent.refusal(), "data has 1407 octets; allowed: 1408, the rows'");
  const auto refusal = [](const std::vector<std::uint8_t>& data, const char* format = "jpeg") {
    return picture_of(CompressedMessage{format, data}, 90).status().message();
  };
  EXPECT_EQ(refusal({}), "data are neither JPEG nor PNG; format is 'jpeg'");
  EXPECT_THAT(refusal(file_of(".jpg", 12, 40)), HasSubstr("has 12 x 40 px"));
  std::vector<std::uint8_t> huge = file_of(".png");
  for (const std::size_t at : {16U, 20U}) huge[at] = 0x40;
  EXPECT_THAT(refusal(huge), HasSubstr("has 1073741824 x 1073741824 px"));
  std::vector<std::uint8_t> cut = file_of(".png");
  cut.resize(cut.size() / 8);
  EXPECT_EQ(refusal(cut), "PNG is damaged");
  std::vector<std::uint8_t> long_jpeg = file_of(".jpg");
  long_jpeg.resize(messages::kMaxPictureBytes + 1);
  EXPECT_EQ(refusal(long_jpeg), "has 4194305 octets; allowed: 4194304");
}

// Tries ros2_gateway: a camera's picture of another encoding
TEST(PictureOfARosCamera, WhateverIsDoneToItsOctetsItIsAPictureOfItsSizeOrRefused) {
  std::mt19937 random(3);
  int taken = 0, refused = 0;
  for (const char* kind : {".png", ".jpg"}) {
    const std::vector<std::uint8_t> whole = file_of(kind);
    for (int k = 0; k < 300; ++k) {
      std::vector<std::uint8_t> octets = whole;
      if (k % 3 == 0) octets.resize(random() % octets.size());
      for (int n = 0; n < 3 && !octets.empty(); ++n)
        octets[random() % octets.size()] = static_cast<std::uint8_t>(random());
      const auto picture = picture_of(CompressedMessage{"png", octets}, 90);
      ++(picture ? taken : refused);
      if (!picture) continue;
      EXPECT_LE(std::uint64_t{picture->width} * picture->height, messages::kMaxPicturePixels);
      EXPECT_LE(picture->jpeg.size(), messages::kMaxPictureBytes);
    }
  }
  EXPECT_GT(taken, 50);
  EXPECT_GT(refused, 50);
}

}  // namespace
}  // namespace phantom::ros2_gateway
