#pragma once
// What the sensing benchmarks sense: a box of fluid-wrapped balls, and an arm of tubes that wades through it.

#include <cstddef>

#include "common/robot/drag/drag.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::bench {

/// Cube of `edge_vox` voxels of 5 mm around the arm, with balls in six layers of 20 mm in about a fifth of
/// it.
const workspace::Workspace& balls(int edge_vox);

/// The same cube without anything in it, and with fluid in every voxel, of another μ than most of its
/// neighbours'.
const workspace::Workspace& free_space(int edge_vox);
const workspace::Workspace& mixed_fluid(int edge_vox);

/// A hanging arm of revolute joints, each link a tube of 0.3 m; `joints` 1 to 7 share the length of seven.
robot::SerialArm tube_arm(std::size_t joints);

/// A skin of about `sensors` point sensors on its tubes, finer or coarser as it takes.
robot::SkinLayout tube_skin(const robot::SerialArm& arm, std::size_t sensors);

/// The same number of links, each with cluster sensors of reach `m` on its axis: `sensors` in all.
robot::SkinLayout cluster_skin(const robot::SerialArm& arm, std::size_t sensors,
                               const robot::ClusterSpec& cluster);

/// A pose in the middle of the balls; `step` moves it a little, so that no tick repeats the one before.
core::JointArray pose(std::size_t joints, int step);

}  // namespace phantom::bench
