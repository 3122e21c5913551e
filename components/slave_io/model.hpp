#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/robot/drag/buoyancy.hpp"
#include "common/robot/kinematics/model_identity.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/robot/skin/finger_points.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/runtime/cell/cell.hpp"

namespace phantom::slave_io {

/// The arm of the cell, with its start pose and tool.
struct ArmModel {
  robot::SerialArm arm;
  core::JointArray home{};
  Eigen::Vector3d tip_in_last_link_m = Eigen::Vector3d::Zero();
  std::vector<robot::LinkSkin> skin;
  std::string name = {};                         ///< in the cell file
  std::vector<robot::FingerPoint> fingers = {};  ///< of a gripper that moves
  robot::ModelIdentity identity = {};            ///< by which others know arm and cell
  robot::Buoyancy buoyancy = {};                 ///< of its links in the cell's media
  /// Volumes of the cell's objects, by id; none where no medium has a density.
  std::map<std::uint16_t, double> object_volumes_m3 = {};
};

/// Loads the arm and its home pose. Throws ConfigError.
ArmModel load_arm(const runtime::CellConfig& cell, const std::string& arm_name);

}  // namespace phantom::slave_io
