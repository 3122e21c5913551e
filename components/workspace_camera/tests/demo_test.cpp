// The things of the shipped demo, without network: they come, are taken away, and leave nothing.
#include <gtest/gtest.h>

#include "common/runtime/cell/cell_bodies.hpp"
#include "components/workspace_camera/service.hpp"
#include "components/workspace_camera/tests/rig.hpp"

namespace phantom::workspace_camera::demo_test {
namespace {

using namespace rig;

TEST(Demo, ItsThingsComeAndGo) {
  const std::string cell = PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/";
  const WorkspaceCameraConfig config = load_config(cell + "workspace_camera.yaml");
  LoadedCell loaded = load_cell(config, cell + "cell.yaml");
  ArmHistory history;
  WorkspaceCamera camera(config, "source", "hot_cell", runtime::grid_of(loaded.cell), loaded.arm.get(),
                         history);
  const CameraConfig& above = config.cameras.front();
  SimulatedCamera eye(above.simulated, above.X_FC, *loaded.simulated, config.things);
  ArmPose home;
  const auto& q = loaded.cell.arm().home;
  std::copy(q.begin(), q.end(), home.q.begin());
  const Eigen::Vector3d box_m = config.things[0].from_m, ball_m = config.things[1].middle_m(29.0);
  const double period_s = 1.0 / above.simulated.rate_hz;
  // The arm goes to the pump's motor and back, 4 s each way.
  const core::JointArray pump{0.2, -1.404, 0.959, -1.531, 0.052, 1.085, 0.0};
  const auto pose_at = [&](double at_s) {
    ArmPose pose = home;
    const double share = 0.5 - 0.5 * std::cos(std::numbers::pi / 4.0 * at_s);
    for (std::size_t j = 0; j < q.size(); ++j) pose.q[j] += share * (pump[j] - pose.q[j]);
    return pose;
  };
  const auto run_until = [&](double& time_s, double end_s) {
    for (; time_s < end_s; time_s += period_s) {
      const core::Nanoseconds at_ns = kStart + core::from_seconds(time_s);
      const ArmPose pose = pose_at(time_s);
      history.put(at_ns, pose.q);
      const auto pixels = eye.image(time_s, loaded.arm.get(), &pose);
      ASSERT_TRUE(camera.take({0, eye.camera(), at_ns, pixels}, at_ns));
    }
  };
  const Eigen::Vector3d hand_m{-0.1, -0.15, 0.95};  // at home; nothing of the model is there
  double time_s = 0.0;
  run_until(time_s, 11.9);
  EXPECT_EQ(occupied_near(camera, hand_m, 0.15), 0U) << "the arm is no matter";
  EXPECT_EQ(occupied_near(camera, box_m, 0.07), 0U);
  run_until(time_s, 13.0);
  EXPECT_GT(occupied_near(camera, box_m, 0.09), 500U);
  run_until(time_s, 24.0);
  run_until(time_s, 25.0);
  run_until(time_s, 27.0);
  EXPECT_LT(occupied_near(camera, box_m, 0.09), 150U) << "but for what the arm hides";
  run_until(time_s, 29.0);
  EXPECT_GT(occupied_near(camera, ball_m, 0.07), 100U);
  run_until(time_s, 34.0);
  EXPECT_LT(occupied_near(camera, ball_m, 0.07), 50U);
  EXPECT_LT(occupied_near(camera, box_m, 0.09), 50U);
  EXPECT_EQ(occupied_near(camera, hand_m, 0.15), 0U);
}

}  // namespace
}  // namespace phantom::workspace_camera::demo_test
