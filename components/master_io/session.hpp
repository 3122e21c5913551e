#pragma once

#include <filesystem>

#include "common/core/network.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/runtime/cell.hpp"
#include "components/master_io/config.hpp"

namespace phantom::master_io {

/// The arm whose replica the master is, and the pose in which both start.
struct ArmModel {
  robot::SerialArm arm;
  core::JointArray home{};
};

/// Loads the arm and checks that home fits it. Throws ConfigError.
ArmModel load_arm(const runtime::CellConfig& cell, const std::string& arm_name);

/// Index of the joint of that name; −1 for an empty name: all. Throws ConfigError naming the arm's joints.
int joint_index(const ArmModel& model, const std::string& name);

/// Runs the simulated desk on the topics until a stop is requested: servo thread, publishing thread, if
/// configured a bare loop beside it, and health twice a second. The stop in force is kept in `state_dir`.
/// Leaves master_io.json in `report_dir` if that is not empty. Returns the exit code.
int run_session(const runtime::CellConfig& cell, const ArmModel& model, const Config& config,
                const core::NetworkOptions& network, const std::filesystem::path& state_dir,
                const std::filesystem::path& report_dir);

}  // namespace phantom::master_io
