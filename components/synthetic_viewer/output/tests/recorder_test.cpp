// Recordings, read back with the library's reader.
#include "components/synthetic_viewer/output/recorder.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <thread>

#include "tests/support/eventually.hpp"

namespace phantom::synthetic_viewer {
namespace {

using phantom::test::eventually;

/// Time that passes when a test says so.
std::atomic<core::Nanoseconds> g_now_ns{core::kNsPerSecond};
core::Nanoseconds now_ns() { return g_now_ns; }
void pass(core::Nanoseconds time_ns) { g_now_ns += time_ns; }

class Recording : public ::testing::TestWithParam<VideoFormat> {
 protected:
  Recording() {
    folder_ = std::filesystem::path(::testing::TempDir()) / ("viewer_recording_" + std::to_string(getpid()));
    std::filesystem::remove_all(folder_);
  }
  ~Recording() override { std::filesystem::remove_all(folder_); }
  void publish(std::uint8_t grey) { source_.publish(Image(180, 320, CV_8UC3, cv::Scalar::all(grey))); }

  std::filesystem::path folder_;
  web::Broadcast<Image> source_;
};

TEST_P(Recording, HoldsThePicturesInRealTimeAndCanBePlayed) {
  Recorder recorder({folder_, GetParam(), 20.0, std::nullopt}, now_ns);
  EXPECT_FALSE(recorder.state().running);
  recorder.begin(View::kHit, source_);
  EXPECT_EQ(source_.followers, 1) << "so that the view is drawn at all";
  // First dark, then bright; each stands still for a while.
  publish(30);
  ASSERT_TRUE(eventually([&] { return recorder.state().frames == 1; }));
  pass(610 * core::kNsPerMillisecond);
  ASSERT_TRUE(eventually([&] { return recorder.state().frames == 13; })) << recorder.state().frames;
  publish(220);
  ASSERT_TRUE(eventually([&] { return source_.newest().use_count() == 3; })) << "the recorder has it";
  pass(600 * core::kNsPerMillisecond);
  recorder.end();
  const RecordingState state = recorder.state();
  EXPECT_FALSE(state.running);
  EXPECT_EQ(state.problem, "");
  EXPECT_EQ(source_.followers, 0);
  EXPECT_EQ(std::filesystem::path(state.file).filename().string().substr(0, 4), "hit_");

  cv::VideoCapture film(state.file);
  ASSERT_TRUE(film.isOpened()) << state.file;
  EXPECT_NEAR(film.get(cv::CAP_PROP_FPS), 20.0, 0.1);
  cv::Mat frame;
  std::vector<double> grey;
  while (film.read(frame)) {
    EXPECT_EQ(frame.cols, 320);
    EXPECT_EQ(frame.rows, 180);
    grey.push_back(cv::mean(frame)[1]);
  }
  ASSERT_EQ(grey.size(), 25U) << "one at once and 20 a second";
  for (std::size_t i = 0; i < grey.size(); ++i) EXPECT_NEAR(grey[i], i < 13 ? 30 : 220, 10) << i;
}

// It is told to end before its thread has looked again.
TEST_P(Recording, HoldsTheLastPictureUntilItsEnd) {
  Recorder recorder({folder_, GetParam(), 3.0, std::nullopt}, now_ns);
  recorder.begin(View::kHit, source_);
  publish(30);
  ASSERT_TRUE(eventually([&] { return recorder.state().frames == 1; }));
  pass(350 * core::kNsPerMillisecond);
  recorder.end();
  EXPECT_EQ(recorder.state().frames, 2);
  cv::VideoCapture film(recorder.state().file);
  cv::Mat frame;
  int frames = 0;
  while (film.read(frame)) ++frames;
  EXPECT_EQ(frames, 2);
}

TEST_P(Recording, AFolderThatCannotBeIsSaidAndNothingElseStops) {
  Recorder recorder({"/proc/no_such_folder", GetParam(), 20.0, std::nullopt});
  recorder.begin(View::kMain, source_);
  publish(90);
  ASSERT_TRUE(eventually([&] { return !recorder.state().running; }));
  EXPECT_NE(recorder.state().problem.find("/proc/no_such_folder"), std::string::npos);
  EXPECT_TRUE(eventually([&] { return source_.followers == 0; }));
}

TEST_P(Recording, EndsWithoutEverHavingHadAPicture) {
  Recorder recorder({folder_, GetParam(), 20.0, std::nullopt});
  recorder.begin(View::kTool, source_);
  recorder.end();
  EXPECT_EQ(recorder.state().file, "");
  EXPECT_EQ(recorder.state().problem, "");
}

INSTANTIATE_TEST_SUITE_P(Formats, Recording, ::testing::Values(VideoFormat::kMp4, VideoFormat::kAvi),
                         [](const auto& format) {
                           return format.param == VideoFormat::kMp4 ? "mp4" : "avi";
                         });

}  // namespace
}  // namespace phantom::synthetic_viewer
