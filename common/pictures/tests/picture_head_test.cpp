#include "common/pictures/picture_head.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <random>
#include <vector>

namespace phantom::pictures {
namespace {

std::vector<std::uint8_t> encoded(const char* kind, int width_px, int height_px) {
  std::vector<std::uint8_t> octets;
  cv::imencode(kind, cv::Mat(height_px, width_px, CV_8UC3, cv::Scalar(10, 90, 200)), octets);
  return octets;
}

TEST(HeadOfAPicture, SaysKindAndSizeOfWhatOpenCvHasWritten) {
  for (const auto& [ending, kind] : {std::pair{".png", PictureKind::kPng}, {".jpg", PictureKind::kJpeg}}) {
    const auto head = picture_head(encoded(ending, 321, 47));
    ASSERT_TRUE(head) << ending;
    EXPECT_EQ(head->kind, kind);
    EXPECT_EQ(head->width_px, 321);
    EXPECT_EQ(head->height_px, 47);
  }
  EXPECT_FALSE(picture_head(encoded(".bmp", 321, 47)));
  EXPECT_FALSE(picture_head({}));
}

TEST(HeadOfAPicture, IsReadOfAnyOctetsWithoutReadingBeyondThem) {
  std::mt19937 random(5);
  int found = 0;
  for (const char* ending : {".png", ".jpg"}) {
    const std::vector<std::uint8_t> whole = encoded(ending, 64, 48);
    for (int k = 0; k < 4000; ++k) {
      std::vector<std::uint8_t> octets(whole.begin(),
                                       whole.begin() + static_cast<std::ptrdiff_t>(random() % whole.size()));
      for (int n = 0; n < 3 && !octets.empty(); ++n)
        octets[random() % octets.size()] = static_cast<std::uint8_t>(random());
      octets.shrink_to_fit();  // the address sanitiser sees a read beyond the end
      const auto head = picture_head(octets);
      if (!head) continue;
      ++found;
      EXPECT_GE(head->width_px, 0);
      EXPECT_LE(head->width_px, 1 << 30);
      EXPECT_GE(head->height_px, 0);
    }
  }
  EXPECT_GT(found, 100);
}

}  // namespace
}  // namespace phantom::pictures
