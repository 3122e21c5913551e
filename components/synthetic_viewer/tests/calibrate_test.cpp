#include "components/synthetic_viewer/calibrate.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "common/camera/tests/synthetic_camera.hpp"
#include "common/core/errors.hpp"
#include "components/synthetic_viewer/scene/picks.hpp"
#include "components/synthetic_viewer/tests/camera_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

class Calibrating : public ::testing::Test {
 protected:
  Calibrating() {
    fs::create_directories(folder_);
    request_.cell = PHANTOM_SOURCE_DIR "/deploy/cells/two_plates/cell.yaml";
    request_.out = folder_ / "made.yaml";
    config_.graphics = GraphicsPlatform::kSurfaceless;
  }
  ~Calibrating() override { fs::remove_all(folder_); }
  /// Writes a camera's file: calibrated as `camera` is, while it really stands at X_CS from there.
  void write_camera(const VideoCamera& camera, bool with_pose, const std::string& simulated = "") {
    write_calibration(folder_ / "rough.yaml", camera.calibration);
    Calibration lens = camera.calibration;
    if (!with_pose) lens.X_WC.reset();
    write_calibration(folder_ / "rough.yaml", lens);
    std::ofstream file(folder_ / "camera.yaml");
    file << "name: gate\ncalibration: rough.yaml\nsource: "
         << (simulated.empty() ? "device\npath: /dev/video0\n" : "simulated\n") << simulated;
    request_.camera = folder_ / "camera.yaml";
  }
  std::string refusal() {
    try {
      run_calibrate(request_, config_);
    } catch (const core::ConfigError& problem) {
      return problem.what();
    } catch (const core::MissingError& problem) {
      return problem.what();
    }
    return "done";
  }
  /// Corners of both plates as they are seen, picked with an error.
  void pick(const VideoCamera& camera, const geometry::Pose& X_WC, double sigma_px, std::size_t count) {
    const auto cell = runtime::load_cell(request_.cell);
    std::mt19937 random(3);
    std::normal_distribution<double> error(0.0, sigma_px);
    request_.picks.clear();
    for (const char* corner : {"upright_plate:+-+", "upright_plate:---", "level_plate:--+", "level_plate:+-+",
                               "level_plate:-++", "upright_plate:--+"}) {
      if (request_.picks.size() == count) break;
      const auto point = parse_pick(std::string("0,0=") + corner, &cell);
      ASSERT_TRUE(point) << point.status().message();
      const Eigen::Vector2d pixel =
          camera::test::project_by_hand(*camera.calibration.lens, X_WC.inverse() * point->position_W_m);
      request_.picks.push_back(
          fmt::format("{:.2f},{:.2f}={}", pixel.x() + error(random), pixel.y() + error(random), corner));
    }
  }
  CalibrateRequest request_;
  ViewerConfig config_;
  const fs::path folder_ = fs::path(::testing::TempDir()) / ("calibrate_" + std::to_string(getpid()));
};

TEST_F(Calibrating, FromPickedCornersOfTheModelThePoseIsFoundAndWrittenWithItsResidual) {
  const VideoCamera camera = test::bent_camera();
  const geometry::Pose truth = *camera.calibration.X_WC;
  write_camera(camera, false);
  pick(camera, truth, 0.5, 6);
  request_.pixel_sigma_px = 0.5;
  EXPECT_EQ(run_calibrate(request_, config_), 0);
  const Calibration made = load_calibration(request_.out);
  EXPECT_EQ(*made.lens, *camera.calibration.lens);
  EXPECT_LT(1e3 * (made.X_WC->translation_m - truth.translation_m).norm(), 4 * made.pose_sigma_mm);
  EXPECT_GT(made.pose_sigma_mm, 0.5);
  EXPECT_LT(made.pose_sigma_mm, 15);
  EXPECT_GT(made.pose_residual_px, 0.1);
  EXPECT_GT(made.pose_residual_mm, 0.3);
}

TEST_F(Calibrating, ThreeCornersNeedARoughPoseInTheCamerasFile) {
  const VideoCamera camera = test::bent_camera();
  write_camera(camera, false);
  pick(camera, *camera.calibration.X_WC, 0.0, 3);
  EXPECT_THAT(refusal(), HasSubstr("pick a fourth one, or give a rough pose"));
  EXPECT_FALSE(fs::exists(request_.out)) << "nothing is written";
  VideoCamera rough = camera;
  rough.calibration.X_WC->translation_m += Eigen::Vector3d(0.1, -0.1, 0.05);
  write_camera(rough, true);
  EXPECT_EQ(run_calibrate(request_, config_), 0);
  EXPECT_LT(
      (load_calibration(request_.out).X_WC->translation_m - camera.calibration.X_WC->translation_m).norm(),
      5e-3);
}

