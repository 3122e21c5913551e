#include "components/synthetic_viewer/video/video_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <random>

#include "common/core/errors.hpp"
#include "components/synthetic_viewer/video/video_feed.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::synthetic_viewer {
namespace {

using phantom::test::eventually;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

std::vector<std::uint8_t> encoded(const char* kind, int width_px, int height_px) {
  cv::Mat picture(height_px, width_px, CV_8UC3);
  cv::randu(picture, 0, 255);
  std::vector<std::uint8_t> octets;
  cv::imencode(kind, picture, octets);
  return octets;
}

TEST(PictureOfACamera, IsDecodedAndAnotherSizeIsRefusedBeforeThat) {
  for (const char* kind : {".png", ".jpg"}) {
    const auto good = decode_picture(encoded(kind, 64, 48), 64, 48);
    ASSERT_TRUE(good) << kind << good.status().message();
    EXPECT_EQ(good->cols, 64);
    EXPECT_EQ(good->type(), CV_8UC3);
    const auto other = decode_picture(encoded(kind, 65, 48), 64, 48);
    ASSERT_FALSE(other);
    EXPECT_EQ(other.status().message(), "has 65 x 48 px; allowed: 64 x 48 px, those of its lens");
  }
}

// Tries synthetic_viewer: a picture that is damaged, too large, or of another size
TEST(PictureOfACamera, OneThatSaysItIsHugeIsRefusedByItsHead) {
  std::vector<std::uint8_t> png = encoded(".png", 64, 48);
  for (const std::size_t at : {16U, 20U}) png[at] = 0x40;  // a thousand million columns and rows
  EXPECT_THAT(decode_picture(png, 64, 48).status().message(), HasSubstr("has 1073741824 x 1073741824 px"));
  std::vector<std::uint8_t> jpeg = encoded(".jpg", 64, 48);
  for (std::size_t at = 2; at + 9 < jpeg.size(); ++at)
    if (jpeg[at] == 0xFF && jpeg[at + 1] == 0xC0) jpeg[at + 5] = jpeg[at + 7] = 0xFF;
  EXPECT_THAT(decode_picture(jpeg, 64, 48).status().message(), HasSubstr("px; allowed: 64 x 48 px"));
}

// Tries synthetic_viewer: a picture that is damaged, too large, or of another size
TEST(PictureOfACamera, WhateverIsDoneToItsOctetsItIsAPictureOrRefused) {
  std::mt19937 random(7);
  int refused = 0;
  for (const char* kind : {".png", ".jpg"}) {
    const std::vector<std::uint8_t> whole = encoded(kind, 64, 48);
    for (int k = 0; k < 400; ++k) {
      std::vector<std::uint8_t> octets = whole;
      if (k % 2 == 0) octets.resize(random() % octets.size());
      for (int n = 0; n < 4 && !octets.empty(); ++n)
        octets[random() % octets.size()] = static_cast<std::uint8_t>(random());
      const auto image = decode_picture(octets, 64, 48);
      if (image) {
        EXPECT_EQ(image->size(), cv::Size(64, 48));
      } else {
        EXPECT_FALSE(image.status().message().empty());
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 200);
  EXPECT_EQ(decode_picture({}, 64, 48).status().message(), "is neither PNG nor JPEG");
}

class VideoOfACamera : public ::testing::Test {
 protected:
  VideoOfACamera() {
    fs::create_directories(folder_);
    camera_.name = "gate";
    camera_.rate_hz = 100;
    camera_.path = folder_;
    camera_.kind = VideoKind::kPictures;
  }
  ~VideoOfACamera() override {
    feed_.reset();
    fs::remove_all(folder_);
  }
  void put(const std::string& name, const std::vector<std::uint8_t>& octets) {
    std::ofstream(folder_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(octets.data()), static_cast<std::streamsize>(octets.size()));
  }
  void start() {
    feed_ =
        std::make_unique<VideoFeed>([this] { return open_video(camera_, 64, 48); }, core::kNsPerSecond / 100);
  }
  std::string refusal() {
    try {
      open_video(camera_, 64, 48);
    } catch (const core::MissingError& problem) {
      return problem.what();
    }
    return "opened";
  }
  VideoCamera camera_;
  const fs::path folder_ = fs::path(::testing::TempDir()) / ("video_" + std::to_string(getpid()));
  std::unique_ptr<VideoFeed> feed_;
};

TEST_F(VideoOfACamera, AFolderIsPlayedOverAndOverAndWhatIsNoGoodInItIsToldAndLeftOut) {
  put("1.png", encoded(".png", 64, 48));
  put("2.jpg", std::vector<std::uint8_t>(200, 0xFF));
  put("3.jpg", encoded(".jpg", 80, 48));
  put("4.png", encoded(".png", 64, 48));
  put("5.jpg", std::vector<std::uint8_t>(kMaxPictureFileBytes + 100, 0));
  fs::create_symlink("/dev/zero", folder_ / "6.jpg");       // it would never end
  ASSERT_EQ(mkfifo((folder_ / "7.jpg").c_str(), 0600), 0);  // nobody writes to it
  start();
  std::vector<std::string> problems;
  ASSERT_TRUE(eventually([&] {
    const VideoStatus status = feed_->status();
    if (!status.problem.empty() && !std::ranges::count(problems, status.problem))
      problems.push_back(status.problem);
    return status.number > 5 && problems.size() >= 4 && status.refused > 10;
  }));
  std::string all;
  for (const std::string& problem : problems) all += problem + "\n";
  EXPECT_THAT(all, HasSubstr("is no file"));
  EXPECT_EQ(feed_->status().newest->image.size(), cv::Size(64, 48));
}

// Tries synthetic_viewer: a camera that is not there
TEST_F(VideoOfACamera, ADeviceThatIsNotThereIsNamedAndTriedAgain) {
  camera_.kind = VideoKind::kDevice;
  camera_.path = "/dev/video_that_is_not_there";
  EXPECT_EQ(refusal(), "/dev/video_that_is_not_there: No such file or directory");
  camera_.path = "/dev/null";
  EXPECT_THAT(refusal(), HasSubstr("/dev/null: gives no video: it is in use, or no V4L2 camera"));
  camera_.path = folder_;
  EXPECT_THAT(refusal(), HasSubstr("is no device; allowed: a V4L2 device such as /dev/video0"));
  camera_.kind = VideoKind::kPictures;
  EXPECT_THAT(refusal(), HasSubstr("has no pictures; allowed: files *.png, *.jpg, *.jpeg"));
  start();
  ASSERT_TRUE(eventually([&] { return !feed_->status().problem.empty(); }));
  put("1.png", encoded(".png", 64, 48));
  EXPECT_TRUE(eventually([&] { return feed_->status().number > 0 && feed_->status().problem.empty(); }));
}

class VideoOfATopic : public VideoOfACamera {
 protected:
  void listen() {
    feed_ = std::make_unique<VideoFeed>([this] { return open_topic("gate", inbox_, 64, 48); }, 1000000);
  }
  bool told(const char* words) {
    return eventually([&] { return feed_->status().problem.find(words) != std::string::npos; });
  }
  PictureInbox inbox_;
};

TEST_F(VideoOfATopic, TheNewestPictureIsShownWithItsTimes) {
  inbox_.put({encoded(".png", 64, 48), {}, 5});
  inbox_.put({encoded(".jpg", 64, 48), 20, 30});
  listen();
  ASSERT_TRUE(eventually([&] { return feed_->status().number == 1; })) << feed_->status().problem;
  EXPECT_EQ(feed_->status().newest->exposed_ns, 20);
  EXPECT_EQ(feed_->status().newest->arrived_ns, 30);
}

// Tries synthetic_viewer: a camera_picture that is not valid
// Tries synthetic_viewer: no camera_picture of the camera's name comes
TEST_F(VideoOfATopic, WhyNothingIsShownIsToldUntilSomethingIs) {
  listen();
  EXPECT_TRUE(told("no camera_picture comes of 'gate'"));
  inbox_.put_foreign("door");
  EXPECT_TRUE(told("camera_picture comes of 'door'; allowed: of 'gate', this camera"));
  EXPECT_EQ(feed_->status().refused, 0U);
  inbox_.refuse("a camera_picture: width is 3; allowed: 16 to 8192");
  EXPECT_TRUE(told("width is 3"));
  for (const auto& [octets, words] :
       {std::pair{std::vector<std::uint8_t>(5000, 0xFF), "a camera_picture is neither PNG nor JPEG"},
        {encoded(".jpg", 80, 48), "has 80 x 48 px; allowed: 64 x 48 px, those of its lens"}}) {
    inbox_.put({octets, {}, 1});
    EXPECT_TRUE(told(words));
  }
  EXPECT_EQ(feed_->status().refused, 3U);
  inbox_.put({encoded(".jpg", 64, 48), {}, 2});
  EXPECT_TRUE(eventually([&] { return feed_->status().number == 1; }));
}

TEST_F(VideoOfACamera, AVideoIsPlayedAtItsRateOverAndOver) {
  camera_.kind = VideoKind::kFile;
  camera_.path = folder_ / "video.avi";
  camera_.rate_hz = 50;
  EXPECT_THAT(refusal(), HasSubstr("No such file"));
  {
    cv::VideoWriter writer(camera_.path, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'),
                           25, {64, 48});
    ASSERT_TRUE(writer.isOpened());
    for (int k = 0; k < 5; ++k) writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(40 * k)));
  }
  const core::Nanoseconds begin_ns = core::monotonic_ns();
  start();
  ASSERT_TRUE(eventually([&] { return feed_->status().number >= 20; })) << feed_->status().problem;
  EXPECT_GE(core::monotonic_ns() - begin_ns, 19 * core::kNsPerSecond / 50 - core::kNsPerSecond / 50);
  feed_.reset();
  std::ofstream(camera_.path) << "this is no video";
  EXPECT_THAT(refusal(), HasSubstr("is no video that this system can read"));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
