// How the operator moves cameras, and where they may stand.
#include "components/synthetic_viewer/state/camera_control.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/geometry/implicit/primitives.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr double kQuarter = std::numbers::pi / 2;

Camera from_south() { return {{1, -1, 1}, {1, 1, 1}, 0.7, 0.02, 20}; }  // 2 m away

TEST(CameraControl, LeavesAViewAloneThatNobodyMoved) {
  const Camera camera = CameraControl().moved(from_south(), View::kMain);
  EXPECT_EQ(camera.eye_m, from_south().eye_m);
}

TEST(CameraControl, TurnsAboutTheLookedAtPointFromXTowardsY) {
  CameraControl control;
  control.take({.view = View::kMain, .azimuth_rad = kQuarter});
  EXPECT_TRUE(control.moved(from_south(), View::kMain).eye_m.isApprox(Eigen::Vector3d(3, 1, 1), 1e-12));
  EXPECT_EQ(control.moved(from_south(), View::kHit).eye_m, from_south().eye_m) << "each view by itself";
  control.take({.view = View::kMain, .azimuth_rad = kQuarter});
  EXPECT_TRUE(control.moved(from_south(), View::kMain).eye_m.isApprox(Eigen::Vector3d(1, 3, 1), 1e-12));
}

TEST(CameraControl, RaisesTheCameraButNotOverTheTop) {
  CameraControl control;
  control.take({.view = View::kHit, .elevation_rad = 0.5});
  const Eigen::Vector3d eye = control.moved(from_south(), View::kHit).eye_m;
  EXPECT_NEAR(eye.z(), 1 + 2 * std::sin(0.5), 1e-12);
  for (int k = 0; k < 100; ++k) control.take({.view = View::kHit, .elevation_rad = 0.5});
  const Eigen::Vector3d steep = control.moved(from_south(), View::kHit).eye_m;
  EXPECT_LT(steep.y(), 1.0) << "still on its side";
  EXPECT_NEAR((steep - Eigen::Vector3d(1, 1, 1)).norm(), 2, 1e-12);
  // And comes down again at once, not after a hundred turns back.
  for (int k = 0; k < 12; ++k) control.take({.view = View::kHit, .elevation_rad = -0.5});
  EXPECT_LT(control.moved(from_south(), View::kHit).eye_m.z(), 1.0);
}

TEST(CameraControl, ZoomsWithinItsBoundsAndComesHome) {
  CameraControl control;
  control.take({.view = View::kTool, .zoom = 0.5});
  EXPECT_NEAR((control.moved(from_south(), View::kTool).eye_m - from_south().target_m).norm(), 1, 1e-12);
  for (int k = 0; k < 20; ++k) control.take({.view = View::kTool, .zoom = 0.1});
  EXPECT_NEAR((control.moved(from_south(), View::kTool).eye_m - from_south().target_m).norm(), 0.2, 1e-12);
  control.take({.view = View::kTool, .home = true});
  EXPECT_TRUE(control.offset(View::kTool).at_home());
  EXPECT_EQ(control.moved(from_south(), View::kTool).eye_m, from_south().eye_m);
}

RayScene::Body box(const Eigen::Vector3d& size_m, const Eigen::Vector3d& place_m, std::uint16_t object) {
  return {std::make_shared<RayMesh>(geometry::make_box(size_m)),
          {Eigen::Matrix3d::Identity(), place_m},
          {object, 0}};
}

Camera eye_at(double x_m) {  // looks back at the origin
  Camera camera;
  camera.eye_m = {x_m, 0, 0};
  camera.target_m = {0, 0, 0};
  return camera;
}

TEST(UnobstructedCamera, StaysWhereItIsFree) {
  RayScene scene;
  scene.bodies = {box({0.2, 1, 1}, {1.0, 0, 0}, 3)};
  for (const double x : {0.3, 0.8, 1.2, 2.0}) {
    const UnobstructedCamera camera = unobstructed(eye_at(x), scene);
    EXPECT_FALSE(camera.blocked_by) << x;
    EXPECT_EQ(camera.camera.eye_m.x(), x);
  }
}

// The wall is from 0.9 to 1.1 m; 3 cm of air belong to it.
TEST(UnobstructedCamera, LeavesAWallOnTheNearerSideAndSaysWhichWall) {
  RayScene scene;
  scene.bodies = {box({0.2, 1, 1}, {1.0, 0, 0}, 3)};
  const UnobstructedCamera before = unobstructed(eye_at(0.95), scene),
                           behind = unobstructed(eye_at(1.06), scene);
  ASSERT_TRUE(before.blocked_by && behind.blocked_by);
  EXPECT_EQ(before.blocked_by->object, 3);
  EXPECT_NEAR(before.camera.eye_m.x(), 0.87, 1e-6);
  EXPECT_NEAR(before.distance_m, 0.87, 1e-6);
  EXPECT_NEAR(before.wanted_m, 0.95, 1e-12);
  EXPECT_NEAR(behind.camera.eye_m.x(), 1.13, 1e-6);
}

