#pragma once

#include <filesystem>
#include <iosfwd>
#include <vector>

#include "components/phantom_session/session.hpp"

namespace phantom::phantom_session {

/// Checks the arguments of each component that gets arguments of its own (from the topology or the user):
/// runs the component from the folder `bin` with `--check`, one after the other. Only the component itself
/// knows what is allowed, so that no second list can differ from it. Throws ConfigError for arguments that a
/// component refuses (its exit code 2), MissingError for a missing device, file or executable (3),
/// std::runtime_error otherwise, each with the component's message. Returns early when a stop is requested.
void check_arguments(const std::vector<PlannedProcess>& planned, const std::filesystem::path& bin);

/// Where the processes of a check run later.
enum class Checked { kHere, kElsewhere };

/// Checks every process: runs each from the folder `bin` with `--check`, one after the other, and prints on
/// `out` what each says, a line once whoever says it. Throws as check_arguments() does, after the last one,
/// for the first process of the gravest kind; the message has all that were refused. kElsewhere: a device or
/// file that is missing here (exit code 3) may be there on the process's own host; it is printed, not
/// refused.
void check_all(const std::vector<PlannedProcess>& planned, const std::filesystem::path& bin,
               std::ostream& out, Checked where = Checked::kHere);

/// Returns the folder of the components' executables: this process's own.
std::filesystem::path component_folder();

}  // namespace phantom::phantom_session