TEST_F(Calibrating, PicturesOfABoardGiveLensAndPose) {
  const camera::Lens lens = camera::test::wide_lens();
  const camera::Board board{9, 6, 0.03};
  const camera::test::BoardRenderer renderer(lens);
  const std::vector<geometry::Pose> views{
      camera::test::board_before(board, 0.45, 0.5, 0.1, 0.1),
      camera::test::board_before(board, 0.45, -0.5, 0.2, -0.2),
      camera::test::board_before(board, 0.45, 0.1, 0.6, 0.3),
      camera::test::board_before(board, 0.45, -0.1, -0.6, 0.0),
      camera::test::board_before(board, 0.50, 0.4, 0.4, -0.4, {0.06, 0.04})};
  unsigned seed = 1;
  for (const geometry::Pose& X_CB : views) {
    auto grey = renderer.render(board, X_CB, 2.0, seed);
    request_.pictures.push_back(folder_ / fmt::format("board_{}.png", seed++));
    cv::imwrite(request_.pictures.back(), cv::Mat(lens.height_px, lens.width_px, CV_8UC1, grey.data()));
  }
  request_.board = "9x6";
  request_.square_mm = 30;
  request_.board_pose = {0.5, -0.2, 0.3, 0, 0, 90};
  request_.pixel_sigma_px = 0.2;
  EXPECT_EQ(run_calibrate(request_, config_), 0);
  const Calibration made = load_calibration(request_.out);
  EXPECT_NEAR(made.lens->fx_px, lens.fx_px, 8);
  EXPECT_LT(made.lens_residual_px, 0.3);
  const geometry::Pose X_WB{geometry::rotation_from_rpy(0, 0, M_PI / 2), {0.5, -0.2, 0.3}};
  const geometry::Pose truth = X_WB * views[0].inverse();
  EXPECT_LT((made.X_WC->translation_m - truth.translation_m).norm(), 0.01);
  // A board of another size is not found in them, which is said, and nothing is written over what is there.
  request_.board = "7x5";
  EXPECT_THAT(refusal(), HasSubstr("needs three pictures of the board or more"));
  EXPECT_EQ(load_calibration(request_.out).lens->fx_px, made.lens->fx_px);
  request_.board = "8x6";
  EXPECT_NE(refusal(), "done");
}

TEST_F(Calibrating, ASnapshotOfTheSimulatedCameraIsWhatTheCornersArePickedIn) {
  const VideoCamera camera = test::bent_camera();
  write_camera(camera, true, "simulated: {latency_ms: 0}\n");
  request_.snapshot = folder_ / "snapshot.png";
  EXPECT_EQ(run_calibrate(request_, config_), 0);
  const cv::Mat picture = cv::imread(request_.snapshot);
  ASSERT_EQ(picture.size(), cv::Size(640, 480));
  // Where a corner of the level plate is picked, the picture changes from the plate's pink to what is behind.
  const auto cell = runtime::load_cell(request_.cell);
  const Eigen::Vector3d corner = parse_pick("0,0=level_plate:--+", &cell)->position_W_m;
  const Eigen::Vector2d pixel =
      camera::test::project_by_hand(*camera.calibration.lens, camera.calibration.X_WC->inverse() * corner);
  const cv::Rect around(static_cast<int>(pixel.x()) - 4, static_cast<int>(pixel.y()) - 4, 9, 9);
  cv::Mat spread, mean;
  cv::meanStdDev(picture(around), mean, spread);
  EXPECT_GT(spread.at<double>(2), 30);
}

// Tries synthetic_viewer: what does not determine a camera
TEST_F(Calibrating, WhatDoesNotFitIsRefusedInWordsAndNothingIsWritten) {
  const VideoCamera camera = test::bent_camera();
  write_camera(camera, false);
  EXPECT_THAT(refusal(), HasSubstr("nothing to calibrate by"));
  const auto with_picks = [&](std::vector<std::string> picks) {
    request_.picks = std::move(picks);
    return refusal();
  };
  EXPECT_THAT(with_picks({"12,13"}), HasSubstr("--pick 12,13: allowed: u,v=x,y,z or u,v=OBJECT:x,y,z"));
  EXPECT_THAT(with_picks({"12=1,2,3"}), HasSubstr("allowed: u,v=x,y,z"));
  EXPECT_THAT(with_picks({"12,13=pump:+++"}), HasSubstr("the cell has no object 'pump'"));
  EXPECT_THAT(with_picks({"12,13=level_plate:+*+"}), HasSubstr("is no corner; allowed: x,y,z"));
  EXPECT_THAT(with_picks({"12,13=level_plate:0,0,0"}), HasSubstr("level_plate has no corner within 20 mm"));
  EXPECT_THAT(with_picks({"12,13=level_plate"}), HasSubstr("neither a point of W nor OBJECT:corner"));
  EXPECT_THAT(with_picks({"12,nan=1,2,3"}), HasSubstr("allowed: u,v=x,y,z"));
  EXPECT_THAT(with_picks({"1,2=0,0,0", "3,4=0.1,0,0", "5,6=0.2,0,0", "7,8=0.3,0,0"}), HasSubstr("in line"));
  pick(camera, *camera.calibration.X_WC, 0.0, 6);
  std::swap(request_.picks[0], request_.picks[1]);
  request_.picks[0].replace(request_.picks[0].find('='), std::string::npos, "=upright_plate:+-+");
  EXPECT_THAT(refusal(), HasSubstr("A point was picked wrongly"));
  request_.picks.clear();
  request_.pictures = {folder_ / "nowhere.png"};
  request_.board = "9";
  EXPECT_THAT(refusal(), HasSubstr("--board 9: allowed: COLUMNSxROWS"));
  request_.board = "9x6";
  EXPECT_THAT(refusal(), HasSubstr("nowhere.png: is no picture that can be read"));
  request_.pictures.clear();
  request_.take = 3;
  request_.cell.clear();
  EXPECT_THAT(refusal(), HasSubstr("/dev/video0"));
  EXPECT_FALSE(fs::exists(request_.out));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
