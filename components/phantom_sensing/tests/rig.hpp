#pragma once
// A seven-joint arm in skin before a wall of layered fluid, for the component's tests.

#include "common/percept/closeness.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "common/robot/tests/test_worlds.hpp"
#include "common/workspace/brick_codec.hpp"
#include "components/phantom_sensing/config.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"
#include "components/phantom_sensing/workspace/workspace_subscriber.hpp"

namespace phantom::phantom_sensing::rig {

inline PhantomModel suspended_model() {
  robot::SerialArm arm = robot::test_arms::suspended(robot::test_arms::at(0.0, 0.0, 1.5));
  auto skin = robot::lay_out_skin(arm, robot::test_worlds::tubes(), {.voxel_size_m = 0.01});
  if (!skin) throw std::runtime_error(skin.status().message());
  return {std::move(arm), *std::move(skin)};
}

/// A wall whose surface is the plane x = 0.35 m, with five layers of 40 mm before it.
inline const workspace::Workspace& wall() {
  static const workspace::Workspace world = robot::test_worlds::make(
      [](const Eigen::Vector3d& p) { return robot::test_worlds::layer_code(0.35 - p.x()); }, {0, 0, 1}, 0.01,
      [](const Eigen::Vector3d& p, double radius_m) { return 0.35 - p.x() - radius_m < 0.21; });
  return world;
}

inline SensedWorkspace sensed_wall() { return {&wall(), percept::greatest_neighbour_mu(wall())}; }

/// The arm hanging down at gantry position `x_m` and moving along x at `speed_m_s`; its skin reaches to about
/// x + 0.1.
inline StepInputs hanging(double x_m, double speed_m_s, double dt_s = 0.001) {
  StepInputs inputs;
  inputs.position[0] = x_m;
  inputs.velocity[0] = speed_m_s;
  inputs.dt_s = dt_s;
  inputs.workspace = sensed_wall();
  inputs.state_valid = true;
  return inputs;
}

/// Sends a workspace as its topics would.
inline void send(const workspace::Workspace& world, std::uint64_t version, WorkspaceSubscriber& keeper,
                 const workspace::SourceId& source = {}) {
  for (const workspace::BrickKey key : world.bricks()) {
    keeper.put_brick(source, key, version, workspace::encode_brick(world.brick(key)));
  }
  keeper.commit(source, {version, world.grid(), world.palette(),
                         static_cast<std::uint32_t>(world.brick_count()), world.content_hash()});
}

}  // namespace phantom::phantom_sensing::rig
