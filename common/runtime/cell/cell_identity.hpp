#pragma once

#include "common/robot/kinematics/model_identity.hpp"
#include "common/runtime/cell/cell.hpp"

namespace phantom::runtime {

/// Returns by what others know the arm `arm_name` of a cell (empty: its only one): fingerprints and files.
/// `arm`: as load_arm() reads it. The cell's fingerprint counts its name, box, voxel size and its objects'
/// names and poses; not their meshes, which travel by topic. Throws ConfigError.
robot::ModelIdentity identity_of(const CellConfig& cell, const std::string& arm_name,
                                 const robot::SerialArm& arm);

}  // namespace phantom::runtime
