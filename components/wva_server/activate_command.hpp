#pragma once

#include <iosfwd>

#include "components/wva_server/activate_request.hpp"
#include "components/wva_server/config.hpp"

namespace phantom::wva_server {

/// Activates a mesh or a cell without DDS. Writes NRRD and, on request, a picture and a fidelity report;
/// prints one line of JSON on `print`. Logs warnings about what was guessed or found wrong about a mesh.
/// Shows progress if stderr is a terminal. Returns the exit code. Throws ConfigError for arguments and files
/// that cannot be used, MissingError for a missing mesh, std::runtime_error if a stop was requested before
/// the end.
int run_activate(const ActivateRequest& request, const WvaServerConfig& config, std::ostream& print);

}  // namespace phantom::wva_server
