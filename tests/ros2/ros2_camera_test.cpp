// A camera of ROS 2 on the operator's page: a node of another vendor's DDS publishes Images, which come
// through ros2_gateway and synthetic_viewer to whoever follows the page's picture; and once that node is
// killed, the picture says so.
#include <gtest/gtest.h>
#include <httplib.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <iostream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <regex>
#include <thread>
#include <vector>

#include "common/core/clock.hpp"
#include "tests/end_to_end/running_system.hpp"
#include "tests/ros2/foreign_node.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::ros2 {
namespace {

using end_to_end::RunningSystem;
using phantom::test::eventually;

constexpr std::uint32_t kWidth = 640, kHeight = 360;
constexpr double kMax_s = 180.0;  // only bounds a failing test

/// A process that publishes pictures, red on the left and blue on the right, ten a second.
class CameraNode {
 public:
  explicit CameraNode(int domain) : pid_(fork()) {
    if (pid_ != 0) return;
    test::ForeignNode node(domain, test::Distribution::kSinceIron);
    std::vector<std::uint8_t> data(std::size_t{3} * kWidth * kHeight, 20);
    for (std::size_t pixel = 0; pixel < data.size() / 3; ++pixel)
      data[3 * pixel + (pixel % kWidth < kWidth / 2 ? 0 : 2)] = 230;
    for (unsigned round = 0;; ++round) {
      for (std::size_t x = 0; x < 3 * kWidth; ++x)
        data[x] = static_cast<std::uint8_t>(round * 40);  // no still
      node.publish_image("rgb8", kWidth, kHeight, 3 * kWidth, data);
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
  ~CameraNode() { kill_it(); }
  CameraNode(const CameraNode&) = delete;
  CameraNode& operator=(const CameraNode&) = delete;
  /// As a host that loses its power: nobody is told.
  void kill_it() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }

 private:
  pid_t pid_;
};

/// The page's picture of the camera, as a browser follows it.
class CameraStream {
 public:
  explicit CameraStream(const std::string& page) {
    std::smatch found;
    if (!std::regex_search(page, found, std::regex("http://127\\.0\\.0\\.1:([0-9]+)")))
      throw std::runtime_error("no page: " + page);
    httplib::Client client("127.0.0.1", std::stoi(found[1]));
    const auto index = client.Get("/");
    const std::string text = index ? index->body : "";
    if (!std::regex_search(text, found, std::regex("name=\"stream-port\" content=\"([0-9]+)\"")))
      throw std::runtime_error("no stream's port: " + text);
    port_ = std::stoi(found[1]);
  }
  /// Follows the pictures until one is as it must be. False if none was.
  bool until(const std::function<bool(const cv::Mat&)>& wanted) {
    const core::Nanoseconds end_ns = core::monotonic_ns() + core::from_seconds(kMax_s);
    httplib::Client client("127.0.0.1", port_);
    client.set_read_timeout(static_cast<time_t>(kMax_s));
    std::string bytes;
    bool seen = false;
    const auto take = [&](const char* data, std::size_t size) {
      bytes.append(data, size);
      while (const auto jpeg = next_of(bytes)) {
        newest_ =
            cv::imdecode(cv::Mat(1, static_cast<int>(jpeg->size()), CV_8U, const_cast<char*>(jpeg->data())),
                         cv::IMREAD_COLOR);
        if (!newest_.empty() && wanted(newest_)) seen = true;
      }
      return !seen && core::monotonic_ns() < end_ns;
    };
    while (!seen && core::monotonic_ns() < end_ns) client.Get("/stream/camera", take);
    return seen;
  }
  const cv::Mat& newest() const { return newest_; }

