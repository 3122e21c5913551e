#pragma once

#include <iosfwd>

#include "components/workspace_survey/commands.hpp"

namespace phantom::workspace_survey {

/// Listens to an arm that touches an object of the running workspace, shows what each touch says about its
/// pose, widens its guard while that contradicts the model, and applies the corrected pose on request.
/// Returns the exit code: done (applied, declined, or nothing to change); failed if the touches say too
/// little or the server refuses; missing if nobody is heard. Throws core::ConfigError, dds::DdsError.
int run_touch(const Request& request, const Config& config, const Workspace& workspace, std::istream& in,
              std::ostream& print);

}  // namespace phantom::workspace_survey
