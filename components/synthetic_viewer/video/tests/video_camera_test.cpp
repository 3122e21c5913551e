#include "components/synthetic_viewer/video/video_camera.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "common/core/errors.hpp"
#include "components/synthetic_viewer/config.hpp"

namespace phantom::synthetic_viewer {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

const std::string kLens =
    "lens: {size_px: [640, 480], focal_px: [500, 501], centre_px: [320, 240], distortion: [-0.1, 0, 0, 0, 0]}\n";
const std::string kPose = "pose: {xyz_m: [1, 2, 3], rpy_deg: [-120, 0, 30]}\n";

class CameraFile : public ::testing::Test {
 protected:
  CameraFile() { fs::create_directories(folder_); }
  ~CameraFile() override { fs::remove_all(folder_); }
  fs::path write(const std::string& text, const std::string& name = "camera.yaml") {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  std::string refusal(const std::string& text) {
    try {
      load_video_camera(write(text));
    } catch (const core::ConfigError& problem) {
      return problem.what();
    } catch (const core::MissingError& problem) {
      return problem.what();
    }
    return "accepted";
  }
  const fs::path folder_ = fs::path(::testing::TempDir()) / ("video_camera_" + std::to_string(getpid()));
};

TEST_F(CameraFile, IsReadWithItsCalibration) {
  const VideoCamera camera = load_video_camera(
      write("name: gate\nsource: device\npath: /dev/video3\nlatency_ms: 80\n" + kLens + kPose));
  EXPECT_EQ(camera.path, "/dev/video3");
  EXPECT_DOUBLE_EQ(*camera.latency_s, 0.08);
  EXPECT_EQ(camera.calibration.lens->fy_px, 501);
  EXPECT_EQ(camera.calibration.lens->k1, -0.1);
  ASSERT_TRUE(camera.calibrated());
  EXPECT_EQ(camera.calibration.X_WC->translation_m, Eigen::Vector3d(1, 2, 3));
  const VideoCamera unknown = load_video_camera(write("name: gate\nsource: device\npath: /dev/video3\n"));
  EXPECT_FALSE(unknown.calibrated()) << "as calibrate needs it";
  EXPECT_FALSE(unknown.latency_s);
}

TEST_F(CameraFile, OneOfATopicNeedsNoPlaceOfItsOwn) {
  const VideoCamera camera = load_video_camera(write("name: gate\nsource: topic\n" + kLens + kPose));
  EXPECT_EQ(camera.kind, VideoKind::kTopic);
  EXPECT_EQ(camera.calibration_file, folder_ / "camera_calibration.yaml");
  EXPECT_FALSE(camera.names_calibration);
}

TEST_F(CameraFile, ASimulatedCameraStandsWhereItDidHoweverItIsCalibrated) {
  const std::string text =
      "name: gate\nsource: simulated\nsimulated: {pose_error: {xyz_m: [0.01, 0, 0]}}\n" + kLens + kPose;
  const VideoCamera before = load_video_camera(write(text));
  const auto stands = [](const VideoCamera& camera) {
    return *camera.calibration.X_WC * camera.simulated.X_CS;
  };
  Calibration other = before.calibration;
  other.X_WC->translation_m += Eigen::Vector3d(0.2, -0.1, 0.3);
  write_calibration(folder_ / "other.yaml", other);
  const VideoCamera after = load_video_camera(write(text + "calibration: other.yaml\n"));
  EXPECT_EQ(after.calibration_file, folder_ / "other.yaml");
  EXPECT_TRUE(after.names_calibration);
  EXPECT_NEAR((after.calibration.X_WC->translation_m - before.calibration.X_WC->translation_m).norm(),
              std::sqrt(0.14), 1e-6);
  EXPECT_LT((stands(after).translation_m - stands(before).translation_m).norm(), 1e-6);
  EXPECT_TRUE(stands(after).rotation.isApprox(stands(before).rotation, 1e-6));
}

TEST_F(CameraFile, AnUprightCameraIsGivenByWhereItStandsAndLooks) {
  const VideoCamera camera = load_video_camera(
      write("name: gate\nsource: simulated\neye_m: [2, 0, 1]\nlook_at_m: [0, 0, 1]\n" + kLens));
  const Eigen::Matrix3d& axes = camera.calibration.X_WC->rotation;
  EXPECT_TRUE(axes.col(2).isApprox(Eigen::Vector3d(-1, 0, 0)));
  EXPECT_TRUE(axes.col(1).isApprox(Eigen::Vector3d(0, 0, -1))) << "y is down";
  EXPECT_TRUE(axes.col(0).isApprox(Eigen::Vector3d(0, 1, 0)));
}

// Tries synthetic_viewer: a camera's file, or the calibration that it names
TEST_F(CameraFile, WhatIsWrongInItIsNamedWithPlaceAndWhatIsAllowed) {
  EXPECT_THAT(refusal("name: gate\nsource: webcam\n"), HasSubstr("camera.yaml:2: source: 'webcam'"));
  EXPECT_THAT(refusal("name: gate\nsource: device\n"), HasSubstr("path"));
  EXPECT_THAT(refusal("source: device\npath: /dev/video0\n"), HasSubstr("name"));
  EXPECT_THAT(refusal("name: gate\nsource: device\npath: x\nrate_hz: 0\n"), HasSubstr("0.1 to 120"));
  EXPECT_THAT(refusal("name: gate\nsource: device\npath: x\nlatency_ms: -3\n"), HasSubstr("0 to 5000"));
  EXPECT_THAT(refusal("name: gate\nsource: device\npath: x\nzoom: 3\n"), HasSubstr("zoom"));
  EXPECT_THAT(refusal("name: gate\nsource: simulated\n"), HasSubstr("needed by a simulated camera"));
  EXPECT_THAT(refusal("name: gate\nsource: device\npath: x\ncalibration: nowhere.yaml\n"),
              HasSubstr("nowhere.yaml"));
  EXPECT_THAT(
      refusal("name: gate\nsource: device\npath: x\neye_m: [0, 0, 1]\nlook_at_m: [1, 0, 1]\n" + kPose),
      HasSubstr("stands beside pose"));
  EXPECT_THAT(refusal("name: gate\nsource: device\npath: x\neye_m: [0, 0, 1]\nlook_at_m: [0, 0, 1]\n"),
              HasSubstr("must not be the place of eye_m"));
  const auto lens = [&](const std::string& text) {
    return refusal("name: gate\nsource: device\npath: x\nlens: {" + text + "}\n");
  };
  EXPECT_THAT(
      lens("size_px: [640, 480], focal_px: [500, 500], centre_px: [320, 240], distortion: [-3, 0, 0, 0, 0]"),
      HasSubstr("folds back within the picture"));
  EXPECT_THAT(lens("size_px: [640], focal_px: [500, 500], centre_px: [320, 240]"),
              HasSubstr("two whole numbers"));
  EXPECT_THAT(lens("size_px: [640, 480], focal_px: [500, 500], centre_px: [320, 2400]"),
              HasSubstr("outside"));
  EXPECT_THAT(lens("focal_px: [500, 500], centre_px: [320, 240]"), HasSubstr("size_px"));
}

// Tries synthetic_viewer: it is not calibrated
TEST_F(CameraFile, AViewNeedsACalibratedCamera) {
  write("name: gate\nsource: device\npath: /dev/video0\n");
  const fs::path viewer = write("camera_view: {camera: camera.yaml}\n", "viewer.yaml");
  try {
    load_config(viewer);
    FAIL() << "accepted";
  } catch (const core::ConfigError& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("has no lens or no pose: calibrate it"));
  }
  write("name: gate\nsource: device\npath: /dev/video0\n" + kLens + kPose);
  EXPECT_TRUE(load_config(viewer).camera_view.camera->calibrated());
}

TEST_F(CameraFile, ACalibrationIsReadAsItWasWrittenAndComesAsAWhole) {
  Calibration calibration;
  calibration.lens =
      camera::Lens{1280, 720, 901.25, 899.5, 640.125, 361.5, -0.25, 0.0625, 0.001, -0.0005, 0.015625};
  calibration.lens_residual_px = 0.25;
  for (const Eigen::Vector3d& turn :
       {Eigen::Vector3d(0.3, -1.1, 2.0), Eigen::Vector3d(0, M_PI / 2, 0), Eigen::Vector3d(0, -M_PI / 2, 0)}) {
    calibration.X_WC = geometry::Pose{geometry::rotation_from_vector(turn), {1.5, -2.25, 0.75}};
    calibration.pose_residual_px = 1.5;
    calibration.pose_sigma_mm = 3.5;
    write_calibration(folder_ / "made.yaml", calibration);
    const Calibration read = load_calibration(folder_ / "made.yaml");
    EXPECT_EQ(*read.lens, *calibration.lens);
    EXPECT_LT(geometry::rotation_vector(read.X_WC->rotation.transpose() * calibration.X_WC->rotation).norm(),
              1e-7);
    EXPECT_EQ(read.X_WC->translation_m, calibration.X_WC->translation_m);
    EXPECT_EQ(read.pose_residual_px, 1.5);
    EXPECT_EQ(read.pose_sigma_mm, 3.5);
    EXPECT_TRUE(read.has_figures);
  }
  EXPECT_FALSE(fs::exists(folder_ / "made.yaml.new"));
  EXPECT_THROW(write_calibration("/proc/nowhere/made.yaml", calibration), core::MissingError);
  // Where it cannot be finished, the old one stays.
  fs::create_directories(folder_ / "made.yaml.new");
  calibration.pose_sigma_mm = 9;
  EXPECT_THROW(write_calibration(folder_ / "made.yaml", calibration), core::MissingError);
  EXPECT_EQ(load_calibration(folder_ / "made.yaml").pose_sigma_mm, 3.5);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