 private:
  /// Takes the next whole picture out of what came.
  static std::optional<std::string> next_of(std::string& bytes) {
    static const std::string kHead = "Content-Length: ";
    const std::size_t head = bytes.find(kHead);
    const std::size_t begin = head == std::string::npos ? head : bytes.find("\r\n\r\n", head);
    if (begin == std::string::npos) return std::nullopt;
    const std::size_t size = std::stoul(bytes.substr(head + kHead.size()));
    if (bytes.size() < begin + 4 + size) return std::nullopt;
    std::string jpeg = bytes.substr(begin + 4, size);
    bytes.erase(0, begin + 4 + size);
    return jpeg;
  }
  int port_ = 0;
  cv::Mat newest_;
};

/// The middle value of a colour (0 blue, 2 red) in the left or right third of a picture: of the model's edges
/// and the words over it, which are few.
int colour_of(const cv::Mat& picture, bool right, int channel) {
  std::vector<int> values;
  for (int y = picture.rows / 3; y < 2 * picture.rows / 3; ++y)
    for (int x = 0; x < picture.cols / 3; ++x)
      values.push_back(picture.at<cv::Vec3b>(y, right ? picture.cols - 1 - x : x)[channel]);
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}
bool is_live(const cv::Mat& picture) {
  return colour_of(picture, false, 2) > 190 && colour_of(picture, true, 0) > 190 &&
         colour_of(picture, false, 0) < 60 && colour_of(picture, true, 2) < 60;
}
bool is_dark(const cv::Mat& picture) {
  return colour_of(picture, false, 2) < 130 && colour_of(picture, true, 0) < 130;
}

// Tries synthetic_viewer: video that stops
TEST(Ros2Camera, IsOnThePageAndItsSilenceIsShownWithinASecond) {
  const int ros_domain = phantom::test::own_domain(1);
  const std::filesystem::path camera =
      std::filesystem::temp_directory_path() / ("ros2_camera_" + std::to_string(getpid()) + ".yaml");
  std::ofstream(camera)
      << "name: gate\nsource: topic\nlens: {size_px: [640, 360], focal_px: [506.7, 506.7], "
         "centre_px: [319.5, 179.5]}\neye_m: [1.55, -1.45, 1.75]\nlook_at_m: [0.35, 0.0, 0.75]\n";
  RunningSystem system(
      0.0, "ros2_arm", "",
      {{"ros2_gateway",
        {{"\ndomain: 0 ", "\ndomain: " + std::to_string(ros_domain) + " "},
         {"\ninterfaces: []", "\ninterfaces: [127.0.0.1]"},
         {"\ninitial_peers: []", "\ninitial_peers: [127.0.0.1]"},
         {"image_topic: \"\"", "image_topic: image"},
         {"name: camera ", "name: gate "},
         {"jpeg_quality: 90           # [10 to 100] of what does not come as JPEG\n  largest_stamp_age_s: 0.5",
          "jpeg_quality: 90\n  largest_stamp_age_s: 5"}}},
       {"synthetic_viewer", {{"camera: \"\"", "camera: " + camera.string()}}}});
  ASSERT_TRUE(
      eventually([&] { return system.output().find("Operator's page: ") != std::string::npos; }, kMax_s))
      << system.output();
  const std::string said = system.output();
  CameraStream stream(said.substr(said.find("Operator's page: ")));
  double quickest_s = kMax_s;
  for (int round = 0; round < 3; ++round) {
    CameraNode node(ros_domain);
    ASSERT_TRUE(stream.until(is_live)) << "round " << round << ": no picture came\n" << system.output();
    if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"); folder && round == 0)
      cv::imwrite(std::string(folder) + "/ros2_camera.png", stream.newest());
    node.kill_it();
    const core::Nanoseconds killed_ns = core::monotonic_ns();
    ASSERT_TRUE(stream.until(is_dark)) << "round " << round << ": a picture is shown whose camera is silent";
    const double told_s = core::seconds(core::monotonic_ns() - killed_ns);
    quickest_s = std::min(quickest_s, told_s);
    std::cout << "told " << told_s << " s after the camera's end\n";
    if (const char* folder = std::getenv("PHANTOM_SCREENSHOTS"); folder && round == 0)
      cv::imwrite(std::string(folder) + "/ros2_camera_lost.png", stream.newest());
  }
  EXPECT_LT(quickest_s, 1.0)
      << "a busy host delays some, not the quickest: silent_s and a round of the viewer";
  system.stop();
  EXPECT_EQ(system.wait(), 0) << system.output();
  std::filesystem::remove(camera);
}

}  // namespace
}  // namespace phantom::ros2
