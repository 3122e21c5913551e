#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "common/fusion/camera_scene.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "components/workspace_camera/arm_view.hpp"
#include "components/workspace_camera/config.hpp"
#include "components/workspace_camera/simulated_camera.hpp"
#include "components/workspace_camera/workspace_camera.hpp"

namespace phantom::workspace_camera::rig {

inline constexpr core::Nanoseconds kMs = core::kNsPerMillisecond;
inline constexpr core::Nanoseconds kStart = 10'000 * kMs;

/// One slide along x at z = 0.4 m that carries a rod of 60 mm, 400 mm long, upright; a skin of 3 cm pitch.
inline robot::SerialArm sliding_arm() {
  robot::DhRow row;
  row.link = "rod";
  row.type = robot::JointType::kPrismatic;
  row.lower = -0.5, row.upper = 0.5, row.max_speed = 1.0, row.max_effort = 10.0;
  // The joint moves along z of the base frame, which is turned so that this is x of W.
  geometry::Pose X_WB{geometry::rotation_about(Eigen::Vector3d::UnitY(), std::numbers::pi / 2),
                      {0.0, 0.0, 0.4}};
  return robot::SerialArm::from_dh({row}, robot::DhConvention::kModified, X_WB).value();
}

inline robot::SkinLayout rod_skin(const robot::SerialArm& arm) {
  robot::LinkSkin skin{"rod", {}, {}, {}};
  robot::SkinSegment segment;
  // −x of the link is up in W.
  segment.from_m = {-0.2, 0.0, 0.0}, segment.to_m = {0.2, 0.0, 0.0};
  segment.from_radius_m = segment.to_radius_m = 0.03;
  skin.segments.push_back(segment);
  robot::SkinOptions options;
  options.voxel_size_m = 0.01;
  return robot::lay_out_skin(arm, {skin}, options).value();
}

inline ArmView arm_view() {
  robot::SerialArm arm = sliding_arm();
  robot::SkinLayout skin = rod_skin(arm);
  return ArmView(std::move(arm), std::nullopt, std::move(skin), 0.01);
}

/// The rod as a camera sees it.
inline geometry::TriangleMesh rod_W(double x_m) {
  return geometry::make_cylinder(0.03, 0.4).transformed({Eigen::Matrix3d::Identity(), {x_m, 0.0, 0.4}});
}

/// 1 m × 1 m × 0.8 m in voxels of 10 mm.
inline workspace::GridSpec grid() { return {{-0.5, -0.5, 0.0}, 0.01, {100, 100, 80}}; }

inline WorkspaceCameraConfig config(OnLoss on_loss = OnLoss::kKeep) {
  WorkspaceCameraConfig config;
  config.on_loss = on_loss;
  config.fusion.unknown =
      on_loss == OnLoss::kEnd ? fusion::UnknownPolicy::kFree : fusion::UnknownPolicy::kIgnore;
  CameraConfig camera;
  camera.name = "above";
  camera.driver = CameraDriver::kSimulated;
  camera.X_FC = looking_at({0.0, -1.2, 0.9}, {0.0, 0.0, 0.3});
  camera.simulated.camera = {160, 120, 140.0, 140.0, 79.5, 59.5, 0.3, 4.0};
  config.cameras.push_back(camera);
  return config;
}

/// A wall behind, and things.
inline fusion::CameraScene scene(std::vector<geometry::TriangleMesh> things = {}) {
  std::vector<fusion::CameraScene::Object> objects;
  objects.push_back(
      {geometry::make_box({2.0, 0.04, 2.0}).transformed({Eigen::Matrix3d::Identity(), {0, 0.45, 0.4}}),
       false});
  for (auto& thing : things) objects.push_back({std::move(thing), false});
  return fusion::CameraScene(objects);
}

inline geometry::TriangleMesh box_at(const Eigen::Vector3d& at_m, double edge_m = 0.12) {
  return geometry::make_box({edge_m, edge_m, edge_m}).transformed({Eigen::Matrix3d::Identity(), at_m});
}

/// Counts occupied voxels in a cube around a place.
inline std::size_t occupied_near(const WorkspaceCamera& camera, const Eigen::Vector3d& at_m, double reach_m) {
  std::size_t count = 0;
  const workspace::GridSpec& grid = camera.fusion().grid();
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(reach_m);
  const auto low = workspace::max(grid.index_of(at_m - reach), {0, 0, 0});
  const auto high = workspace::min(grid.index_of(at_m + reach),
                                   {grid.size_vox[0] - 1, grid.size_vox[1] - 1, grid.size_vox[2] - 1});
  for (std::int32_t z = low.z; z <= high.z; ++z)
    for (std::int32_t y = low.y; y <= high.y; ++y)
      for (std::int32_t x = low.x; x <= high.x; ++x) count += camera.fusion().occupied().get(x, y, z) ? 1 : 0;
  return count;
}

/// Images of a scene, 50 ms apart.
class Film {
 public:
  explicit Film(const fusion::CameraScene& scene, std::vector<Thing> things = {})
      : camera_(config().cameras[0].simulated, config().cameras[0].X_FC, scene, things) {}

  CameraImage next(const ArmView* arm = nullptr, const ArmPose* pose = nullptr) {
    now_ns_ += 50 * kMs;
    const auto pixels = camera_.image(core::seconds(now_ns_ - kStart), arm, pose);
    return {0, camera_.camera(), now_ns_, pixels};
  }
  core::Nanoseconds now_ns() const { return now_ns_; }

 private:
  SimulatedCamera camera_;
  core::Nanoseconds now_ns_ = kStart;
};

}  // namespace phantom::workspace_camera::rig
