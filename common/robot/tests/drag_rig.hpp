#pragma once
// An arm of seven joints in a skin of tubes among balls of fluid, for the tests of drag.

#include <random>

#include "common/robot/drag/drag.hpp"
#include "common/robot/sensing/skin_sensing.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "common/robot/tests/test_worlds.hpp"

namespace phantom::robot::drag_rig {

using core::JointArray;

struct Rig {
  explicit Rig(Normalisation normalisation = Normalisation::kArea,
               const Eigen::Vector3d& shift = Eigen::Vector3d::Zero(), bool gradient = true)
      : arm(test_arms::suspended(
            {geometry::rotation_from_rpy(0.1, -0.2, 0.3), Eigen::Vector3d(0.05, -0.1, 1.5) + shift})),
        layout(
            *lay_out_skin(arm, test_worlds::tubes(), {.voxel_size_m = 0.01, .normalisation = normalisation})),
        world(test_worlds::balls(shift)),
        sensing(layout, {.gradient = gradient, .gradient_reach_vox = 4}) {}

  /// Sets the pose and senses.
  const DragCoefficients& at(const JointArray& q, const DirectionalLaw& law = {}, const JointArray& v = {}) {
    arm.link_poses(q, X_WL);
    sensing.sense(X_WL, arm.joint_count(), world);
    drag_coefficients(arm, X_WL, sensing.sums(), law, v, drag);
    return drag;
  }

  SerialArm arm;
  SkinLayout layout;
  workspace::Workspace world;
  SkinSensing sensing;
  LinkPoses X_WL;
  DragCoefficients drag;
};

}  // namespace phantom::robot::drag_rig