TEST(UnobstructedCamera, GivesWayToSurfacesThatAreTooCloseToSeePast) {
  RayScene scene;
  scene.bodies = {box({0.2, 1, 1}, {1.0, 0, 0}, 3)};
  EXPECT_NEAR(unobstructed(eye_at(0.89), scene).camera.eye_m.x(), 0.87, 1e-6);
}

TEST(UnobstructedCamera, FindsTheGapBetweenTwoBodies) {
  RayScene scene;
  scene.bodies = {box({0.4, 1, 1}, {0.6, 0, 0}, 1), box({0.4, 1, 1}, {1.2, 0, 0}, 2)};  // 0.4…0.8, 1.0…1.4
  const UnobstructedCamera camera = unobstructed(eye_at(1.1), scene);
  ASSERT_TRUE(camera.blocked_by);
  EXPECT_EQ(camera.blocked_by->object, 2);
  EXPECT_NEAR(camera.camera.eye_m.x(), 0.97, 1e-6);
}

TEST(UnobstructedCamera, ComesOutOfABodyThatHoldsWhatItLooksAt) {
  RayScene scene;
  scene.bodies = {box({1, 1, 1}, {0, 0, 0}, 1)};
  EXPECT_NEAR(unobstructed(eye_at(0.3), scene).camera.eye_m.x(), 0.53, 1e-6);
}

TEST(UnobstructedCamera, StaysWhereThereIsNoFreePlaceAtAll) {
  RayScene scene;
  scene.bodies = {box({10, 10, 10}, {0, 0, 0}, 1)};
  EXPECT_FALSE(unobstructed(eye_at(0.3), scene).blocked_by);
  EXPECT_EQ(unobstructed(eye_at(0.3), scene).camera.eye_m.x(), 0.3);
}

// Property: whatever stands around, a settled camera is either where it was asked for or clear of every box.
TEST(UnobstructedCamera, IsClearOfEveryBox) {
  for (int k = 0; k < 300; ++k) {
    RayScene scene;
    std::vector<std::pair<double, double>> spans;
    for (int i = 0; i < 4; ++i) {
      const double middle = 0.3 + 0.4 * i + 0.1 * std::sin(7.0 * k + i),
                   depth = 0.1 + 0.08 * std::cos(3.0 * k + 2 * i);
      scene.bodies.push_back(box({depth, 1, 1}, {middle, 0, 0}, static_cast<std::uint16_t>(i + 1)));
      spans.emplace_back(middle - depth / 2, middle + depth / 2);
    }
    const double wanted_m = 0.2 + 1.4 * (0.5 + 0.5 * std::sin(11.0 * k));
    const UnobstructedCamera camera = unobstructed(eye_at(wanted_m), scene);
    for (const auto& [from, to] : spans) {
      EXPECT_TRUE(camera.distance_m <= from - 0.03 + 1e-6 || camera.distance_m >= to + 0.03 - 1e-6)
          << k << ": " << camera.distance_m << " is too close to " << from << "…" << to;
    }
  }
}

TEST(Pointer, ADragOverTheWholeHeightIsHalfATurn) {
  const ViewRequest request = drag_request(View::kHit, -360, 360, 360);
  EXPECT_EQ(request.view, View::kHit);
  EXPECT_NEAR(request.azimuth_rad, std::numbers::pi, 1e-12);
  EXPECT_NEAR(request.elevation_rad, std::numbers::pi, 1e-12);
}

TEST(Pointer, TheWheelAwayFromTheUserComesCloserAndBack) {
  EXPECT_LT(wheel_request(View::kMain, 1).zoom, 1.0);
  EXPECT_NEAR(wheel_request(View::kMain, 2).zoom * wheel_request(View::kMain, -2).zoom, 1.0, 1e-12);
}

TEST(Pointer, KeysNameTheNodes) {
  EXPECT_EQ(node_of_key('N'), percept::ViewNode::kNorth);
  EXPECT_EQ(node_of_key('B'), percept::ViewNode::kBottom);
  EXPECT_EQ(node_of_key('7'), percept::ViewNode::kCorner7);
  EXPECT_EQ(node_of_key('A'), percept::ViewNode::kAutomatic);
  for (const char key : {'9', '0', 'H', 'R', 'n', ' '}) EXPECT_FALSE(node_of_key(key)) << key;
}

TEST(Pointer, TheMainViewFillsTheWindowInItsShapeAndTheOthersLieOverIt) {
  const cv::Rect2d wide = place_in_window(View::kMain, 2000, 720, 16.0 / 9);
  EXPECT_EQ(wide.width, 1280);
  EXPECT_EQ(wide.x, 360);
  for (const View view : {View::kHit, View::kTool}) {
    const cv::Rect2d place = place_in_window(view, 2000, 720, 16.0 / 9);
    EXPECT_GT(place.x, wide.x + wide.width / 2);
    EXPECT_LE(place.x + place.width, wide.x + wide.width);
    EXPECT_GE(place.y, 0);
    EXPECT_LE(place.y + place.height, 720);
  }
  const cv::Rect2d hit = place_in_window(View::kHit, 1280, 720, 16.0 / 9),
                   tool = place_in_window(View::kTool, 1280, 720, 16.0 / 9);
  EXPECT_LT(hit.y + hit.height, tool.y) << "they do not cover each other";
}

}  // namespace
}  // namespace phantom::synthetic_viewer
