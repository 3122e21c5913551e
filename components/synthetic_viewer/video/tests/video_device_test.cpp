// A camera that the kernel believes in: its virtual video driver (vivid), opened, asked for size and rate,
// unplugged and plugged in again as any V4L2 device. Needs root and the modules; scripts/test_can_vm has
// both.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <thread>

#include "common/core/errors.hpp"
#include "components/synthetic_viewer/video/video_feed.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::synthetic_viewer {
namespace {

using phantom::test::eventually;
using ::testing::HasSubstr;

constexpr int kDeviceWidth_px = 320, kDeviceHeight_px = 180;
constexpr double kDeviceRate_Hz = 10;

class VideoOfADevice : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("PHANTOM_V4L2") == nullptr)
      GTEST_SKIP() << "needs vivid and root; scripts/test_can_vm runs these cases on Debian's own kernel";
    bound_device_waits();
    camera_.name = "gate";
    camera_.kind = VideoKind::kDevice;
    camera_.path = "/dev/video0";
    camera_.rate_hz = kDeviceRate_Hz;
  }
  void TearDown() override { plug(true); }
  /// Binds the driver to its device, or takes it away, whoever has it open.
  static void plug(bool in) {
    if (std::getenv("PHANTOM_V4L2") == nullptr || in == std::filesystem::exists("/dev/video0")) return;
    std::ofstream("/sys/bus/platform/drivers/vivid/" + std::string(in ? "bind" : "unbind")) << "vivid.0";
  }
  /// Sets a control of the driver by its name.
  static void set_control(const char* name, int value) {
    const int device = open("/dev/video0", O_RDWR | O_CLOEXEC);
    v4l2_queryctrl found{};
    found.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    while (ioctl(device, VIDIOC_QUERYCTRL, &found) == 0 &&
           std::strcmp(reinterpret_cast<const char*>(found.name), name) != 0)
      found.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    v4l2_control chosen{found.id, value};
    EXPECT_EQ(ioctl(device, VIDIOC_S_CTRL, &chosen), 0) << name << ": " << std::strerror(errno);
    close(device);
  }
  /// Has the driver lose so many of 100 pictures.
  static void drop_pictures(int percent) { set_control("Percentage of Dropped Buffers", percent); }
  void start() {
    feed_ = std::make_unique<VideoFeed>(
        [this] { return open_video(camera_, kDeviceWidth_px, kDeviceHeight_px); }, core::kNsPerSecond);
  }
  VideoCamera camera_;
  std::unique_ptr<VideoFeed> feed_;
};

TEST_F(VideoOfADevice, IsOpenedInItsSizeAndAnotherIsRefused) {
  EXPECT_NO_THROW(open_video(camera_, kDeviceWidth_px, kDeviceHeight_px));
  try {
    open_video(camera_, 321, 180);
    ADD_FAILURE() << "opened in a size that it does not have";
  } catch (const core::MissingError& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("/dev/video0: has "));
    EXPECT_THAT(problem.what(), HasSubstr("allowed: 321 x 180 px, those of its lens"));
  }
}

TEST_F(VideoOfADevice, PicturesComeAtTheRateThatWasAskedForByTheKernelsClock) {
  set_control("Timestamp Source",
              1);  // the start of exposure: the driver tells the end of a frame in advance
  const auto source = open_video(camera_, kDeviceWidth_px, kDeviceHeight_px);
  std::vector<core::Nanoseconds> arrived_ns;
  const core::Nanoseconds until_ns = core::monotonic_ns() + 20 * core::kNsPerSecond;
  while (arrived_ns.size() < 22 && core::monotonic_ns() < until_ns) {
    const auto next = source->next();
    ASSERT_TRUE(next) << next.status().message();
    if (!next->has_value()) continue;
    EXPECT_EQ((*next)->image.size(), cv::Size(kDeviceWidth_px, kDeviceHeight_px));
    const core::Nanoseconds now_ns = core::monotonic_ns();
    EXPECT_LE((*next)->arrived_ns, now_ns);
    arrived_ns.push_back((*next)->arrived_ns);
    // Whoever reads late has the kernel's time of the picture all the same.
    if (arrived_ns.size() % 5 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(150));
  }
  ASSERT_EQ(arrived_ns.size(), 22U);
  // The first two were taken before they were asked for.
  for (std::size_t i = 3; i < arrived_ns.size(); ++i) {
    const double period_s = core::seconds(arrived_ns[i] - arrived_ns[i - 1]);
    const double periods = std::round(period_s * kDeviceRate_Hz);
    EXPECT_GE(periods, 1) << i;
    EXPECT_NEAR(period_s, periods / kDeviceRate_Hz, 0.004) << i;
  }
  const double mean_s =
      core::seconds(arrived_ns.back() - arrived_ns[2]) / static_cast<double>(arrived_ns.size() - 3);
  EXPECT_LT(mean_s, 1.5 / kDeviceRate_Hz);
}

TEST_F(VideoOfADevice, OneThatIsUnpluggedIsNamedAndShownAgainOnceItIsBack) {
  start();
  ASSERT_TRUE(eventually([&] { return feed_->status().number > 3; })) << feed_->status().problem;
  plug(false);
  ASSERT_TRUE(eventually([&] { return feed_->status().problem == "/dev/video0: was unplugged"; }))
      << feed_->status().problem;
  ASSERT_TRUE(eventually([&] { return feed_->status().problem == "/dev/video0: No such file or directory"; }))
      << feed_->status().problem;
  const std::uint64_t before = feed_->status().number;
  plug(true);
  EXPECT_TRUE(eventually([&] {
    return feed_->status().number > before + 3 && feed_->status().problem.empty();
  })) << feed_->status().problem;
}

TEST_F(VideoOfADevice, OneThatGivesNoPicturesHoldsNobodyUpAndIsNamed) {
  start();
  ASSERT_TRUE(eventually([&] { return feed_->status().number > 3; })) << feed_->status().problem;
  drop_pictures(100);
  ASSERT_TRUE(eventually([&] { return !feed_->status().problem.empty(); }));
  EXPECT_EQ(feed_->status().problem, "/dev/video0: delivers no more frames");
  drop_pictures(0);
  const std::uint64_t before = feed_->status().number;
  EXPECT_TRUE(eventually([&] {
    return feed_->status().number > before + 3 && feed_->status().problem.empty();
  })) << feed_->status().problem;
  drop_pictures(100);
  const core::Nanoseconds ends_ns = core::monotonic_ns();
  feed_.reset();
  EXPECT_LT(core::seconds(core::monotonic_ns() - ends_ns), 5.0);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
