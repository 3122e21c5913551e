#pragma once

#include <filesystem>

#include "common/runtime/cell/cell_arms.hpp"

namespace phantom::runtime {

/// Reads an arm's description (deploy/arms) that no cell mounts: its base is at the origin, and its name is
/// the file's. Throws ConfigError, or MissingError without the file.
ArmConfig read_arm_file(const std::filesystem::path& file);

}  // namespace phantom::runtime
