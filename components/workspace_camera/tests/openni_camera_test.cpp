#include "components/workspace_camera/openni_camera.hpp"

#include <OniCAPI.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <fstream>
#include <semaphore>
#include <thread>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "components/workspace_camera/config.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/files.hpp"

namespace phantom::workspace_camera::openni_camera_test {
namespace {

using testing::HasSubstr;

OpenNiOptions device(const std::string& kind) {
  OpenNiOptions options;
  options.device = "phantom:" + kind;
  return options;
}

class Eye {
 public:
  explicit Eye(const OpenNiOptions& options) : camera_(options) {
    camera_.start([this] { came_.release(); });
  }
  OpenNiCamera::Image next() {
    for (;;) {
      came_.acquire();
      if (auto image = camera_.take()) return *std::move(image);
    }
  }
  void let_pass(int images) {
    for (int i = 0; i < images; ++i) came_.acquire();
  }
  /// Waits until the camera says why it sends nothing.
  std::string trouble(const std::string& other_than = "nothing was read") {
    for (;;) {
      if (std::string said = camera_.trouble(); said != other_than) return said;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

 private:
  std::counting_semaphore<> came_{0};
  OpenNiCamera camera_;
};

TEST(OpenNiCamera, GivesTheDepthsOfADeviceInMillimetres) {
  for (const char* kind : {"still", "tenths", "mirrored", "padded"}) {
    SCOPED_TRACE(kind);
    Eye eye(device(kind));
    const auto image = eye.next();
    ASSERT_EQ(image.depth_mm.size(), 320U * 240U);
    EXPECT_EQ(image.depth_mm[0], 1000U);
    EXPECT_EQ(image.depth_mm[319], 1319U) << "right of the image is right of the camera";
    EXPECT_EQ(image.depth_mm[320U * 239U + 7U], 1007U);
    EXPECT_GT(image.received_ns, 0);
    EXPECT_TRUE(eye.trouble().empty());
  }
}

TEST(OpenNiCamera, WithoutAUriTheFirstDeviceIsRead) {
  Eye eye(OpenNiOptions{});
  EXPECT_EQ(eye.next().depth_mm[5], 1005U);
}

TEST(OpenNiCamera, OfItsImagesTheNewestWaits) {
  Eye eye(device("still"));
  const auto first = eye.next();
  eye.let_pass(4);
  const auto later = eye.next();
  EXPECT_GE(later.depth_mm[320], first.depth_mm[320] + 4);
  EXPECT_GT(later.received_ns, first.received_ns);
}

TEST(OpenNiCamera, SeveralAreReadAtOnce) {
  for (int i = 0; i < 5; ++i) {
    Eye one(device("still")), other(device("tenths")), missing(device("without_depth"));
    EXPECT_EQ(one.next().depth_mm[3], 1003U);
    EXPECT_EQ(other.next().depth_mm[3], 1003U);
    EXPECT_FALSE(missing.trouble().empty());
  }
}

/// The optics are those of OpenNI's own conversion.
TEST(OpenNiCamera, SeesWhereOpenNiHasIt) {
  Eye eye(device("still"));
  const fusion::PinholeCamera camera = eye.next().camera;
  OniDeviceHandle opened = nullptr;
  OniStreamHandle stream = nullptr;
  ASSERT_EQ(oniDeviceOpen("phantom:still", &opened), ONI_STATUS_OK);
  ASSERT_EQ(oniDeviceCreateStream(opened, ONI_SENSOR_DEPTH, &stream), ONI_STATUS_OK);
  for (const auto& [u, v] : {std::pair(0.0F, 0.0F), {319.0F, 0.0F}, {160.0F, 120.0F}, {17.0F, 200.0F}}) {
    float x_mm = 0.0F, y_mm = 0.0F, z_mm = 0.0F;  // y is up
    ASSERT_EQ(oniCoordinateConverterDepthToWorld(stream, u, v, 1500.0F, &x_mm, &y_mm, &z_mm), ONI_STATUS_OK);
    const Eigen::Vector3d p_mm = 1500.0 * camera.direction(static_cast<double>(u), static_cast<double>(v));
    EXPECT_NEAR(p_mm.x(), static_cast<double>(x_mm), 0.01);
    EXPECT_NEAR(p_mm.y(), static_cast<double>(-y_mm), 0.01);
    EXPECT_NEAR(p_mm.z(), static_cast<double>(z_mm), 0.01);
  }
  oniStreamDestroy(stream);
  oniDeviceClose(opened);
}

TEST(OpenNiCamera, ADeviceThatTellsNoOpticsNeedsAFocalLength) {
  OpenNiOptions options = device("without_optics");
  {
    Eye eye(options);
    EXPECT_THAT(eye.trouble(), HasSubstr("allowed: openni.focal_px of the configuration"));
  }
  options.focal_px = 285.0;
  Eye eye(options);
  EXPECT_EQ(eye.next().camera.fy_px, 285.0);
}

// Tries workspace_camera: an OpenNI device is missing, sends nothing for a second, or sends what is no depth
// image
TEST(OpenNiCamera, SaysWhyADeviceGivesNoImages) {
  const std::pair<const char*, const char*> kinds[] = {
      {"without_depth", "the device measures no depths"},
      {"cropped", "the frame has 320 × 240 pixels, cropped; allowed: 320 × 240, as the device tells"},
      {"short", "the frame has 76800 octets in rows of 640; allowed: all of its pixels"}};
  for (const auto& [kind, why] : kinds) {
    Eye eye(device(kind));
    EXPECT_THAT(eye.trouble(), HasSubstr(why));
  }
  OpenNiOptions missing;
  missing.device = "1d27/0609@1/99";
  Eye eye(missing);
  EXPECT_THAT(eye.trouble(), HasSubstr("the device cannot be opened"));
}

// Tries workspace_camera: an OpenNI device is missing, sends nothing for a second, or sends what is no depth
// image
TEST(OpenNiCamera, ADeviceThatFallsSilentIsOpenedAgain) {
  Eye eye(device("unplugged"));
  EXPECT_EQ(eye.next().depth_mm[0], 1000U);
  EXPECT_EQ(eye.trouble(""), "the device has sent nothing for a second");
  while (eye.next().depth_mm[0] < 2000U) {
  }
  EXPECT_EQ(eye.trouble("the device has sent nothing for a second"), "");
}

/// Records with OpenNI's own recorder, and plays with its own player.
TEST(OpenNiCamera, PlaysARecording) {
  const std::string file = test::new_folder() / "still.oni";
  {
    Eye keeps_openni(device("still"));
    OniDeviceHandle opened = nullptr;
    OniStreamHandle stream = nullptr;
    OniRecorderHandle recorder = nullptr;
    ASSERT_EQ(oniDeviceOpen("phantom:still", &opened), ONI_STATUS_OK);
    ASSERT_EQ(oniDeviceCreateStream(opened, ONI_SENSOR_DEPTH, &stream), ONI_STATUS_OK);
    ASSERT_EQ(oniCreateRecorder(file.c_str(), &recorder), ONI_STATUS_OK);
    ASSERT_EQ(oniRecorderAttachStream(recorder, stream, FALSE), ONI_STATUS_OK);
    ASSERT_EQ(oniStreamStart(stream), ONI_STATUS_OK);
    ASSERT_EQ(oniRecorderStart(recorder), ONI_STATUS_OK);
    for (int i = 0; i < 10; ++i) {
      OniFrame* frame = nullptr;
      ASSERT_EQ(oniStreamReadFrame(stream, &frame), ONI_STATUS_OK);
      oniFrameRelease(frame);
    }
    oniRecorderStop(recorder);
    oniRecorderDestroy(&recorder);
    oniStreamStop(stream);
    oniStreamDestroy(stream);
    oniDeviceClose(opened);
  }
  OpenNiOptions options;
  options.device = file;
  ASSERT_TRUE(options.is_recording());
  Eye eye(options);
  for (int i = 0; i < 20; ++i) {  // more than it has: it is repeated
    const auto image = eye.next();
    ASSERT_EQ(image.depth_mm.size(), 320U * 240U);
    EXPECT_EQ(image.depth_mm[11], 1011U);
    EXPECT_NEAR(image.camera.fx_px, 160.0 / std::tan(0.5), 1e-3);
  }
}

TEST(OpenNiCamera, ADamagedRecordingIsNamed) {
  const std::string file = test::new_folder() / "damaged.oni";
  std::ofstream(file) << "what is this?";
  OpenNiOptions options;
  options.device = file;
  Eye eye(options);
  EXPECT_THAT(eye.trouble(), HasSubstr("the device cannot be opened"));
}

/// workspace_camera itself, which looks through a device into a cell without an arm.
class OpenNiProcess : public testing::Test {
 protected:
  void SetUp() override {
    write("cell.yaml",
          "name: bare\nworkspace: {min_m: [-1, -1, 0], max_m: [1, 1, 1.6], voxel_size_m: 0.02}\n"
          "profile: {thickness_vox: [2], mu_Pa_s_per_m: [10], mu_skin_Pa_s_per_m: 100}\nobjects:\n"
          "  - {name: block, primitive: {box: {size_m: [0.2, 0.2, 0.2]}}, pose: {xyz_m: [0.5, 0.5, 0.2]}}\n");
    write("topology.yaml", "name: test\ndomain: " + std::to_string(network_.domain) +
                               "\nqos_profiles: " + network_.qos_profiles.string() + "\ncell: cell.yaml\n" +
                               "network: {interfaces: [127.0.0.1]}\n");
    write("camera.yaml",
          "cameras: [{name: above, driver: openni, pose: {xyz_m: [0, 0, 1.5], rpy_deg: [180, 0, "
          "0]}}]\n");
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  std::vector<std::string> words() const {
    return {PHANTOM_BIN_DIR "/workspace_camera", "--deployment", folder_ / "topology.yaml", "--config",
            folder_ / "camera.yaml"};
  }
  core::NetworkOptions network_ = dds::test_network();
  const std::filesystem::path folder_ = test::new_folder();
};

TEST_F(OpenNiProcess, FusesTheImagesOfADevice) {
  std::atomic<double> images = 0.0;
  std::atomic<bool> running = false;
  dds::Participant participant("openni_camera_test", network_);
  const dds::Reader<msg::ComponentStatus> status(
      participant, dds::kComponentStatus, [&](const msg::ComponentStatus& sample, const dds::SampleInfo&) {
        running = sample.state() == msg::ComponentState::COMPONENT_RUNNING;
        for (const auto& figure : sample.figures())
          if (figure.name() == "images") images = figure.value();
      });
  test::Process process(words(), folder_ / "log");
  EXPECT_TRUE(dds::eventually([&] { return images > 10.0 && running; })) << process.output();
  EXPECT_EQ(process.end(SIGTERM), 0) << process.output();
}

TEST_F(OpenNiProcess, ARecordingIsASimulation) {
  write("camera.yaml",
        "cameras: [{name: above, driver: openni, openni: {device: run.oni}, pose: {xyz_m: [0, 0, 1.5]}}]\n");
  std::string line;
  for (const std::string& word : words()) line += word + " ";
  const test::Said said = test::run_line(line + "--check");
  EXPECT_EQ(said.exit_code, 2) << said.output;
  EXPECT_THAT(said.output, HasSubstr("simulation: true"));
}

// Tries workspace_camera: OpenNI 2 has no driver
TEST_F(OpenNiProcess, WithoutADriverOfOpenNiItNamesThePackage) {
  std::string line = "LD_LIBRARY_PATH=" PHANTOM_OPENNI_WITHOUT_DRIVERS;
  for (const std::string& word : words()) line += " " + word;
  const test::Said said = test::run_line(line + " --check");
  EXPECT_EQ(said.exit_code, 3) << said.output;
  EXPECT_THAT(said.output, HasSubstr("OpenNI 2 has no driver; allowed: Debian's libopenni2-0"));
}

TEST(OpenNiCamera, ItsConfigurationIsRead) {
  const auto folder = test::new_folder();
  std::ofstream(folder / "camera.yaml")
      << "cameras:\n  - name: above\n    driver: openni\n    pose: {xyz_m: [0, 0, 1]}\n"
         "    openni: {device: seen/run.oni, rate_hz: 60, latency_s: 0.05, focal_px: 570}\n";
  const WorkspaceCameraConfig config = load_config(folder / "camera.yaml");
  const OpenNiOptions& options = config.cameras.at(0).openni;
  EXPECT_EQ(config.cameras[0].driver, CameraDriver::kOpenNi);
  EXPECT_EQ(options.device, (folder / "seen/run.oni").string());
  EXPECT_EQ(options.rate_hz, 60);
  EXPECT_EQ(options.latency_s, 0.05);
  EXPECT_EQ(options.focal_px, 570.0);
}

}  // namespace
}  // namespace phantom::workspace_camera::openni_camera_test
