#pragma once

#include <cstdint>

#include "common/robot/kinematics/jacobian.hpp"
#include "common/runtime/configuration/fields.hpp"
#include "common/simulation/handle_plant.hpp"
#include "common/simulation/indexing_hand.hpp"
#include "common/teleop/coupling/cartesian_hand.hpp"
#include "common/teleop/coupling/device_watch.hpp"
#include "common/teleop/rendering/wrench_slew.hpp"

namespace phantom::master_io {

/// Axes of what a Cartesian hand does: three of translation, three of rotation.
inline constexpr std::size_t kCartesianAxes = 6;

/// What the hand holds. A space mouse and a gamepad know no positions: they push a simulated handle without
/// an edge. A haptic device is served by another process, by topic.
enum class CartesianInput { kSimulated, kSpaceMouse, kGamepad, kHapticDevice };

inline bool is_pushed(CartesianInput input) noexcept {
  return input == CartesianInput::kSpaceMouse || input == CartesianInput::kGamepad;
}

/// Parameters of driver cartesian.
struct CartesianConfig {
  CartesianInput input = CartesianInput::kSimulated;
  teleop::CartesianHandParameters hand;
  teleop::WrenchSlewParameters wrench;
  simulation::HandlePlantParameters handle;
  simulation::IndexingHandParameters indexing;
  teleop::DeviceWatchParameters watch;  ///< of a haptic device
};

/// What a session with a Cartesian device was like, for the report.
struct CartesianFigures {
  double greatest_force_N = 0.0, greatest_moment_N_m = 0.0;
  double steepest_force_N_per_s = 0.0;  ///< greatest rise of the force within a tick, ÷ the tick
  /// Greatest excess of the power that the hand got over what the joints' torques give, at least 0; W.
  double greatest_excess_W = 0.0;
  double energy_from_hand_J = 0.0;  ///< that the rendered wrench took from the hand
  double least_followed =
      1.0;  ///< least share of the hand's motion that the tool followed, in its weakest direction
  std::uint32_t clutched_out = 0;  ///< how often the clutch went out
};

/// Reads the section for `arm`, with the joints' inertias as found in `device`. `loop_s`: length of the
/// device's loop with which its damping limits are found. Throws ConfigError.
CartesianConfig read_cartesian(const runtime::Fields& section, const robot::SerialArm& arm,
                               const core::JointArray& joint_inertia, double loop_s);

/// Returns the tool's pose at `q` as a person with a handle works with it: position, then rotation vector
/// from its orientation at `R_home`, both ÷ the scales, so that they are metres and radians of the hand.
/// Real-time safe: yes.
core::JointArray tool_coordinates(const CartesianConfig& config, const Eigen::Matrix3d& R_home,
                                  const geometry::Pose& X_WT) noexcept;

/// Returns the pose of the arm's tool at `q`.
geometry::Pose tool_pose_at(const robot::SerialArm& arm, const core::JointArray& q) noexcept;

}  // namespace phantom::master_io
