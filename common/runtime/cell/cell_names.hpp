#pragma once

#include <filesystem>
#include <string>

#include "common/robot/kinematics/serial_arm.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/configuration/deployment.hpp"

namespace phantom::runtime {

/// Returns the names of an arm's links in words, "base, upper, tool". Not real-time safe.
std::string links_of(const robot::SerialArm& arm);

/// Checks every name in the cell that stands for something elsewhere in it, whichever component needs it: the
/// arm and the link that hold an object; object and link of an allowed contact; the links of skins,
/// interest points and displaced volumes. Loads the kinematics of all arms for that, and with it checks them.
/// Throws ConfigError naming the place, the name and what is allowed; throws MissingError if an arm's file is
/// missing. Not real-time safe.
void check_names(const CellConfig& cell);

/// Reads a cell as load_cell() does, and checks its names.
CellConfig load_checked_cell(const std::filesystem::path& path, CellArms arms = CellArms::kNeeded);
/// Does so for a topology's cell, after require_files().
CellConfig load_checked_cell(const Deployment& deployment);

}  // namespace phantom::runtime
