#pragma once

#include <filesystem>

#include "common/core/network.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/master_io/config.hpp"
#include "components/master_io/master_io.hpp"

namespace phantom::master_io {

/// The arm that the master replicates, and the pose in which both start.
struct ArmModel {
  robot::SerialArm arm;
  core::JointArray home{};
};

/// Loads the arm and its home pose. Throws ConfigError.
ArmModel load_arm(const runtime::CellConfig& cell, const std::string& arm_name);

/// Returns the index of the joint of that name; −1 (all joints) for an empty name. Throws ConfigError with
/// the names of the arm's joints.
int joint_index(const ArmModel& model, const std::string& name);

/// Returns what the operator has to know of the master's state; empty: nothing.
std::string sentence(const MasterReport& now);

/// Runs the master on the topics until a stop is requested: servo thread, publishing thread, a bare loop
/// beside them if configured, and health twice a second. The stop in force is kept in `state_dir`. Writes
/// master_io.json to `report_dir` if that is not empty. Returns the exit code.
int run_session(const runtime::CellConfig& cell, const ArmModel& model, const Config& config,
                const core::NetworkOptions& network, const std::filesystem::path& state_dir,
                const std::filesystem::path& report_dir);

}  // namespace phantom::master_io
