#include "common/pictures/png.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <random>

namespace phantom::pictures {
namespace {

TEST(Png, IsReadByAnotherLibraryAsItWasDrawn) {
  std::mt19937 random(7);
  for (const auto& [width, height] : {std::pair{1, 1}, {3, 5}, {640, 360}}) {
    cv::Mat whole(height + 2, width + 3, CV_8UC3);
    for (int i = 0; i < static_cast<int>(whole.total() * 3); ++i)
      whole.data[i] = static_cast<std::uint8_t>(random());
    const cv::Mat part = whole(cv::Rect(2, 1, width, height));  // rows farther apart than they are long
    const auto bytes = encode_png(part.data, part.cols, part.rows, part.step[0]);
    const cv::Mat read = cv::imdecode(bytes, cv::IMREAD_COLOR);
    ASSERT_EQ(read.size(), part.size());
    EXPECT_EQ(cv::norm(read, part, cv::NORM_INF), 0.0);
  }
}

TEST(Png, WithoutPixelsIsRefused) {
  const std::uint8_t pixel[3] = {};
  EXPECT_THROW(encode_png(pixel, 0, 1, 3), std::runtime_error);
  EXPECT_THROW(encode_png(pixel, 1, 0, 3), std::runtime_error);
}

}  // namespace
}  // namespace phantom::pictures
