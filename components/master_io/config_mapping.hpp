#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/core/joints.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/runtime/configuration/fields.hpp"
#include "common/simulation/master_plant.hpp"
#include "common/teleop/coupling/joint_mapping.hpp"

namespace phantom::master_io {

/// A master whose joints each lead one of the arm's: section joint_mapping. Arrays without another word are
/// by joint of the master that leads, in the mapping's order and in that joint's units (rad, N·m or m, N).
struct MappingConfig {
  teleop::JointMappingParameters mapping;
  std::vector<robot::Joint> joints;          ///< names, ranges, greatest torques
  std::vector<std::string> leads;            ///< names of the arm's joints that they lead
  simulation::MasterPlantParameters device;  ///< inertias, friction, limits, encoders
  core::JointArray torque_rate{}, damping_cap{};
  core::JointArray tolerance{};      ///< how far a joint may be beyond its range when its drive gets power
  core::JointArray lever_m{};        ///< from the axis to the hand, for the report; 0: unknown
  core::JointArray arm_tolerance{};  ///< by joint of the arm: how far poses may differ when coupling
  /// By joint of the arm: where one that is not led is held; none: where the arm stands.
  std::array<std::optional<double>, core::kMaxJoints> held;
};

/// What the device of such a session had to do, by joint of the master, for the report.
struct MappingFigures {
  core::JointArray greatest_torque_Nm{};
  core::JointArray energy_from_hand_J{};  ///< that the rendered torque took
};

/// Inertia of a joint of the arm that no joint of the master leads: it is held, whatever acts on it.
inline constexpr double kHeldInertia = 1e6;

/// Values of the master in the coordinates of the arm's joints, by joint of the arm.
struct ReflectedMaster {
  core::JointArray inertia{}, viscous{}, coulomb{}, torque_limit{}, torque_rate{}, damping_cap{},
      encoder_step{};
};

/// Reads the section for `arm`. `arm_tolerance`: by joint of the arm, rad or m. Throws ConfigError, or
/// MissingError without the master's description.
MappingConfig read_mapping(const runtime::Fields& section, const robot::SerialArm& arm,
                           const core::JointArray& arm_tolerance);

/// Replaces the values of joints that the master leads by its own, seen through the ratio r: inertia, viscous
/// friction and damping cap ÷ r², torques ÷ |r|, ways · |r|. Joints that are not led get kHeldInertia.
void reflect(const MappingConfig& config, ReflectedMaster& at_arm) noexcept;

/// Returns where the master's joints begin in simulation: where they lead the arm's to `arm_q`, within their
/// ranges.
core::JointArray start_of(const MappingConfig& config, const core::JointArray& arm_q) noexcept;

}  // namespace phantom::master_io
