#pragma once

#include <filesystem>
#include <vector>

#include "components/phantom_session/session.hpp"

namespace phantom::phantom_session {

/// Asks each component that is to get arguments of its own (from the topology or the user) whether it would
/// take them: runs it with `--check`, one after the other, from the folder `bin`. So no list of what is
/// allowed can differ from the component's. Throws ConfigError for arguments that it refuses (its exit code
/// 2), MissingError for a device, file or executable that is not there (3), std::runtime_error otherwise,
/// each with the component's own words. Returns early when a stop is requested.
void check_arguments(const std::vector<PlannedProcess>& planned, const std::filesystem::path& bin);

/// Where the components' executables are: beside this process's own.
std::filesystem::path component_folder();

}  // namespace phantom::phantom_session
