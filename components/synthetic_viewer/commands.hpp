#pragma once

#include <string>

#include "common/core/status.hpp"
#include "components/synthetic_viewer/camera_control.hpp"
#include "components/synthetic_viewer/samples.hpp"

namespace phantom::synthetic_viewer {

/// Checks a command's value against the range that the topic operator_command allows. The message names the
/// command, the value and what is allowed.
core::Status check_command(const Command& command);

/// Reads {"kind": "set_percept_gain", "value": 1.5} as the operator's page posts it. `value` may be left out
/// where a command needs none. The message says what is wrong and what is allowed.
core::Expected<Command> parse_command(const std::string& json);

/// Reads what the page posts to move a view's camera or to record it: {"view": "main", "orbit_deg": [5, -2],
/// "zoom": 0.9, "home": true, "record": true}; all but `view` may be left out. Angles to ±180, zoom 0.1
/// to 10. The message says what is wrong and what is allowed.
core::Expected<ViewRequest> parse_view_request(const std::string& json);

}  // namespace phantom::synthetic_viewer
