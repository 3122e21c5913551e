// What the viewer draws of an arm: the shapes that its URDF states, where they are.
#include "components/synthetic_viewer/scene/arm_meshes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/synthetic_viewer/scene/cell_scene.hpp"

namespace phantom::synthetic_viewer {
namespace {

TEST(ArmMeshes, ShowBoxesCylindersAndSpheresOfEveryLinkAndHeldFingers) {
  const auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/arm_bench/cell.yaml");
  const runtime::ArmConfig& config = cell.arm("laboratory_arm");
  const robot::SerialArm arm = runtime::load_arm(config);
  const auto meshes = load_arm_meshes(arm, runtime::load_skin(config, arm));
  const auto of_link = [&](std::size_t link) {
    return std::ranges::count_if(meshes, [&](const LinkMeshData& part) { return part.link == link; });
  };
  EXPECT_EQ(of_link(0), 1);
  EXPECT_EQ(of_link(2), 2) << "a cylinder and the shoulder's drive";
  EXPECT_EQ(of_link(5), 1) << "the hand's collision geometry, and not its skin once more";
  EXPECT_EQ(of_link(6), 4) << "flange, gripper and two fingers";
  geometry::BoundingBox gripper;  // in the frame of the last link, z along the tool
  for (const LinkMeshData& part : meshes) {
    EXPECT_FALSE(part.mesh.triangles.empty());
    if (part.link != 6) continue;
    for (const auto& vertex_m : part.mesh.transformed(part.X_link_mesh).vertices_m) gripper.extend(vertex_m);
  }
  // 2 cm of flange, 5 cm of gripper, 7 cm of fingers; the gripper is 15 cm wide.
  EXPECT_TRUE(gripper.max_m.isApprox(Eigen::Vector3f(0.03F, 0.075F, 0.14F), 1e-4F))
      << gripper.max_m.transpose();
  EXPECT_NEAR(meshes.front().colour[0], 0.15F, 1e-6F) << "the stand is graphite";
}

TEST(ArmMeshes, FingersAreDrawnAsWideApartAsTheGripperSays) {
  const auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/gripper_bench/cell.yaml");
  const runtime::ArmConfig& config = cell.arm("");
  const robot::SerialArm arm = runtime::load_arm(config);
  auto meshes = load_arm_meshes(arm, runtime::load_skin(config, arm));
  set_closing(runtime::load_arm_with_closed_gripper(config), meshes);
  GripperSample gripper;
  gripper.widest_m = 0.1;
  gripper.sense.known = true;
  // Between the fingers' faces, along y of the last link, whose middle is at y = 0.
  const auto gap_m = [&] {
    double left_m = 1.0, right_m = -1.0;
    int fingers = 0;
    for (const LinkMeshData& part : meshes) {
      LinkBody body{.link = part.link, .X_link_mesh = part.X_link_mesh, .closing_m = part.closing_m};
      if (part.closing_m.norm() == 0.0) continue;
      ++fingers;
      geometry::BoundingBox box;
      for (const auto& vertex_m : part.mesh.transformed(pose_in_link(body, gripper)).vertices_m)
        box.extend(vertex_m);
      if (part.closing_m.y() < 0.0) left_m = box.min_m.y();
      if (part.closing_m.y() > 0.0) right_m = box.max_m.y();
    }
    EXPECT_EQ(fingers, 2);
    return left_m - right_m;
  };
  EXPECT_NEAR(gap_m(), 0.1, 1e-6) << "not heard yet: at its widest";
  gripper.received_ns = 1;
  for (const double width_m : {0.0, 0.042, 0.1}) {
    gripper.sense.width_m = width_m;
    EXPECT_NEAR(gap_m(), width_m, 1e-6);
  }
  gripper.sense.known = false;
  EXPECT_NEAR(gap_m(), 0.1, 1e-6);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
